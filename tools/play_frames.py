#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Publishes small rendered RGB-D frames for ever, without end and with stamps of now: python tools/play_frames.py

For measurements of the node; `vigg play` is for recordings. Frames go to and fro along a handheld motion. Needs rclpy.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from collections.abc import Iterator

import numpy as np
import rclpy
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions

from vigg_ros.bench.worlds import HandheldLoop, render_rgbd, room
from vigg_ros.messages.fields import RCLPY, Message, build
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image
from vigg_ros.node.ros_classes import class_of
from vigg_ros.registration.camera import Camera

FRAMES = 20
"""Rendered; they are published forwards and backwards in turn."""


def main() -> int:
    """Publish until the process is ended or the count is reached."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rate", type=float, default=30.0, help="frames per second (default: 30)")
    parser.add_argument("--count", type=int, default=0, help="end after so many frames (default: never)")
    parser.add_argument("--width", type=int, default=320, help="of the images, 4:3 (default: 320)")
    arguments = parser.parse_args()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("play_frames")
    try:
        _play(node, arguments)
    except KeyboardInterrupt:
        pass
    finally:
        rclpy.try_shutdown()
    return 0


def _play(node: rclpy.node.Node, arguments: argparse.Namespace) -> None:
    views = list(rendered(arguments.width))
    topics = {"rgb/image": "Image", "depth/image": "Image", "rgb/camera_info": "CameraInfo"}
    publishers = {
        name: node.create_publisher(class_of(f"sensor_msgs/msg/{kind}"), name, QoSProfile(depth=10))
        for name, kind in topics.items()
    }
    while not all(publisher.get_subscription_count() for publisher in publishers.values()):
        time.sleep(0.05)
    order = itertools.cycle([*range(FRAMES), *range(FRAMES - 2, 0, -1)])
    begun_s = time.monotonic()
    for number, place in enumerate(order):
        if arguments.count and number >= arguments.count:
            time.sleep(1.0)  # what was published last is still on its way
            return
        time.sleep(max(0.0, begun_s + number / arguments.rate - time.monotonic()))
        for name, message in messages(views[place], time.time_ns(), arguments.width).items():
            publishers[name].publish(build(message, class_of, RCLPY))


def camera_of(width_px: int) -> Camera:
    """A 4:3 camera of the bundled bag's angle of view."""
    f, height_px = 277.0 * width_px / 320, width_px * 3 // 4
    return Camera(width_px, height_px, f, f, width_px / 2 - 0.5, height_px / 2 - 0.5)


def rendered(width_px: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Image and depth of FRAMES views along a handheld motion."""
    world, path = room(seed=2), HandheldLoop()
    for number in range(FRAMES):
        yield render_rgbd(world, camera_of(width_px), path.T_world_camera(number / 15))


def messages(view: tuple[np.ndarray, np.ndarray], stamp_ns: int, width_px: int) -> dict[str, Message]:
    """The three messages of a frame, by topic."""
    image, depth_m = view
    at = {"stamp_ns": stamp_ns, "frame_id": "camera_optical_frame"}
    return {
        "rgb/camera_info": encode_camera_info(camera_of(width_px), **at),
        "rgb/image": encode_image(image, **at),
        "depth/image": encode_image(np.rint(1000 * depth_m).astype(np.uint16), **at),
    }


if __name__ == "__main__":
    sys.exit(main())
