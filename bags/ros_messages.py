# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The messages of the bundled bags, built field by field as their drivers would fill them."""

from __future__ import annotations

import struct
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from vigg_ros.registration.camera import Camera
from vigg_ros.worlds import LidarScan

TYPESTORE = get_typestore(Stores.ROS2_JAZZY)
_TYPES = TYPESTORE.types

_PNG_OPTIONS = (cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_NONE)
"""Quantised depth has few values: without row filters the same ones recur, and files are a tenth smaller."""

Message = Any
"""rosbags makes its message classes at run time: there is no static type to name."""


def jpeg(stamp_ns: int, frame_id: str, image: NDArray[np.uint8], *, quality: int) -> Message:
    """sensor_msgs/CompressedImage as compressed_image_transport writes it; image (H, W, 3) BGR."""
    data = cv2.imencode(".jpg", image, (cv2.IMWRITE_JPEG_QUALITY, quality))[1]
    return _make(
        "sensor_msgs/msg/CompressedImage", _header(stamp_ns, frame_id), "bgr8; jpeg compressed bgr8", data
    )


def compressed_depth(stamp_ns: int, frame_id: str, depth_m: NDArray[np.float32]) -> Message:
    """sensor_msgs/CompressedImage as compressed_depth_image_transport writes it; depth (H, W), 0 = none.

    A 12-byte header (format and two quantisation parameters, which only float images use), then a
    PNG of millimetres.
    """
    depth_mm = np.rint(depth_m * 1000).astype(np.uint16)
    png = cv2.imencode(".png", depth_mm, _PNG_OPTIONS)[1]
    data = np.frombuffer(struct.pack("<iff", 0, 0.0, 0.0) + png.tobytes(), dtype=np.uint8)
    return _make(
        "sensor_msgs/msg/CompressedImage", _header(stamp_ns, frame_id), "16UC1; compressedDepth png", data
    )


def camera_info(stamp_ns: int, frame_id: str, camera: Camera) -> Message:
    """sensor_msgs/CameraInfo of a rectified image."""
    return _make(
        "sensor_msgs/msg/CameraInfo",
        _header(stamp_ns, frame_id),
        height=camera.height_px,
        width=camera.width_px,
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=camera.matrix.ravel(),
        r=np.eye(3).ravel(),
        p=np.column_stack((camera.matrix, np.zeros(3))).ravel(),
        binning_x=0,
        binning_y=0,
        roi=_make("sensor_msgs/msg/RegionOfInterest", 0, 0, 0, 0, False),
    )


def pose_stamped(stamp_ns: int, frame_id: str, T_frame_thing: NDArray[np.float64]) -> Message:
    """geometry_msgs/PoseStamped of a thing in a frame."""
    position = _make("geometry_msgs/msg/Point", *T_frame_thing[:3, 3].tolist())
    pose = _make("geometry_msgs/msg/Pose", position, _quaternion(T_frame_thing))
    return _make("geometry_msgs/msg/PoseStamped", _header(stamp_ns, frame_id), pose)


def static_transform(stamp_ns: int, parent: str, child: str, T_parent_child: NDArray[np.float64]) -> Message:
    """geometry_msgs/TransformStamped inside a tf2_msgs/TFMessage."""
    translation = _make("geometry_msgs/msg/Vector3", *T_parent_child[:3, 3].tolist())
    transform = _make("geometry_msgs/msg/Transform", translation, _quaternion(T_parent_child))
    stamped = _make("geometry_msgs/msg/TransformStamped", _header(stamp_ns, parent), child, transform)
    return _make("tf2_msgs/msg/TFMessage", [stamped])


def point_cloud(stamp_ns: int, frame_id: str, scan: LidarScan) -> Message:
    """sensor_msgs/PointCloud2, unorganised: float32 x y z intensity and time, relative to the stamp."""
    names = ("x", "y", "z", "intensity", "time")
    rows = np.column_stack((scan.points, scan.intensities, scan.times_s)).astype("<f4")
    fields = [_make("sensor_msgs/msg/PointField", name, 4 * at, 7, 1) for at, name in enumerate(names)]
    return _make(
        "sensor_msgs/msg/PointCloud2",
        _header(stamp_ns, frame_id),
        height=1,
        width=len(rows),
        fields=fields,
        is_bigendian=False,
        point_step=4 * len(names),
        row_step=4 * len(names) * len(rows),
        data=rows.reshape(-1).view(np.uint8),
        is_dense=True,
    )


def _make(type_name: str, *values: Any, **fields: Any) -> Message:
    return _TYPES[type_name](*values, **fields)


def _header(stamp_ns: int, frame_id: str) -> Message:
    seconds, nanoseconds = divmod(int(stamp_ns), 1_000_000_000)
    return _make("std_msgs/msg/Header", _make("builtin_interfaces/msg/Time", seconds, nanoseconds), frame_id)


def _quaternion(T_parent_child: NDArray[np.float64]) -> Message:
    x, y, z, w = Rotation.from_matrix(T_parent_child[:3, :3]).as_quat().tolist()
    return _make("geometry_msgs/msg/Quaternion", x, y, z, w)
