# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A replay's results as a bag, for RViz, Foxglove and other tools."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.writer import BagWriter
from vigg_ros.messages.diagnostic_messages import ERROR, OK, encode_diagnostic_status
from vigg_ros.messages.fields import Message
from vigg_ros.messages.pose_messages import (
    encode_path,
    encode_pose,
    encode_pose_with_covariance,
    encode_tf,
    encode_transform,
)
from vigg_ros.report.recording import FrameRecord

Pose = tuple[int, NDArray[np.float64]]
"""Stamp in nanoseconds and T_odom_frame (4, 4)."""

ODOM_FRAME = "odom"
PATH_PERIOD_NS = 500_000_000
"""A path holds poses from the start on, so it is written at 2 Hz only."""

PATH_POSES = 1_000
"""At most, thinned evenly: paths of all poses so far would let the bag grow with the square of its length,
to gigabytes in an hour, and viewers draw no finer line."""


def write_result_bag(records: Sequence[FrameRecord], sensor_frame: str, path: Path) -> None:
    """Poses, path, status and transforms of the frames, under the node's topic names. Raises BagError."""
    sensor_frame = sensor_frame or "camera"
    with BagWriter(path) as writer:
        track = _Track()
        for record in sorted(records, key=lambda record: (record.session, record.stamp_ns)):
            if record.stamp_ns <= 0:
                continue
            status = _status(record)
            writer.write("/registrar/status", status, log_ns=record.stamp_ns)
            if record.T_odom_frame is not None:
                _write_pose(writer, record, sensor_frame)
                track.write(writer, record)


class _Track:
    """The path so far of the current session."""

    def __init__(self) -> None:
        self._session = 0
        self._poses: list[Pose] = []
        self._written_ns = 0

    def write(self, writer: BagWriter, record: FrameRecord) -> None:
        if record.session != self._session:
            self._session, self._poses, self._written_ns = record.session, [], 0
        assert record.T_odom_frame is not None, "the caller has checked"
        self._poses.append((record.stamp_ns, record.T_odom_frame))
        if record.stamp_ns - self._written_ns >= PATH_PERIOD_NS:
            self._written_ns = record.stamp_ns
            message = encode_path(thinned(self._poses), stamp_ns=record.stamp_ns, frame_id=ODOM_FRAME)
            writer.write("/registrar/path", message, log_ns=record.stamp_ns)


def thinned(poses: Sequence[Pose]) -> list[Pose]:
    """At most PATH_POSES, evenly spread, the first and the newest among them."""
    if len(poses) <= PATH_POSES:
        return list(poses)
    rows = np.linspace(0, len(poses) - 1, PATH_POSES).round().astype(int)
    return [poses[row] for row in rows]


def _write_pose(writer: BagWriter, record: FrameRecord, sensor_frame: str) -> None:
    stamp_ns, T_odom_frame = record.stamp_ns, record.T_odom_frame
    assert T_odom_frame is not None, "the caller has checked"
    pose = encode_pose(T_odom_frame, stamp_ns=stamp_ns, frame_id=ODOM_FRAME)
    writer.write("/registrar/pose", pose, log_ns=stamp_ns)
    transform = encode_transform(
        T_odom_frame, stamp_ns=stamp_ns, frame_id=ODOM_FRAME, child_frame_id=sensor_frame
    )
    writer.write("/tf", encode_tf([transform]), log_ns=stamp_ns)
    if record.covariance is not None:
        pose = encode_pose_with_covariance(
            T_odom_frame, record.covariance, stamp_ns=stamp_ns, frame_id=ODOM_FRAME
        )
        writer.write("/registrar/pose_with_covariance", pose, log_ns=stamp_ns)


def _status(record: FrameRecord) -> Message:
    values = {"stamp_ns": record.stamp_ns, "session": record.session, "reason": record.reason}
    level = OK if record.is_answered else ERROR
    text = f"{record.state} {record.reason} {record.message}".strip()
    return encode_diagnostic_status(level, "registrar", text, values=values)
