# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses of messages against those of a replay."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.rigid import quaternions_from_rotations
from vigg_ros.tracking.frame_result import FrameResult
from vigg_ros_testing.ros_peer import stamp_of


def vector(T_odom_frame: NDArray[np.float64]) -> NDArray[np.float64]:
    """Position and quaternion (7,)."""
    return np.concatenate((T_odom_frame[:3, 3], quaternions_from_rotations(T_odom_frame[None, :3, :3])[0]))


def vector_of(message: Any) -> NDArray[np.float64]:
    """Position and quaternion (7,) of a message that has a pose."""
    p, q = message.pose.position, message.pose.orientation
    return np.array((p.x, p.y, p.z, q.x, q.y, q.z, q.w))


def assert_equal(poses: Sequence[Any], records: Sequence[FrameResult]) -> None:
    """The same frames got the same poses, to the rounding of a quaternion."""
    answered = [record for record in records if record.T_odom_frame is not None]
    assert [stamp_of(pose) for pose in poses] == [record.stamp_ns for record in answered]
    for pose, record in zip(poses, answered, strict=True):
        assert record.T_odom_frame is not None
        np.testing.assert_allclose(vector_of(pose), vector(record.T_odom_frame), rtol=0, atol=1e-9)
