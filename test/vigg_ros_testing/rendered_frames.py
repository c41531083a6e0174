# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Small rendered RGB-D frames as messages, and publishing them."""

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.worlds import HandheldLoop, render_rgbd, room
from vigg_ros.messages.fields import Message
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image
from vigg_ros.node.ros_classes import ros
from vigg_ros.registration.camera import Camera
from vigg_ros_testing.ros_peer import Peer

SMALL = Camera(160, 120, 131.0, 131.0, 79.5, 59.5)
LARGER = Camera(200, 144, 170.0, 170.0, 99.5, 71.5)
START_NS = 1_700_000_000_123_456_789
STEP_NS = 66_666_667
VIEWS = 12
TYPES = {"/rgb/camera_info": "CameraInfo", "/rgb/image": "Image", "/depth/image": "Image"}


@functools.lru_cache(maxsize=64)
def view(number: int, camera: Camera = SMALL) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Image and depth in metres, along a handheld motion at 15 Hz."""
    return render_rgbd(room(seed=2), camera, HandheldLoop().T_world_camera(number / 15))


def stamp_of_frame(number: int) -> int:
    """The stamp of a frame in nanoseconds."""
    return START_NS + number * STEP_NS


def frame(
    number: int, *, camera: Camera = SMALL, stamp_ns: int | None = None, depth_later_ns: int = 0, frame_id: str = "cam"
) -> dict[str, Message]:
    """Calibration, image and depth of a frame, by topic."""
    image, depth_m = view(abs((number + VIEWS) % (2 * VIEWS) - VIEWS), camera)  # to and fro
    at: dict[str, Any] = {"stamp_ns": stamp_ns or stamp_of_frame(number), "frame_id": frame_id}
    return {
        "/rgb/camera_info": encode_camera_info(camera, **at),
        "/rgb/image": encode_image(image, **at),
        "/depth/image": encode_image(depth_m, **at | {"stamp_ns": at["stamp_ns"] + depth_later_ns}),
    }


def send(peer: Peer, messages: dict[str, Message], *, reliable: bool = True) -> None:
    """Publish the messages of a frame."""
    for topic, message in messages.items():
        peer.connect(topic, f"sensor_msgs/msg/{TYPES[topic]}", reliable=reliable).publish(ros(message))


def send_and_wait(peer: Peer, messages: dict[str, Message]) -> dict[str, str]:
    """Publish a frame whose stamps are equal; its status."""
    stamp = messages["/rgb/image"].fields["header"].fields["stamp"].fields
    stamp_ns = str(stamp["sec"] * 10**9 + stamp["nanosec"])
    before = len(peer.answers())
    send(peer, messages)
    found: list[dict[str, str]] = peer.wait(
        lambda: [one for one in peer.answers()[before:] if one["stamp_ns"] == stamp_ns], "the status of the frame"
    )
    return found[0]
