# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Small bags of a camera with depth images or a scanner, for the pages about them; and the camera of conftest.py."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from vigg_ros.bags.writer import BagWriter
from vigg_ros.messages.fields import Message
from vigg_ros.messages.pose_messages import encode_tf, encode_transform
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image, encode_points
from vigg_ros.registration.camera import Camera

START_NS = 1_700_000_000_123_456_789
PERIOD_NS = 100_000_000
CAMERA = Camera(width_px=64, height_px=48, fx_px=50.0, fy_px=50.0, cx_px=31.5, cy_px=23.5)
COLOUR, INFO, DEPTH, CLOUD = "/cam/color/image_raw", "/cam/color/camera_info", "/cam/depth/image_raw", "/points"
RGBD = COLOUR, INFO, DEPTH

VIEWED_BY = Camera(160, 120, 131.0, 131.0, 79.5, 59.5)
"""The camera of the folder of a few small views that the tests of the commands share."""
INTRINSICS = ["--intrinsics", "131", "131", "79.5", "59.5"]
"""The same for the command line."""


def picture(number: int) -> np.ndarray:
    return np.random.default_rng(number).integers(0, 256, (48, 64, 3), dtype=np.uint8)


def sensor_message(topic: str, number: int, stamp_ns: int) -> Message:
    header = {"stamp_ns": stamp_ns, "frame_id": "lidar" if topic == CLOUD else "camera"}
    if topic == COLOUR:
        return encode_image(picture(number), **header)
    if topic == INFO:
        return encode_camera_info(CAMERA, **header)
    if topic == DEPTH:
        return encode_image(np.full((48, 64), 2000, np.uint16), **header)
    # A wall 10 m ahead along x, as scanners see it, and a little beyond what the camera sees.
    y, z = np.meshgrid(np.linspace(-8, 8, 60), np.linspace(-5, 5, 40))
    points = np.column_stack((np.full(y.size, 10.0), y.ravel(), z.ravel()))
    return encode_points(points, **header)


def write(
    path: Path,
    topics: tuple[str, ...],
    *,
    offsets_ns: dict[str, int] | None = None,
    frames: int = 6,
    message_of: Callable[[str, int, int], Message | None] = sensor_message,
    T_lidar_camera: np.ndarray | None = None,
) -> Path:
    """A bag of these topics, 10 Hz; an offset moves the stamps of a topic, ``message_of`` changes or omits messages.

    With ``T_lidar_camera`` the bag begins with /tf_static.
    """
    with BagWriter(path) as writer:
        if T_lidar_camera is not None:
            transform = encode_transform(T_lidar_camera, stamp_ns=START_NS, frame_id="lidar", child_frame_id="camera")
            writer.write("/tf_static", encode_tf([transform]), log_ns=START_NS)
        for number in range(frames):
            log_ns = START_NS + number * PERIOD_NS
            for topic in topics:
                message = message_of(topic, number, log_ns + (offsets_ns or {}).get(topic, 0))
                if message is not None:
                    writer.write(topic, message, log_ns=log_ns)
    return path


def write_static(path: Path, T_lidar_camera: np.ndarray) -> Path:
    """A bag of a camera and a scanner with /tf_static."""
    return write(path, (COLOUR, INFO, CLOUD), T_lidar_camera=T_lidar_camera)


def with_fields(message: Message, **fields: object) -> Message:
    """The message with other values in some fields, which the encoder might refuse to write."""
    return Message(message.type, {**message.fields, **fields})


def looking_along_x() -> np.ndarray:
    """T_lidar_camera of a camera (z forward) at the scanner, looking along its x."""
    T_lidar_camera = np.eye(4)
    T_lidar_camera[:3, :3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
    return T_lidar_camera
