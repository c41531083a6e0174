# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The files of a replay: trajectory, frames, configuration; see DESIGN section 5."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vigg_ros.messages.tum_lines import tum_line
from vigg_ros.report.recording import FrameRecord

EVIDENCE = (
    "visual_matches", "visual_inliers", "geometric_matches", "geometric_inliers", "overlap", "consistency", "conflict",
    "likeness",
)  # fmt: skip
HEADER = (
    "stamp_ns", "session", "state", "reason", "keyframe", "keyframe_stamp_ns", "new_keyframe", *EVIDENCE, "rmse_m",
    "sigma_translation_m", "sigma_rotation_deg",
)  # fmt: skip


def tum_lines(records: Sequence[FrameRecord]) -> Iterator[str]:
    """Lines of a TUM trajectory; sessions under a comment."""
    session = None
    for record in records:
        if record.T_odom_frame is None:
            continue
        if record.session != session:
            session = record.session
            yield f"# session {session}"
        yield tum_line(record.stamp_ns, record.T_odom_frame)


def write_trajectory(records: Sequence[FrameRecord], path: Path) -> None:
    """The answered frames as a TUM file."""
    path.write_text("".join(f"{line}\n" for line in tum_lines(records)), encoding="utf-8")


def write_frames(records: Sequence[FrameRecord], path: Path) -> None:
    """One row for each frame received; times are the only columns that differ between two replays."""
    stages = list(dict.fromkeys(stage for record in records for stage in record.timings_ms))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*HEADER, *(f"ms_{stage.replace(' ', '_')}" for stage in stages), "message"])
        for record in records:
            times = (f"{record.timings_ms[s]:.3f}" if s in record.timings_ms else "" for s in stages)
            writer.writerow([*_row(record), *times, record.message])


def write_json(content: Mapping[str, Any], path: Path) -> None:
    """Numbers that are not finite become null: JSON has no word for them."""
    path.write_text(json.dumps(_plain(content), indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _row(record: FrameRecord) -> list[object]:
    start = [record.stamp_ns, record.session, record.state, record.reason]
    start += [_blank(record.keyframe_id), _blank(record.keyframe_stamp_ns)]
    evidence = ["", *([""] * len(EVIDENCE))]
    if record.evidence is not None:
        evidence = [_number(getattr(record.evidence, name)) for name in (*EVIDENCE, "rmse_m")]
    spread = ["", ""]
    if record.covariance is not None:
        deviation = np.sqrt(np.diag(record.covariance))
        spread = [_number(deviation[:3].max()), _number(np.rad2deg(deviation[3:].max()))]
    return [*start, int(record.new_keyframe), *evidence, *spread]


def _number(value: float) -> str:
    return str(value) if isinstance(value, int) else f"{value:.6g}"


def _blank(value: int | None) -> object:
    return "" if value is None else value


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value
