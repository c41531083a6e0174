# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""/clock, for nodes with use_sim_time."""

from __future__ import annotations

from collections.abc import Callable

from builtin_interfaces.msg import Time
from rclpy.node import Node
from rosgraph_msgs.msg import Clock


def clock_publisher(node: Node) -> Callable[[int], None]:
    """A function that publishes a time, ns, on /clock."""
    publisher = node.create_publisher(Clock, "/clock", 10)

    def tell(time_ns: int) -> None:
        sec, nanosec = divmod(time_ns, 1_000_000_000)
        publisher.publish(Clock(clock=Time(sec=sec, nanosec=nanosec)))

    return tell
