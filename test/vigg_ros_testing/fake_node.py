# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A process that looks like the registrar from outside: answers every image at once, with a made-up pose.

The pose of the k-th frame is k cm along x. Every fifth frame counts as dropped. The word after --ros-args
arguments may be ``crash`` (ends after three frames with exit code 7), ``mute`` (never answers) or ``stubborn``
(ends with exit code 3 on SIGINT).
"""

from __future__ import annotations

import os
import sys

import rclpy
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2

BEHAVIOUR = os.environ.get("FAKE_NODE", "")


class FakeNode(Node):
    """The registrar's topics."""

    def __init__(self) -> None:
        super().__init__("registrar")
        for name in ("geometry", "image_transport", "extrinsics", "config"):
            self.declare_parameter(name, "", ignore_override=True)
        image_class = CompressedImage if "image_transport:=compressed" in sys.argv else Image
        by_depth = "geometry:=depth" in sys.argv
        self._poses = self.create_publisher(PoseStamped, "~/pose", 10)
        self._statuses = self.create_publisher(DiagnosticStatus, "~/status", 10)
        self.create_subscription(image_class, "rgb/image", self.answer if by_depth else self.ignore, 10)
        self.create_subscription(CameraInfo, "rgb/camera_info", self.ignore, 10)
        if by_depth:
            self.create_subscription(image_class, "depth/image", self.ignore, 10)
        else:
            self.create_subscription(PointCloud2, "points", self.answer, 10)
        self._count = 0

    def ignore(self, message: object) -> None:
        """Nothing is done with it."""

    def answer(self, message: Image) -> None:
        """A status for every frame, a pose for most."""
        number, self._count = self._count, self._count + 1
        if BEHAVIOUR == "mute":
            return
        if BEHAVIOUR == "crash" and number == 3:
            print("RuntimeError: as asked for", file=sys.stderr, flush=True)
            os._exit(7)
        is_dropped = number % 5 == 4
        stamp = message.header.stamp
        state = "DROPPED" if is_dropped else "TRACKING" if number else "STARTED"
        stamp_ns = stamp.sec * 1_000_000_000 + stamp.nanosec
        values = [KeyValue(key=key, value=str(value)) for key, value in (("stamp_ns", stamp_ns), ("state", state))]
        if is_dropped:
            print(f"[WARN] {number} of {number + 1} were dropped so far (DROPPED)", file=sys.stderr, flush=True)
        else:
            pose = PoseStamped()
            pose.header.stamp = stamp
            pose.header.frame_id = "odom"
            pose.pose.position.x = 0.01 * number
            self._poses.publish(pose)
        self._statuses.publish(DiagnosticStatus(name="registrar", message=state, values=values))


def main() -> int:
    """Spin until SIGINT."""
    rclpy.init()
    node = FakeNode()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        rclpy.try_shutdown()
    return 3 if BEHAVIOUR == "stubborn" else 0


if __name__ == "__main__":
    sys.exit(main())
