# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One good message or more for each decoder: what real classes must carry and fuzzing starts from."""

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vigg_ros.sensors.camera_info import decode_camera_info
from vigg_ros.sensors.colour_image import decode_image
from vigg_ros.sensors.compressed_depth import decode_compressed_depth
from vigg_ros.sensors.compressed_image import decode_compressed_image
from vigg_ros.sensors.depth_image import decode_depth
from vigg_ros.sensors.point_cloud import decode_points
from vigg_ros_testing.message_samples import (
    camera_info,
    cloud,
    compressed,
    header,
    image,
    jpeg,
    png,
    png_payload,
    region,
    reject,
    rvl_payload,
    xyz_table,
)

MILLIMETRES = np.array([[900, 1000], [0, 65_535], [2000, 4000]], "<u2")
POINTS = np.arange(1.0, 31.0).reshape(10, 3)
TIMES_NS = np.arange(10, dtype=">u4") * 10**7


def raw_camera(msg: Any) -> Any:
    return decode_camera_info(msg, images="raw")


def rectified_camera(msg: Any) -> Any:
    return decode_camera_info(msg, images="rectified")


TYPES = {
    decode_image: "Image",
    decode_depth: "Image",
    decode_compressed_image: "CompressedImage",
    decode_compressed_depth: "CompressedImage",
    raw_camera: "CameraInfo",
    rectified_camera: "CameraInfo",
    decode_points: "PointCloud2",
}


@dataclass(frozen=True)
class Sample:
    """A message and its decoder."""

    decode: Callable[[Any], Any]
    message: Any

    @property
    def type(self) -> str:
        """In sensor_msgs."""
        return TYPES[self.decode]

    def changed(self, **changes: Any) -> Any:
        """The message with some of its fields replaced."""
        return SimpleNamespace(**{**vars(self.message), **changes})


SAMPLES = {
    "bgr8": Sample(decode_image, image(np.arange(24, dtype="u1").reshape(2, 4, 3), "bgr8")),
    "mono16": Sample(decode_image, image(np.arange(8, dtype=">u2").reshape(2, 4) * 8191, "mono16")),
    "bayer": Sample(decode_image, image(np.arange(48, dtype="u1").reshape(6, 8), "bayer_grbg8")),
    "nv12": Sample(decode_image, image(np.arange(36, dtype="u1").reshape(6, 6), "nv12", height=4, width=6)),
    "16UC1": Sample(decode_depth, image(MILLIMETRES, "16UC1")),
    "32FC1": Sample(decode_depth, image(MILLIMETRES.astype(">f4"), "32FC1")),
    "64FC1": Sample(decode_depth, image(MILLIMETRES.astype("<f8") / 1000, "64FC1")),
    "png": Sample(decode_compressed_image, compressed(png(np.ones((3, 4, 3), "u1")), "png")),
    "jpeg": Sample(decode_compressed_image, compressed(jpeg(np.arange(192, dtype=np.uint8).reshape(8, 8, 3)), "jpeg")),
    "depth png": Sample(decode_compressed_depth, compressed(png_payload(MILLIMETRES), "16UC1; compressedDepth png")),
    "depth rvl": Sample(
        decode_compressed_depth, compressed(rvl_payload(MILLIMETRES, 10_100.0, -1_009.0), "32FC1; compressedDepth rvl")
    ),
    "distorted camera": Sample(
        raw_camera, camera_info(d=[-0.3, 0.1, 0.001, -0.002, 0.0], binning_x=2, roi=region(100, 40, 200, 150))
    ),
    "fisheye camera": Sample(
        raw_camera, camera_info(width=64, height=48, d=[0.1, 0.01, 0.0, 0.0], distortion_model="equidistant")
    ),
    "rectified camera": Sample(rectified_camera, camera_info()),
    "organised points": Sample(decode_points, cloud(xyz_table(POINTS, ">f4", t=TIMES_NS).reshape(2, 5))),
    "points": Sample(
        decode_points, cloud(xyz_table(POINTS, "<f8", time=np.linspace(0, 0.1, 10)), header=header(frame_id="/lidar"))
    ),
}

EACH_SENSOR = [SAMPLES[name] for name in ("bgr8", "16UC1", "png", "depth png", "points")]
"""One sample for each decoder of what a sensor sees at a time."""


def cases(*tables: list[tuple[Any, ...]]) -> list[Any]:
    """Parameters (decode, message, code) of rows (decode, code, marks, messages)."""
    return [
        pytest.param(decode, message, code, marks=marks, id=f"{decode.__name__} {code}")
        for decode, code, marks, messages in (row for table in tables for row in table)
        for message in messages
    ]


def assert_refused(decode: Callable[[Any], Any], message: Any, code: str) -> None:
    error = reject(decode, message)
    assert error.code == code
    assert len(error.found) < 300
    assert error.found.isprintable()
