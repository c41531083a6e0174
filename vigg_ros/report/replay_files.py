# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The files of a replay, its poses as a bag among them; see docs/data.md, "What a replay leaves behind"."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.writer import BagWriter
from vigg_ros.messages.diagnostic_messages import frame_status
from vigg_ros.messages.pose_messages import encode_path, encode_tf, encode_transform
from vigg_ros.messages.result_messages import PathPoses, PoseMessages
from vigg_ros.messages.tum_lines import tum_line
from vigg_ros.tracking.columns import COLUMN_NAMES, as_text, timing_name, values_of
from vigg_ros.tracking.frame_result import FrameResult
from vigg_ros.tracking.sensor_mount import BaseResult, SensorMount

NODE_NAME, ODOM_FRAME, SENSOR_FRAME = "registrar", "odom", "camera"
"""SENSOR_FRAME stands for that of messages without a frame_id."""

PATH_PERIOD_NS = 500_000_000
"""A path holds poses from the start on, so it is written at 2 Hz only."""


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
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*COLUMN_NAMES, *map(timing_name, stages), "message"])
        for result in results:
            times = (f"{result.timings_ms[s]:.3f}" if s in result.timings_ms else "" for s in stages)
            writer.writerow([*map(as_text, values_of(result).values()), *times, result.message])


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


def write_result_bag(results: Sequence[FrameResult], path: Path) -> None:
    """Poses, odometry, path, status and transforms of the frames. Raises BagError."""
    with BagWriter(path) as writer:
        bag = _ResultBag(writer)
        for result in sorted(results, key=lambda result: (result.session, result.stamp_ns)):
            if result.stamp_ns > 0:
                bag.write(result)


class _ResultBag:
    def __init__(self, writer: BagWriter) -> None:
        self._writer = writer
        self._messages = PoseMessages(odom_frame=ODOM_FRAME, base_frame="")
        self._path_poses: PathPoses[tuple[int, NDArray[np.float64]]] = PathPoses()
        self._path_ns = (-1, 0)

    def write(self, result: FrameResult) -> None:
        stamp_ns, T_odom_frame = result.stamp_ns, result.T_odom_frame
        self._writer.write(f"/{NODE_NAME}/status", frame_status(NODE_NAME, result), log_ns=stamp_ns)
        if T_odom_frame is None:
            return
        result = replace(result, frame_id=result.frame_id or SENSOR_FRAME)
        for topic, message in self._messages.of(BaseResult(result, SensorMount(np.eye(4)))):
            self._writer.write(f"/{NODE_NAME}/{topic}", message, log_ns=stamp_ns)
        transform = encode_transform(
            T_odom_frame, stamp_ns=stamp_ns, frame_id=ODOM_FRAME, child_frame_id=result.frame_id
        )
        self._writer.write("/tf", encode_tf([transform]), log_ns=stamp_ns)
        self._write_path(result.session, stamp_ns, T_odom_frame)

    def _write_path(self, session: int, stamp_ns: int, T_odom_frame: NDArray[np.float64]) -> None:
        self._path_poses.add((stamp_ns, T_odom_frame), session)
        if self._path_ns[0] == session and stamp_ns - self._path_ns[1] < PATH_PERIOD_NS:
            return
        self._path_ns = session, stamp_ns
        message = encode_path(self._path_poses.take(), stamp_ns=stamp_ns, frame_id=ODOM_FRAME)
        self._writer.write(f"/{NODE_NAME}/path", message, log_ns=stamp_ns)
