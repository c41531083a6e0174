# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Subscriptions that follow their publishers: type, reliability, and what the graph says of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription

from vigg_ros.node.input_monitor import InputMonitor
from vigg_ros.node.ros_classes import class_of
from vigg_ros.node.settings import NodeOptions
from vigg_ros.node.watchdog import TOPICS, InputFacts, Offer
from vigg_ros.sensors.input_decoder import Role

DEPTH = 10
"""Messages that wait in the middleware while a callback runs."""

RAW, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
POINTS, CALIBRATION = "sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/CameraInfo"
_TYPES = {"image": RAW, "depth": RAW, "points": POINTS, "camera_info": CALIBRATION}


class InputTopic:
    """One input: its subscription, which is made anew when publishers with other offers come."""

    def __init__(self, node: Node, role: Role, options: NodeOptions, receive: Callable[[Role, Any], None]) -> None:
        self.role = role
        self.topic: str = node.resolve_topic_name(TOPICS[role])
        self.monitor = InputMonitor()
        self.offers: tuple[Offer, ...] = ()
        self._node = node
        self._options = options
        self._receive = receive
        self._subscription: Subscription | None = None
        self._chosen = ("", False)

    def follow(self) -> bool:
        """Look at the graph and subscribe as its publishers ask; True if the number of publishers changed."""
        before = len(self.offers)
        self.offers = tuple(
            Offer(one.topic_type, one.qos_profile.reliability != ReliabilityPolicy.BEST_EFFORT)
            for one in self._node.get_publishers_info_by_topic(self.topic)
        )
        chosen = (self._type(), self._wants_reliable())
        if chosen != self._chosen:
            if self._subscription is not None:
                self._node.destroy_subscription(self._subscription)
            self._chosen = chosen
            self._subscription = self._subscribe(*chosen)
        return len(self.offers) != before

    def facts(self, now_s: float) -> InputFacts:
        """What the watchdog wants to know."""
        return InputFacts(
            role=self.role,
            topic=self.topic,
            type=self._chosen[0],
            wants_reliable=self._chosen[1],
            offers=self.offers,
            age_s=self.monitor.age_s(now_s),
            last_refusal=self.monitor.last_refusal,
            good=self.monitor.received - sum(self.monitor.refused.values()),
        )

    def _type(self) -> str:
        if _TYPES[self.role] != RAW or self._options.image_transport == "raw":
            return _TYPES[self.role]
        if self._options.image_transport == "compressed":
            return COMPRESSED
        types = {offer.type for offer in self.offers}
        if RAW not in types and COMPRESSED in types:
            return COMPRESSED
        return self._chosen[0] or RAW if not types else RAW

    def _wants_reliable(self) -> bool:
        if self._options.qos != "auto":
            return self._options.qos == "reliable"
        fitting = [offer for offer in self.offers if offer.type == self._type()]
        # Reliable while nobody is there: so the first messages of a recording are not lost to a best-effort reader.
        return all(offer.reliable for offer in fitting)

    def _subscribe(self, type_name: str, reliable: bool) -> Subscription:
        reliability = ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT
        qos = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=DEPTH, reliability=reliability)
        # rclpy's own line on incompatible offers would come before the subscription is made anew; the watchdog
        # says what remains incompatible.
        quiet = SubscriptionEventCallbacks(incompatible_qos=lambda _: None, use_default_callbacks=False)
        return self._node.create_subscription(
            class_of(type_name), self.topic, lambda msg: self._receive(self.role, msg), qos, event_callbacks=quiet
        )


def has_publisher(node: Node, role: str) -> str | None:
    """The topic of a role that is not subscribed, if somebody publishes it."""
    topic = node.resolve_topic_name(TOPICS[role])
    return topic if node.count_publishers(topic) else None
