# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Publishes a bag's messages as the bytes that it holds, in the rhythm of their stamps."""

from __future__ import annotations

import importlib
import math
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import ExitStack, contextmanager

import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from vigg_ros.bags.reader import BagReader, SerialisedMessage

MAX_PAUSE_NS = 5_000_000_000
"""Longer gaps between stamps are cut to this: a recording was paused, or a clock was set."""
QUEUE_DEPTH = 50
"""A subscriber that is held up for a moment still gets them all: at 30 Hz for more than a second."""
MATCHING_S = 0.5
"""A publisher knows its subscriber a little earlier than the other way round; until then best effort is in vain."""
FLUSH_S = 2.0
MAX_LATE_S = 0.5
POLL_S = 0.02

Wait = Callable[[float], object]
"""Spends at most so many seconds, asleep or with something else."""


@contextmanager
def ros_node(name: str, domain_id: int | None) -> Iterator[Node]:
    """A node in a context of its own that leaves Ctrl-C to Python; on ROS_DOMAIN_ID if no domain is given."""
    context = Context()
    # Without arguments: those of the process are the command's, not rclpy's.
    rclpy.init(args=[], context=context, domain_id=domain_id, signal_handler_options=SignalHandlerOptions.NO)
    with ExitStack() as stack:
        stack.callback(context.try_shutdown)
        node = Node(name, context=context, enable_rosout=False, start_parameter_services=False)
        stack.callback(node.destroy_node)
        yield node


class BagPlayer:
    """Publishers for these topics of an open bag (None: all). ``notes`` says which cannot be published, and why."""

    def __init__(self, node: Node, reader: BagReader, names: Collection[str] | None, *, best_effort: bool) -> None:
        self.notes: list[str] = []
        self._late_s = 0.0
        self._reader = reader
        self._publishers: dict[tuple[str, str], Publisher] = {}
        latched = reader.latched() | {"/tf_static"}
        for topic in reader.topics:
            if names is not None and topic.name not in names:
                continue
            try:
                package, _, name = topic.type.partition("/msg/")
                message_class = getattr(importlib.import_module(f"{package}.msg"), name)
                qos = _qos(is_latched=topic.name in latched, best_effort=best_effort)
                self._publishers[topic.name, topic.type] = node.create_publisher(message_class, topic.name, qos)
            except Exception as error:  # not installed; and rclpy has an exception for each kind of bad name
                reason = " ".join(str(error).split())
                self.notes.append(f"{topic.name} ({topic.type}) is not played: {reason}")

    def wait_for_subscribers(self, names: Iterable[str], wait: Wait, *, timeout_s: float = math.inf) -> list[str]:
        """Wait until all these topics have a subscriber; those that have none in time."""
        end_s = time.monotonic() + timeout_s
        while missing := [name for name in names if not self._subscribers(name)]:
            if time.monotonic() > end_s:
                return missing
            wait(POLL_S)
        time.sleep(MATCHING_S)
        return []

    def play(self, rate: float, publishing: Callable[[SerialisedMessage], None], wait: Wait) -> None:
        """Publish all messages once, ``rate`` times as fast as recorded; ``publishing`` is told just before each."""
        start_s: float | None = None
        names = {name for name, _ in self._publishers}
        for position_s, message in with_positions(self._reader.serialised(names, order="stamp")):
            if (message.topic, message.type) in self._publishers:
                start_s = time.monotonic() if start_s is None else start_s
                self._wait_until(start_s + position_s / rate, wait)
                publishing(message)
                self._publishers[message.topic, message.type].publish(message.data)

    def flush(self) -> None:
        """Wait for a moment until reliable subscribers have acknowledged everything: leaving earlier loses it."""
        end_s = time.monotonic() + FLUSH_S
        for publisher in self._publishers.values():
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, end_s - time.monotonic())))

    def lateness_notes(self) -> list[str]:
        """What to tell if the rhythm could not be kept."""
        late = f"the rhythm was not kept: messages came up to {self._late_s:.1f} s late; play with a lower --rate"
        return [late] if self._late_s > MAX_LATE_S else []

    def _subscribers(self, name: str) -> int:
        return sum(one.get_subscription_count() for (topic, _), one in self._publishers.items() if topic == name)

    def _wait_until(self, due_s: float, wait: Wait) -> None:
        left_s = math.inf
        while left_s > 0:
            left_s = due_s - time.monotonic()
            wait(min(max(left_s, 0.0), POLL_S))
        self._late_s = max(self._late_s, -left_s)


def with_positions(messages: Iterable[SerialisedMessage]) -> Iterator[tuple[float, SerialisedMessage]]:
    """When each message is due, seconds from the first one on by their stamps, and the message.

    A message without a stamp is due with the one before it. Where stamps jump back, as in a bag that was recorded from
    a loop, time goes on.
    """
    position_ns, latest_ns = 0, None
    for message in messages:
        if message.stamp_ns:
            if latest_ns is not None:
                position_ns += min(max(message.stamp_ns - latest_ns, 0), MAX_PAUSE_NS)
            latest_ns = message.stamp_ns
        yield position_ns / 1e9, message


def _qos(*, is_latched: bool, best_effort: bool) -> QoSProfile:
    """Reliable serves every subscriber; a latched topic's message waits for those who come late."""
    return QoSProfile(
        depth=QUEUE_DEPTH,
        reliability=ReliabilityPolicy.BEST_EFFORT if best_effort and not is_latched else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE,
    )
