# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The files of a replay: trajectory, frames, configuration; see docs/data.md, "What a replay leaves behind"."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vigg_ros.messages.tum_lines import tum_line
from vigg_ros.tracking.columns import as_text, timing_name, values_of
from vigg_ros.tracking.frame_result import FrameResult


def write_trajectory(records: Sequence[FrameResult], path: Path) -> None:
    """The answered frames as a TUM file; sessions under a comment."""
    session = None
    with path.open("w", encoding="utf-8") as file:
        for record in records:
            if record.T_odom_frame is None:
                continue
            if record.session != session:
                session = record.session
                file.write(f"# session {session}\n")
            file.write(f"{tum_line(record.stamp_ns, record.T_odom_frame)}\n")


def write_frames(results: Sequence[FrameResult], path: Path) -> None:
    """One row for each frame received; times are the only columns that differ between two replays."""
    stages = list(dict.fromkeys(stage for result in results for stage in result.timings_ms))
    rows = [values_of(result) for result in results]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*(rows[0] if rows else ()), *map(timing_name, stages), "message"])
        for result, row in zip(results, rows, strict=True):
            times = (f"{result.timings_ms[s]:.3f}" if s in result.timings_ms else "" for s in stages)
            writer.writerow([*map(as_text, row.values()), *times, result.message])


def write_json(content: Mapping[str, Any], path: Path) -> None:
    """Numbers that are not finite become null: JSON has no word for them."""
    path.write_text(json.dumps(_plain(content), indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value
