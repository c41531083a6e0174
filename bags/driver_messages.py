# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What only drivers publish: compressed images and clouds with intensity and time, as message fields."""

from __future__ import annotations

import struct
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.worlds import LidarScan
from vigg_ros.messages.fields import Message, stamped

_PNG_OPTIONS = (cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_NONE)
"""Quantised depth has few values: without row filters the same ones recur, and files are a tenth smaller."""

_FLOAT32 = 7
_CLOUD_FIELDS = ("x", "y", "z", "intensity", "time")


def jpeg(image: NDArray[np.uint8], *, quality: int, stamp_ns: int, frame_id: str) -> Message:
    """sensor_msgs/CompressedImage as compressed_image_transport writes it; image (H, W, 3) BGR."""
    data = cv2.imencode(".jpg", image, (cv2.IMWRITE_JPEG_QUALITY, quality))[1]
    return _compressed_image("bgr8; jpeg compressed bgr8", data, stamp_ns=stamp_ns, frame_id=frame_id)


def compressed_depth(depth_m: NDArray[np.float32], *, stamp_ns: int, frame_id: str) -> Message:
    """sensor_msgs/CompressedImage as compressed_depth_image_transport writes it; depth (H, W), 0 = none.

    A 12-byte header (format and two quantisation parameters, which only float images use), then a
    PNG of millimetres.
    """
    depth_mm = np.rint(depth_m * 1000).astype(np.uint16)
    png = cv2.imencode(".png", depth_mm, _PNG_OPTIONS)[1]
    data = np.frombuffer(struct.pack("<iff", 0, 0.0, 0.0) + png.tobytes(), dtype=np.uint8)
    return _compressed_image("16UC1; compressedDepth png", data, stamp_ns=stamp_ns, frame_id=frame_id)


def lidar_cloud(scan: LidarScan, *, grid_m: float, stamp_ns: int, frame_id: str) -> Message:
    """sensor_msgs/PointCloud2, one row of float32 x y z intensity time; time in seconds from the stamp.

    Coordinates are rounded to grid_m and times to 2^-16 s: with a power of two most of their low bits
    are zero, and the bag is half as large.
    """
    points = np.rint(scan.points / grid_m) * grid_m
    times_s = np.rint(scan.times_s * 2**16) / 2**16
    rows = np.column_stack((points, np.rint(scan.intensities), times_s)).astype("<f4")
    return stamped(
        "sensor_msgs/msg/PointCloud2",
        stamp_ns,
        frame_id,
        height=1,
        width=len(rows),
        fields=tuple(_point_field(name, 4 * place) for place, name in enumerate(_CLOUD_FIELDS)),
        is_bigendian=False,
        point_step=4 * len(_CLOUD_FIELDS),
        row_step=rows.nbytes,
        data=rows.reshape(-1).view(np.uint8),
        is_dense=True,
    )


def _compressed_image(image_format: str, data: NDArray[Any], *, stamp_ns: int, frame_id: str) -> Message:
    return stamped("sensor_msgs/msg/CompressedImage", stamp_ns, frame_id, format=image_format, data=data.ravel())


def _point_field(name: str, offset: int) -> Message:
    return Message.of("sensor_msgs/msg/PointField", name=name, offset=offset, datatype=_FLOAT32, count=1)
