# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A ROS node of this process, from start to end, that leaves Ctrl-C to Python."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions


@contextmanager
def participant(name: str, *, domain_id: int | None = None) -> Iterator[Node]:
    """A node in a context of its own; on ROS_DOMAIN_ID if no domain is given."""
    context = Context()
    # Without arguments: those of the process are the command's, not rclpy's.
    rclpy.init(args=[], context=context, domain_id=domain_id, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Node(name, context=context, enable_rosout=False, start_parameter_services=False)
        try:
            yield node
        finally:
            node.destroy_node()
    finally:
        context.try_shutdown()
