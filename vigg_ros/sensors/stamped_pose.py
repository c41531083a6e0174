# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses and transforms: ground truth on a topic, extrinsics in tf_static."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import DataError
from vigg_ros.registration.rigid import rigid_from_quaternion
from vigg_ros.sensors.header import read_frame_id, read_header
from vigg_ros.sensors.observation import Note, StampedPose


def decode_pose(msg: Any) -> StampedPose:
    """The pose in a PoseStamped, PoseWithCovarianceStamped or Odometry of geometry_msgs and nav_msgs.

    Raises DataError if it is no pose.
    """
    header = read_header(msg.header)
    pose = msg.pose.pose if hasattr(msg.pose, "pose") else msg.pose
    T_frame_child = _matrix(pose.position, pose.orientation)
    child_frame_id = str(getattr(msg, "child_frame_id", "")).lstrip("/")
    return StampedPose(header.stamp_ns, header.frame_id, child_frame_id, T_frame_child, header.notes)


def decode_transform(msg: Any) -> StampedPose:
    """The transform in a geometry_msgs/TransformStamped; its stamp may be 0, as static ones' often are.

    Raises DataError if it is no transform or does not name both frames.
    """
    header = read_header(msg.header, zero_stamp_allowed=True)
    notes: list[Note] = []
    child_frame_id = read_frame_id(msg.child_frame_id, notes)
    if not (header.frame_id and child_frame_id):
        raise DataError(
            "FRAME_ID_EMPTY", found=f"a transform from {child_frame_id!r} to {header.frame_id!r}",
            expected="two frames with names", remedy="check the publisher of this transform",
        )
    T_frame_child = _matrix(msg.transform.translation, msg.transform.rotation)
    return StampedPose(header.stamp_ns, header.frame_id, child_frame_id, T_frame_child, (*header.notes, *notes))


def _matrix(translation: Any, rotation: Any) -> NDArray[np.float64]:
    position_m = (float(translation.x), float(translation.y), float(translation.z))
    return rigid_from_quaternion(position_m, (rotation.x, rotation.y, rotation.z, rotation.w))
