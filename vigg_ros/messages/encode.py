# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From results to messages, as fields: see ``fields.build`` for how real messages are made of them.

Numbers that are not finite, stamps of 0 and transforms that are none raise ValueError: they would be an
error of this package, and no subscriber shall ever see them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from vigg_ros.messages.encode_header import encode_header, encode_time
from vigg_ros.messages.encode_sensor import encode_camera_info, encode_image, encode_points
from vigg_ros.messages.fields import RCLPY, ROSBAGS, Dialect, Message, Octet, build
from vigg_ros.registration.quaternion import quaternion_from_rotation
from vigg_ros.registration.rigid import is_rigid

__all__ = [
    "RCLPY",
    "ROSBAGS",
    "Dialect",
    "Message",
    "build",
    "encode_camera_info",
    "encode_diagnostic_array",
    "encode_diagnostic_status",
    "encode_image",
    "encode_odometry",
    "encode_path",
    "encode_points",
    "encode_pose",
    "encode_pose_with_covariance",
    "encode_tf",
    "encode_time",
    "encode_transform",
]

OK, WARN, ERROR, STALE = range(4)
"""Levels of diagnostic_msgs/DiagnosticStatus."""


def encode_pose(T_frame_child: NDArray[np.floating], *, stamp_ns: int, frame_id: str) -> Message:
    """geometry_msgs/PoseStamped of a pose (4, 4), metres."""
    fields = {"header": encode_header(stamp_ns, frame_id), "pose": _pose(T_frame_child)}
    return Message("geometry_msgs/msg/PoseStamped", fields)


def encode_pose_with_covariance(
    T_frame_child: NDArray[np.floating], covariance: NDArray[np.floating], *, stamp_ns: int, frame_id: str
) -> Message:
    """geometry_msgs/PoseWithCovarianceStamped; covariance (6, 6) of x, y, z (m) and the rotations (rad)."""
    fields = {
        "header": encode_header(stamp_ns, frame_id),
        "pose": _with_covariance("Pose", _pose(T_frame_child), covariance),
    }
    return Message("geometry_msgs/msg/PoseWithCovarianceStamped", fields)


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
    velocity = _checked(twist, (6,))
    fields = {
        "header": encode_header(stamp_ns, frame_id),
        "child_frame_id": child_frame_id,
        "pose": _with_covariance("Pose", _pose(T_frame_child), covariance),
        "twist": _with_covariance("Twist", _twist(velocity), twist_covariance),
    }
    return Message("nav_msgs/msg/Odometry", fields)


def encode_path(poses: Sequence[tuple[int, NDArray[np.floating]]], *, stamp_ns: int, frame_id: str) -> Message:
    """nav_msgs/Path of (stamp_ns, pose (4, 4)), all in the same frame."""
    stamped = tuple(encode_pose(T, stamp_ns=ns, frame_id=frame_id) for ns, T in poses)
    return Message("nav_msgs/msg/Path", {"header": encode_header(stamp_ns, frame_id), "poses": stamped})


def encode_transform(
    T_frame_child: NDArray[np.floating], *, stamp_ns: int, frame_id: str, child_frame_id: str
) -> Message:
    """geometry_msgs/TransformStamped: where the child is in the frame."""
    translation, rotation = _rigid("Vector3", T_frame_child)
    parts = {"translation": translation, "rotation": rotation}
    fields = {
        "header": encode_header(stamp_ns, frame_id),
        "child_frame_id": child_frame_id,
        "transform": Message("geometry_msgs/msg/Transform", parts),
    }
    return Message("geometry_msgs/msg/TransformStamped", fields)


def encode_tf(transforms: Sequence[Message]) -> Message:
    """tf2_msgs/TFMessage of TransformStamped messages."""
    return Message("tf2_msgs/msg/TFMessage", {"transforms": tuple(transforms)})


def encode_diagnostic_status(
    level: int, name: str, message: str, *, values: Mapping[str, object], hardware_id: str = ""
) -> Message:
    """diagnostic_msgs/DiagnosticStatus; values become text, in their order."""
    pairs = tuple(
        Message("diagnostic_msgs/msg/KeyValue", {"key": key, "value": str(value)}) for key, value in values.items()
    )
    fields = {"level": Octet(level), "name": name, "message": message, "hardware_id": hardware_id, "values": pairs}
    return Message("diagnostic_msgs/msg/DiagnosticStatus", fields)


def encode_diagnostic_array(statuses: Sequence[Message], *, stamp_ns: int) -> Message:
    """diagnostic_msgs/DiagnosticArray of DiagnosticStatus messages."""
    fields = {"header": encode_header(stamp_ns, ""), "status": tuple(statuses)}
    return Message("diagnostic_msgs/msg/DiagnosticArray", fields)


def _pose(T_frame_child: NDArray[np.floating]) -> Message:
    position, orientation = _rigid("Point", T_frame_child)
    return Message("geometry_msgs/msg/Pose", {"position": position, "orientation": orientation})


def _rigid(kind: str, T_frame_child: NDArray[np.floating]) -> tuple[Message, Message]:
    """Translation, as a Point or Vector3, and rotation of a transform."""
    T = _checked(T_frame_child, (4, 4))
    if not is_rigid(T):
        raise ValueError(f"found {T.tolist()}, expected a rigid transform")
    x, y, z, w = quaternion_from_rotation(T[:3, :3])
    rotation = Message("geometry_msgs/msg/Quaternion", {"x": x, "y": y, "z": z, "w": w})
    return _vector(kind, T[:3, 3]), rotation


def _twist(velocity: NDArray[np.float64]) -> Message:
    fields = {"linear": _vector("Vector3", velocity[:3]), "angular": _vector("Vector3", velocity[3:])}
    return Message("geometry_msgs/msg/Twist", fields)


def _with_covariance(kind: str, value: Message, covariance: NDArray[np.floating]) -> Message:
    fields = {kind.lower(): value, "covariance": _checked(covariance, (6, 6)).reshape(-1)}
    return Message(f"geometry_msgs/msg/{kind}WithCovariance", fields)


def _vector(kind: str, xyz: NDArray[np.floating]) -> Message:
    x, y, z = _checked(xyz, (3,)).tolist()
    return Message(f"geometry_msgs/msg/{kind}", {"x": x, "y": y, "z": z})


def _checked(values: NDArray[np.floating], shape: tuple[int, ...]) -> NDArray[np.float64]:
    numbers = np.asarray(values, dtype=np.float64)
    if numbers.shape != shape or not np.isfinite(numbers).all():
        raise ValueError(f"found {numbers.tolist()}, expected finite numbers of shape {shape}")
    return numbers
