# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Subscribes to what is played, in the test's own process, on a domain of its own."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from vigg_ros_testing.dds_domain import claim_domain

DOMAIN_ID = claim_domain()
"""Another one than that of the tests of the node in the same process."""

PATIENCE_S = 20.0
"""For messages that must come: long, as the machine may be busy; a test that passes does not wait for it."""


class Listener:
    """Keeps the bytes of what arrives, by topic."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self.received: dict[str, list[bytes]] = {}

    def subscribe(self, message_class: type, *topics: str) -> None:
        for topic in topics:
            messages = self.received.setdefault(topic, [])
            self._node.create_subscription(message_class, topic, messages.append, 1000, raw=True)


@contextmanager
def listening() -> Iterator[Listener]:
    """A listener whose messages come in by themselves."""
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=DOMAIN_ID)
    node = Node("listener", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def spin() -> None:
        with suppress(ExternalShutdownException):
            executor.spin()

    thread = threading.Thread(target=spin)
    thread.start()
    try:
        yield Listener(node)
    finally:
        executor.shutdown()
        thread.join()
        node.destroy_node()
        context.try_shutdown()


def wait_until(is_true: Callable[[], bool]) -> bool:
    """Whether it became true within PATIENCE_S."""
    end_s = time.monotonic() + PATIENCE_S
    while not is_true():
        if time.monotonic() > end_s:
            return False
        time.sleep(0.01)
    return True
