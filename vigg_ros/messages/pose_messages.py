# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""geometry_msgs, nav_msgs and tf2_msgs: poses, paths, odometry and transforms as message fields.

Numbers that are not finite, stamps of 0 and transforms that are none raise ValueError: they would be an
error of this package, and no subscriber shall ever see them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vigg_ros.messages.fields import Message, stamped
from vigg_ros.registration.rigid import is_rigid, quaternions_from_rotations


def encode_pose(T_frame_child: NDArray[np.floating], *, stamp_ns: int, frame_id: str) -> Message:
    """geometry_msgs/PoseStamped of a pose (4, 4), metres."""
    return stamped("geometry_msgs/msg/PoseStamped", stamp_ns, frame_id, pose=_pose(T_frame_child))


def encode_pose_with_covariance(
    T_frame_child: NDArray[np.floating], covariance: NDArray[np.floating], *, stamp_ns: int, frame_id: str
) -> Message:
    """geometry_msgs/PoseWithCovarianceStamped; covariance (6, 6) of x, y, z (m) and the rotations (rad)."""
    pose = _with_covariance("Pose", _pose(T_frame_child), covariance)
    return stamped("geometry_msgs/msg/PoseWithCovarianceStamped", stamp_ns, frame_id, pose=pose)


def encode_odometry(
    T_frame_child: NDArray[np.floating],
    covariance: NDArray[np.floating],
    twist: NDArray[np.floating],
    twist_covariance: NDArray[np.floating],
    *,
    stamp_ns: int,
    frame_id: str,
    child_frame_id: str,
) -> Message:
    """nav_msgs/Odometry; twist (6,) is linear (m/s) and angular (rad/s) velocity in the child frame."""
    return stamped(
        "nav_msgs/msg/Odometry", stamp_ns, frame_id,
        child_frame_id=child_frame_id,
        pose=_with_covariance("Pose", _pose(T_frame_child), covariance),
        twist=_with_covariance("Twist", _twist(_checked(twist, (6,))), twist_covariance),
    )


def encode_path(poses: Sequence[tuple[int, NDArray[np.floating]]], *, stamp_ns: int, frame_id: str) -> Message:
    """nav_msgs/Path of (stamp_ns, pose (4, 4)), all in the same frame."""
    messages = tuple(encode_pose(T, stamp_ns=ns, frame_id=frame_id) for ns, T in poses)
    return stamped("nav_msgs/msg/Path", stamp_ns, frame_id, poses=messages)


def encode_transform(
    T_frame_child: NDArray[np.floating], *, stamp_ns: int, frame_id: str, child_frame_id: str
) -> Message:
    """geometry_msgs/TransformStamped: where the child is in the frame."""
    translation, rotation = _rigid("Vector3", T_frame_child)
    transform = Message.of("geometry_msgs/msg/Transform", translation=translation, rotation=rotation)
    name = "geometry_msgs/msg/TransformStamped"
    return stamped(name, stamp_ns, frame_id, child_frame_id=child_frame_id, transform=transform)


def encode_tf(transforms: Sequence[Message]) -> Message:
    """tf2_msgs/TFMessage of TransformStamped messages."""
    return Message.of("tf2_msgs/msg/TFMessage", transforms=tuple(transforms))


def _pose(T_frame_child: NDArray[np.floating]) -> Message:
    position, orientation = _rigid("Point", T_frame_child)
    return Message.of("geometry_msgs/msg/Pose", position=position, orientation=orientation)


def _rigid(kind: str, T_frame_child: NDArray[np.floating]) -> tuple[Message, Message]:
    """Translation, as a Point or Vector3, and rotation of a transform."""
    T = _checked(T_frame_child, (4, 4))
    if not is_rigid(T):
        raise ValueError(f"found {T.tolist()}, expected a rigid transform")
    ((x, y, z, w),) = quaternions_from_rotations(T[None, :3, :3]).tolist()
    return _vector(kind, T[:3, 3]), Message.of("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)


def _twist(velocity: NDArray[np.float64]) -> Message:
    linear, angular = _vector("Vector3", velocity[:3]), _vector("Vector3", velocity[3:])
    return Message.of("geometry_msgs/msg/Twist", linear=linear, angular=angular)


def _with_covariance(kind: str, value: Message, covariance: NDArray[np.floating]) -> Message:
    fields = {kind.lower(): value, "covariance": _checked(covariance, (6, 6)).reshape(-1)}
    return Message(f"geometry_msgs/msg/{kind}WithCovariance", fields)


def _vector(kind: str, xyz: NDArray[np.floating]) -> Message:
    x, y, z = xyz.tolist()
    return Message.of(f"geometry_msgs/msg/{kind}", x=x, y=y, z=z)


def _checked(values: NDArray[np.floating], shape: tuple[int, ...]) -> NDArray[np.float64]:
    numbers = np.asarray(values, dtype=np.float64)
    if numbers.shape != shape or not np.isfinite(numbers).all():
        raise ValueError(f"found {numbers.tolist()}, expected finite numbers of shape {shape}")
    return numbers
