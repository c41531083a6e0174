#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A ROS 2 node that uses the odometry: prints the distance travelled, and says when tracking is lost.

    vigg play bags/room_rgbd --loop     # prints the command that starts the registrar; run that in a second shell
    python examples/use_odometry.py     # in a third one

Every frame has a status; only those with a pose have odometry. While LOST nothing is published on ~/odom, so whoever
must stop the robot then listens to ~/status. A new session is a new odometry frame: distances across it mean nothing.
"""

from __future__ import annotations

import math

import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


class OdometryUser(Node):
    """Sums up steps between poses of one session."""

    def __init__(self) -> None:
        super().__init__("odometry_user")
        self._travelled_m = 0.0
        self._last: tuple[float, float, float] | None = None
        self._session = ""
        self.create_subscription(Odometry, "/registrar/odom", self._move, 10)
        self.create_subscription(DiagnosticStatus, "/registrar/status", self._judge, 10)

    def _move(self, message: Odometry) -> None:
        position = message.pose.pose.position
        here = position.x, position.y, position.z
        self._travelled_m += 0.0 if self._last is None else math.dist(self._last, here)
        self._last = here
        print(f"travelled {self._travelled_m:.2f} m", flush=True)

    def _judge(self, status: DiagnosticStatus) -> None:
        values = {pair.key: pair.value for pair in status.values}
        if values.get("state") == "LOST":
            print(f"LOST: {status.message}", flush=True)
        if "session" in values and values["session"] != self._session:
            self._session, self._last = values["session"], None


def main() -> None:
    """Spin until Ctrl-C."""
    rclpy.init()
    try:
        rclpy.spin(OdometryUser())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
