# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One publisher for each topic of a bag. Messages are sent as the bytes that the bag holds."""

from __future__ import annotations

import importlib
import re
import time
from collections.abc import Callable, Collection, Iterable
from typing import Any

from rclpy.duration import Duration
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from vigg_ros.bags.reader import SerialisedMessage, Topic

_TYPE = re.compile(r"([a-z][a-z0-9_]*)/msg/([A-Z][A-Za-z0-9]*)")
_DEPTH = 50
"""A subscriber that is held up for a moment still gets them all: at 30 Hz for more than a second."""
_SETTLED_S = 0.5
_POLL_S = 0.02
_ACKNOWLEDGED_S = 2.0


class Publishers:
    """The publishers of a bag's topics. What cannot be published is left out; ``notes`` says why."""

    def __init__(self, node: Node, topics: Iterable[Topic], latched: Collection[str], *, best_effort: bool) -> None:
        self.notes: list[str] = []
        self._node = node
        self._by_key: dict[tuple[str, str], Publisher] = {}
        without_type: dict[str, list[str]] = {}
        for topic in topics:
            message_class = find_class(topic.type)
            if message_class is None:
                without_type.setdefault(topic.type, []).append(topic.name)
            else:
                self._add(topic, message_class, _quality(is_latched=topic.name in latched, best_effort=best_effort))
        if without_type:
            self.notes.append(_missing_types(without_type))

    @property
    def names(self) -> frozenset[str]:
        """Names of the topics that are published."""
        return frozenset(name for name, _ in self._by_key)

    def plays(self, message: SerialisedMessage) -> bool:
        """Whether there is a publisher for the message."""
        return (message.topic, message.type) in self._by_key

    def publish(self, message: SerialisedMessage) -> None:
        """Send a message that ``plays``."""
        self._by_key[message.topic, message.type].publish(message.data)

    def unheard(self, names: Iterable[str]) -> list[str]:
        """Those of the topics that nobody has subscribed to."""
        heard = {name for (name, _), publisher in self._by_key.items() if publisher.get_subscription_count()}
        return [name for name in names if name not in heard]

    def wait_for_subscribers(
        self, timeout_s: float, needed: Iterable[str] = (), *, check: Callable[[], None] | None = None
    ) -> bool:
        """Wait until somebody listens, on the needed topics or on any, and subscriptions come in no more.

        False if that did not happen in time. ``check`` is called all along, and ends the waiting by raising.
        """
        needed = tuple(needed)
        end_s = time.monotonic() + timeout_s
        counts, since_s = self._counts(), time.monotonic()
        while time.monotonic() < end_s:
            if check is not None:
                check()
            heard = not self.unheard(needed) if needed else any(counts)
            if heard and time.monotonic() - since_s > _SETTLED_S:
                return True
            time.sleep(_POLL_S)
            latest = self._counts()
            if latest != counts:
                counts, since_s = latest, time.monotonic()
        return False

    def flush(self) -> None:
        """Wait for a moment until reliable subscribers have acknowledged everything: leaving earlier loses it."""
        end_s = time.monotonic() + _ACKNOWLEDGED_S
        for publisher in self._by_key.values():
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, end_s - time.monotonic())))

    def _counts(self) -> list[int]:
        return [publisher.get_subscription_count() for publisher in self._by_key.values()]

    def _add(self, topic: Topic, message_class: Any, quality: QoSProfile) -> None:
        if topic.name in self.names:
            self.notes.append(f"{topic.name} holds two types; that as {topic.type} is not played")
            return
        try:
            self._by_key[topic.name, topic.type] = self._node.create_publisher(message_class, topic.name, quality)
        except InvalidTopicNameException as error:
            self.notes.append(f"{topic.name!r} is no topic name in ROS 2 and is not played ({_one_line(error)})")


def find_class(type_name: str) -> Any:
    """The Python class of a type such as sensor_msgs/msg/Image; None if it is not installed."""
    match = _TYPE.fullmatch(type_name)
    if match is None:
        return None
    try:
        return getattr(importlib.import_module(f"{match[1]}.msg"), match[2], None)
    except ImportError:
        return None


def _quality(*, is_latched: bool, best_effort: bool) -> QoSProfile:
    """What is offered. Reliable serves every subscriber; a latched topic's message waits for those who come late."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=_DEPTH,
        reliability=ReliabilityPolicy.BEST_EFFORT if best_effort and not is_latched else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE,
    )


def _missing_types(without_type: dict[str, list[str]]) -> str:
    listed = "; ".join(f"{kind} ({', '.join(names)})" for kind, names in without_type.items())
    return f"not played, as these message types are not installed here: {listed}"


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
