# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""sensor_msgs: images, calibrations and clouds as message fields."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.messages.fields import Message, stamped
from vigg_ros.registration.camera import Camera
from vigg_ros.sensors.rectification import IDENTITY_ROTATION, Rectifier

_ENCODINGS_OF_ARRAYS = {("uint8", 2): "mono8", ("uint8", 3): "bgr8", ("uint16", 2): "16UC1", ("float32", 2): "32FC1"}
_FLOAT32 = 7
_NO_REGION = Message.of("sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)


def encode_image(pixels: NDArray[Any], *, stamp_ns: int, frame_id: str) -> Message:
    """sensor_msgs/Image: (H, W) uint8 as mono8, (H, W, 3) as bgr8, uint16 as 16UC1, float32 as 32FC1."""
    encoding = _ENCODINGS_OF_ARRAYS.get((pixels.dtype.name, pixels.ndim))
    if encoding is None or pixels.size == 0 or pixels.shape[2:] not in ((), (3,)):
        raise ValueError(
            f"found an image of shape {pixels.shape} and type {pixels.dtype}, expected "
            "(H, W) of uint8, uint16 or float32, or (H, W, 3) of uint8"
        )
    height, width = pixels.shape[:2]
    data = _little_endian_bytes(pixels)
    return stamped(
        "sensor_msgs/msg/Image", stamp_ns, frame_id,
        height=height, width=width, encoding=encoding, is_bigendian=0, step=data.size // height, data=data,
    )


def encode_camera_info(camera: Camera, *, stamp_ns: int, frame_id: str, rectifier: Rectifier | None = None) -> Message:
    """sensor_msgs/CameraInfo: P of the rectified camera; K, D and R of the raw one with a rectifier."""
    raw = camera if rectifier is None else rectifier.raw
    coefficients = (0.0,) * 5 if rectifier is None else rectifier.coefficients
    return stamped(
        "sensor_msgs/msg/CameraInfo", stamp_ns, frame_id,
        height=raw.height_px, width=raw.width_px,
        distortion_model="plumb_bob" if rectifier is None else rectifier.model,
        d=np.array(coefficients),
        k=raw.matrix.reshape(-1),
        r=np.array(IDENTITY_ROTATION if rectifier is None else rectifier.R_rectified_raw),
        p=np.column_stack((camera.matrix, np.zeros(3))).reshape(-1),
        binning_x=0, binning_y=0, roi=_NO_REGION,
    )


def encode_points(points: NDArray[np.floating], *, stamp_ns: int, frame_id: str) -> Message:
    """sensor_msgs/PointCloud2 of points (N, 3) as float32 x, y, z."""
    table = np.ascontiguousarray(points, dtype="<f4")
    if not np.isfinite(table).all():
        raise ValueError("found points that are not finite, expected metres")
    return stamped(
        "sensor_msgs/msg/PointCloud2", stamp_ns, frame_id,
        height=1, width=len(points),
        fields=tuple(
            Message.of("sensor_msgs/msg/PointField", name=name, offset=4 * place, datatype=_FLOAT32, count=1)
            for place, name in enumerate("xyz")
        ),
        is_bigendian=False, point_step=12, row_step=table.nbytes, data=_little_endian_bytes(table), is_dense=True,
    )


def _little_endian_bytes(values: NDArray[Any]) -> NDArray[np.uint8]:
    ordered = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
    return ordered.reshape(-1).view(np.uint8)
