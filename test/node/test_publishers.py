# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which publishers a bag gets, what they offer, and what is left out."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: source Jazzy, or pip install 'vigg_ros[ros]'")

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from std_msgs.msg import String

from vigg_ros.bags.reader import SerialisedMessage, Topic
from vigg_ros.node.player.bag_publishers import Publishers, find_class
from vigg_ros.node.player.participant import participant
from vigg_ros_testing.dds_listener import DOMAIN_ID, listening, wait_until

STRING = "std_msgs/msg/String"
HELLO = b"\0\1\0\0\6\0\0\0hello\0"
MESSAGE = SerialisedMessage("/words", STRING, 0, None, HELLO)


@pytest.fixture
def node() -> Iterator[Node]:
    with participant("player", domain_id=DOMAIN_ID) as node:
        yield node


@pytest.mark.parametrize("best_effort", [False, True])
def test_latched_topics_are_always_reliable_and_others_as_asked(node: Node, best_effort: bool) -> None:
    topics = [Topic("/words", STRING, 1), Topic("/kept", STRING, 1)]
    publishers = Publishers(node, topics, {"/kept"}, best_effort=best_effort)
    assert publishers.names == {"/words", "/kept"}
    (words,), (kept,) = (node.get_publishers_info_by_topic(name) for name in ("/words", "/kept"))
    wanted = ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE
    assert (words.qos_profile.reliability, words.qos_profile.durability) == (wanted, DurabilityPolicy.VOLATILE)
    assert kept.qos_profile.reliability == ReliabilityPolicy.RELIABLE
    assert kept.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL


def test_who_comes_late_gets_the_latched_message(node: Node) -> None:
    publishers = Publishers(node, [Topic("/words", STRING, 1)], {"/words"}, best_effort=False)
    publishers.publish(MESSAGE)
    with listening() as listener:
        listener.subscribe(String, "/words", latched=True)
        assert wait_until(lambda: len(listener.received["/words"]) == 1)
        assert listener.received["/words"][0].data == "hello"


def test_what_cannot_be_published_is_left_out_and_said(node: Node) -> None:
    topics = [
        Topic("/words", STRING, 1),
        Topic("/words", "std_msgs/msg/Header", 1),
        Topic("/no good", STRING, 1),
        Topic("/a", "nobody_msgs/msg/Nothing", 1),
        Topic("/b", "nobody_msgs/msg/Nothing", 1),
    ]
    publishers = Publishers(node, topics, (), best_effort=False)
    assert publishers.names == {"/words"}
    assert publishers.plays(MESSAGE)
    assert not publishers.plays(SerialisedMessage("/words", "std_msgs/msg/Header", 0, 0, HELLO))
    two_types, bad_name, missing = publishers.notes
    assert "two types" in two_types
    assert "'/no good' is no topic name" in bad_name
    assert missing.endswith("nobody_msgs/msg/Nothing (/a, /b)")


@pytest.mark.parametrize(
    "name", ["std_msgs/String", "os/msg/Path", "../msg/String", "std_msgs/msg/Nothing", "std_msgs/msg/__name__", ""]
)
def test_a_type_that_is_none_has_no_class(name: str) -> None:
    assert find_class(name) is None
    assert find_class(STRING) is String


def test_waiting_ends_when_all_that_is_needed_is_subscribed_to(node: Node) -> None:
    topics = [Topic("/words", STRING, 1), Topic("/more", STRING, 1)]
    publishers = Publishers(node, topics, (), best_effort=False)
    assert not publishers.wait_for_subscribers(0.1)
    with listening() as listener:
        listener.subscribe(String, "/words")
        assert publishers.wait_for_subscribers(20.0)
        assert not publishers.wait_for_subscribers(1.0, publishers.names)
        assert publishers.unheard(publishers.names) == ["/more"]
        listener.subscribe(String, "/more")
        assert publishers.wait_for_subscribers(20.0, publishers.names)


def test_waiting_is_ended_by_a_check_that_fails(node: Node) -> None:
    publishers = Publishers(node, [Topic("/words", STRING, 1)], (), best_effort=False)

    def fail() -> None:
        raise RuntimeError("the node has died")

    with pytest.raises(RuntimeError, match="has died"):
        publishers.wait_for_subscribers(20.0, check=fail)


def test_flushing_waits_until_what_was_sent_has_arrived(node: Node) -> None:
    publishers = Publishers(node, [Topic("/words", STRING, 1)], (), best_effort=False)
    with listening() as listener:
        listener.subscribe(String, "/words")
        assert publishers.wait_for_subscribers(20.0)
        for _ in range(100):
            publishers.publish(MESSAGE)
            time.sleep(0.001)
        publishers.flush()
        assert wait_until(lambda: len(listener.received["/words"]) == 100)
