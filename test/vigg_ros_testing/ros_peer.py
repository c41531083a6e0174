# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The other side of the graph: publishes inputs to the node, and keeps what it answers."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry, Path
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image, PointCloud2
from std_srvs.srv import SetBool, Trigger

from vigg_ros.node.player.bag_player import ros_node
from vigg_ros.node.ros_classes import class_of
from vigg_ros.sensors.header import stamp_ns
from vigg_ros_testing.registrar_process import own_domain

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TYPES: dict[str, tuple[Any, QoSProfile]] = {
    "pose": (PoseStamped, QoSProfile(depth=100)),
    "relative_pose": (PoseWithCovarianceStamped, QoSProfile(depth=100)),
    "odom": (Odometry, QoSProfile(depth=100)),
    "path": (Path, LATCHED),
    "keyframe_points": (PointCloud2, LATCHED),
    "status": (DiagnosticStatus, QoSProfile(depth=2000)),
}
PICTURE = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


@contextmanager
def spinning(node: Node) -> Iterator[threading.Thread]:
    """The node's callbacks come in a thread of their own."""
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)

    def spin() -> None:
        with suppress(ExternalShutdownException):
            executor.spin()

    thread = threading.Thread(target=spin, daemon=True)
    thread.start()
    try:
        yield thread
    finally:
        executor.shutdown(5.0)
        thread.join(5.0)


def wait_until(condition: Callable[[], Any], timeout_s: float = 30.0) -> Any:
    """What the condition is when it is true, or after this time: long, as the machine may be busy."""
    end_s = time.monotonic() + timeout_s
    while not (found := condition()) and time.monotonic() < end_s:
        time.sleep(0.005)
    return found


class Peer:
    """A node in a thread of its own, on the domain of this test process."""

    def __init__(self, target: str = "/registrar") -> None:
        self._target = target
        self._stack = ExitStack()
        self.node = self._stack.enter_context(ros_node("peer", own_domain()))
        self.heard: dict[str, list[Any]] = {name: [] for name in (*TYPES, "diagnostics", "matches", "tf")}
        self._clients: dict[str, Any] = {}
        self._publishers: dict[tuple[str, str, bool], Any] = {}
        for name, (kind, qos) in TYPES.items():
            self._listen(name, kind, f"{target}/{name}", qos)
        self._listen("tf", TransformStamped, "/fake_tf", QoSProfile(depth=100))
        self._listen("diagnostics", DiagnosticArray, "/diagnostics", QoSProfile(depth=10))
        self._stack.enter_context(spinning(self.node))

    def watch_matches(self) -> None:
        """Subscribe to the pictures too."""
        self._listen("matches", Image, f"{self._target}/matches", PICTURE)

    def clear(self) -> None:
        """Forget what was heard."""
        for messages in self.heard.values():
            messages.clear()

    def statuses(self, *states: str) -> list[dict[str, str]]:
        """The values of the statuses heard so far, of these states if any are given."""
        found = [values_of(status) | {"text": status.message} for status in list(self.heard["status"])]
        return [one for one in found if not states or one["state"] in states]

    def answers(self) -> list[dict[str, str]]:
        """The statuses of frames; WAITING is of none."""
        return [one for one in self.statuses() if one["state"] != "WAITING"]

    def connect(self, topic: str, type_name: str, *, reliable: bool = True) -> Any:
        """A publisher of the topic, once the node listens to it with the reliability that it should have."""
        key = (topic, type_name, reliable)
        if key not in self._publishers:
            self._publishers[key] = self.offer(topic, type_name, reliable=reliable)
        self.wait(lambda: self._is_followed(topic, type_name, reliable), f"a subscription of {topic}")
        return self._publishers[key]

    def offer(self, topic: str, type_name: str, *, reliable: bool = True) -> Any:
        """A publisher, whether or not anybody listens."""
        reliability = ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT
        return self.node.create_publisher(class_of(type_name), topic, QoSProfile(depth=50, reliability=reliability))

    def withdraw(self) -> None:
        """Destroy all publishers, as a driver that ends."""
        for publisher in self._publishers.values():
            self.node.destroy_publisher(publisher)
        self._publishers.clear()

    def call(self, name: str, *, data: bool | None = None) -> Any:
        """The response of a service of the node that takes nothing or a switch."""
        kind = Trigger if data is None else SetBool
        return self.request(kind, name, kind.Request() if data is None else kind.Request(data=data))

    def begin_anew(self) -> None:
        """Reset the node, and forget what it said before."""
        self.call("reset")
        self.wait_briefly(lambda: False, 0.1)
        self.clear()

    def request(self, kind: Any, name: str, request: Any, timeout_s: float = 20.0) -> Any:
        """The response of a service of the node."""
        done = threading.Event()
        future = self._client(kind, name).call_async(request)
        future.add_done_callback(lambda _: done.set())
        assert done.wait(timeout_s), f"{name} did not answer"
        return future.result()

    def _client(self, kind: Any, name: str) -> Any:
        if name not in self._clients:
            self._clients[name] = self.node.create_client(kind, f"{self._target}/{name}")
        assert self._clients[name].wait_for_service(20.0), f"no service {name}"
        return self._clients[name]

    def wait(self, condition: Callable[[], Any], what: str, timeout_s: float = 30.0) -> Any:
        """Until the condition is true. Raises AssertionError."""
        found = wait_until(condition, timeout_s)
        assert found, f"waited {timeout_s} s in vain for {what}; heard {self.statuses()[-3:]}"
        return found

    def wait_briefly(self, condition: Callable[[], Any], timeout_s: float = 0.5) -> bool:
        """Until the condition is true, or for a while."""
        return bool(wait_until(condition, timeout_s))

    def close(self) -> None:
        """Leave the graph."""
        self._stack.close()

    def _is_followed(self, topic: str, type_name: str, reliable: bool) -> bool:
        found = self.node.get_subscriptions_info_by_topic(topic)
        wanted = ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT
        ready = [one for one in found if one.topic_type == type_name and one.qos_profile.reliability == wanted]
        publisher = self._publishers[(topic, type_name, reliable)]
        return len(ready) == 1 and len(found) == 1 and publisher.get_subscription_count() == 1

    def _listen(self, name: str, kind: Any, topic: str, qos: QoSProfile) -> None:
        self.node.create_subscription(kind, topic, self.heard[name].append, qos)


def values_of(status: DiagnosticStatus) -> dict[str, str]:
    """The key-value pairs of a status."""
    return {pair.key: pair.value for pair in status.values}


def stamp_of(message: Any) -> int:
    """The stamp of a message with a header, in nanoseconds."""
    stamp = message.header.stamp
    return stamp_ns(stamp)
