# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A replay's results as a bag, for RViz, Foxglove and other tools: the node's topics, for the pose of the sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.writer import BagWriter
from vigg_ros.messages.diagnostic_messages import frame_status
from vigg_ros.messages.pose_messages import encode_path, encode_tf, encode_transform
from vigg_ros.messages.result_messages import PathPoses, PoseMessages
from vigg_ros.tracking.frame_result import FrameResult
from vigg_ros.tracking.sensor_mount import BaseResult, SensorMount

NODE_NAME, ODOM_FRAME, SENSOR_FRAME = "registrar", "odom", "camera"
"""SENSOR_FRAME stands for that of messages without a frame_id."""

PATH_PERIOD_NS = 500_000_000
"""A path holds poses from the start on, so it is written at 2 Hz only."""


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
