# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The attributes that decode reads, by message type.

rclpy's classes have them, and so have those of rosbags for ROS 2 and ROS 1. ``data`` is anything with
the buffer protocol: bytes, array.array or a NumPy array of uint8.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol


class TimeMessage(Protocol):
    """builtin_interfaces/Time."""

    sec: int
    nanosec: int


class HeaderMessage(Protocol):
    """std_msgs/Header."""

    stamp: TimeMessage
    frame_id: str


class ImageMessage(Protocol):
    """sensor_msgs/Image."""

    header: HeaderMessage
    height: int
    width: int
    encoding: str
    is_bigendian: int
    step: int
    data: Any


class CompressedImageMessage(Protocol):
    """sensor_msgs/CompressedImage."""

    header: HeaderMessage
    format: str
    data: Any


class RegionMessage(Protocol):
    """sensor_msgs/RegionOfInterest."""

    x_offset: int
    y_offset: int
    height: int
    width: int


class CameraInfoMessage(Protocol):
    """sensor_msgs/CameraInfo; its matrices are d, k, r, p in ROS 2 and D, K, R, P in ROS 1."""

    header: HeaderMessage
    height: int
    width: int
    distortion_model: str
    binning_x: int
    binning_y: int
    roi: RegionMessage


class PointFieldMessage(Protocol):
    """sensor_msgs/PointField."""

    name: str
    offset: int
    datatype: int
    count: int


class PointCloud2Message(Protocol):
    """sensor_msgs/PointCloud2."""

    header: HeaderMessage
    height: int
    width: int
    fields: Sequence[PointFieldMessage]
    is_bigendian: bool
    point_step: int
    row_step: int
    data: Any
