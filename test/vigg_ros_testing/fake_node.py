# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A process that looks like the registrar from outside: answers every image at once, with a made-up pose.

The pose of the k-th frame is k metres along x, but for the ninth, which is 5 cm further; every fifth frame counts as
dropped. FAKE_NODE can be ``crash`` (ends after three frames with exit code 7), ``mute`` (never answers), ``deaf``
(subscribes to nothing) or ``stubborn`` (ends with exit code 3 on SIGINT).
"""

import os
import signal
import sys
import threading

import rclpy
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import CameraInfo, Image

BEHAVIOUR = os.environ.get("FAKE_NODE", "")


class FakeNode(Node):
    """The registrar's topics."""

    def __init__(self) -> None:
        super().__init__("registrar")
        self._poses = self.create_publisher(PoseStamped, "~/pose", 10)
        self._statuses = self.create_publisher(DiagnosticStatus, "~/status", 10)
        self._count = 0
        if BEHAVIOUR != "deaf":
            self.create_subscription(Image, "rgb/image", self.answer, 10)
            self.create_subscription(CameraInfo, "rgb/camera_info", lambda message: None, 10)
            self.create_subscription(Image, "depth/image", lambda message: None, 10)

    def answer(self, message: Image) -> None:
        """A status for every frame, a pose for most."""
        number, self._count = self._count, self._count + 1
        if BEHAVIOUR == "mute":
            return
        if BEHAVIOUR == "crash" and number == 3:
            print("RuntimeError: as asked for", file=sys.stderr, flush=True)
            os._exit(7)
        state = "DROPPED" if number % 5 == 4 else "TRACKING" if number else "STARTED"
        stamp = message.header.stamp
        values = {"stamp_ns": stamp.sec * 1_000_000_000 + stamp.nanosec, "state": state}
        if state == "DROPPED":
            values["reason"] = "NEWER_FRAME"
            print(f"[WARN] [1.5] {number} of {number + 1} were dropped so far (DROPPED)", file=sys.stderr, flush=True)
        else:
            pose = PoseStamped(header=message.header)
            pose.pose.position.x = number + 0.05 * (number == 8)
            self._poses.publish(pose)
        pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        self._statuses.publish(DiagnosticStatus(message=state, values=pairs))


if __name__ == "__main__":
    ending = threading.Event()
    signal.signal(signal.SIGINT, lambda *_: ending.set())  # an exception could fall into the midst of rclpy
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    print("ready", flush=True)
    node = FakeNode()
    while not ending.is_set():
        rclpy.spin_once(node, timeout_sec=0.1)  # a signal does not end a longer wait
    sys.exit(3 if BEHAVIOUR == "stubborn" else 0)
