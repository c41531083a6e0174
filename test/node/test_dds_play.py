# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg play`` over real DDS: what a subscriber gets is what the bag holds."""

import os
import shlex
import signal
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import pytest
from dds_domain import claim_domain
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String

from vigg_ros.bags.reader import SerialisedMessage, Topic
from vigg_ros.cli.main import main
from vigg_ros.node.player import bag_player
from vigg_ros.node.player.bag_player import MAX_PAUSE_NS, BagPlayer, ros_node, with_positions
from vigg_ros.node.player.dds_profile import VARIABLE
from vigg_ros_testing.bag_samples import COLOUR, DEPTH, FRAMES, INFO, rgbd_entries, write_bag, write_ros1_bag
from vigg_ros_testing.ros_peer import spinning, wait_until

STRING = "std_msgs/msg/String"
SECOND_NS = 1_000_000_000
DOMAIN_ID = claim_domain()
"""Another one than that of the tests of the node in the same process."""

DOMAIN = ["--domain-id", str(DOMAIN_ID)]


class Listener:
    """Keeps the bytes of what arrives, by topic."""

    def __init__(self, node):
        self._node = node
        self.received = {}

    def subscribe(self, message_class, *topics):
        for topic in topics:
            messages = self.received.setdefault(topic, [])
            self._node.create_subscription(message_class, topic, messages.append, 1000, raw=True)


@pytest.fixture
def listener(monkeypatch):
    monkeypatch.setenv(VARIABLE, os.environ.get(VARIABLE, ""))  # the command sets it, and here it is taken back
    with ros_node("listener", DOMAIN_ID) as node, spinning(node):
        listener = Listener(node)
        listener.subscribe(Image, COLOUR, DEPTH)
        listener.subscribe(CameraInfo, INFO)
        yield listener


@pytest.fixture
def bag(tmp_path):
    return write_bag(tmp_path / "bag", rgbd_entries())


def has_all(listener, times=1):
    return wait_until(lambda: min(map(len, listener.received.values())) >= times * FRAMES)


def recorded(topic):
    return [one.data for one in rgbd_entries() if one.topic == topic]


@pytest.mark.parametrize("write", [write_bag, write_ros1_bag])
def test_every_message_arrives_bit_by_bit_in_the_order_of_stamps(write, listener, tmp_path, capsys):
    late, *others = rgbd_entries()
    assert main(["play", str(write(tmp_path / "a.bag", [*others, late])), *DOMAIN]) == 0
    assert has_all(listener)
    for topic, messages in listener.received.items():
        # rosbags writes what was a ROS 1 message without the alignment at its end.
        assert [data.ljust(len(one), b"\0") for data, one in zip(recorded(topic), messages, strict=True)] == messages
    first, last = capsys.readouterr().out.splitlines()
    words = shlex.split(first)  # for the node, and nothing else
    assert words[0] == f"ROS_DOMAIN_ID={DOMAIN_ID}"
    assert {"--ros-args", f"rgb/image:={COLOUR}", f"depth/image:={DEPTH}", "config:=rgbd"} < set(words)
    assert last.startswith(f"played {4 * FRAMES} messages")


def test_a_loop_repeats_the_same_stamps_until_it_is_interrupted(bag, listener):
    def interrupt():
        has_all(listener, 3)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    assert main(["play", str(bag), *DOMAIN, "--loop", "--rate", "4"]) == 130
    assert listener.received[COLOUR][: 3 * FRAMES] == 3 * recorded(COLOUR)


@pytest.mark.parametrize(
    ("number", "ignored"),
    [(signal.SIGINT, False), (signal.SIGINT, True), (signal.SIGTERM, False)],
    ids=["from a terminal", "started with & from a script", "SIGTERM"],
)
def test_signals_end_it_with_130_and_without_a_traceback(bag, number, ignored):
    command = [sys.executable, "-m", "vigg_ros.cli.main", "play", str(bag), *DOMAIN]  # which waits for subscribers
    command = ["sh", "-c", "trap '' INT; exec \"$@\"", "sh", *command] if ignored else command
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert "waiting until the node has subscribed" in process.stderr.readline()
    process.send_signal(number)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert errors == "vigg play: interrupted\n"


def strings(*stamps_ns, topic="/words"):
    return [SerialisedMessage(topic, STRING, 0, stamp_ns, b"\0\1\0\0\2\0\0\0a\0") for stamp_ns in stamps_ns]


def reader_of(*topics, messages=[]):  # noqa: B006
    return SimpleNamespace(topics=topics, latched=lambda: {"/kept"}, serialised=lambda names, order: messages)


@pytest.mark.parametrize("best_effort", [False, True])
def test_latched_topics_are_always_reliable_and_what_cannot_be_published_is_said(best_effort):
    kinds = ["nobody_msgs/msg/Nothing", "std_msgs/msg/Nothing", "std_msgs/String", ""]
    bad = [Topic("/words", "std_msgs/msg/Header", 1), Topic("/no good", STRING, 1), *(Topic("/a", k, 1) for k in kinds)]
    with ros_node("player", DOMAIN_ID) as node:
        reader = reader_of(Topic("/words", STRING, 1), Topic("/kept", STRING, 1), *bad)
        notes = BagPlayer(node, reader, None, best_effort=best_effort).notes
        (words,), (kept,) = (node.get_publishers_info_by_topic(name) for name in ("/words", "/kept"))
    wanted = ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE
    assert (words.qos_profile.reliability, words.qos_profile.durability) == (wanted, DurabilityPolicy.VOLATILE)
    assert kept.qos_profile.reliability == ReliabilityPolicy.RELIABLE
    assert kept.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    assert [note.split(": ")[0] for note in notes] == [f"{one.name} ({one.type}) is not played" for one in bad]


def test_it_waits_for_the_topics_asked_for_and_leaves_when_all_has_arrived(listener):
    with ros_node("player", DOMAIN_ID) as node:
        reader = reader_of(Topic("/words", STRING, 1), Topic("/more", STRING, 1), messages=strings(*[None] * 40))
        player = BagPlayer(node, reader, None, best_effort=False)
        listener.subscribe(String, "/words")
        assert player.wait_for_subscribers(["/words"], time.sleep) == []
        assert player.wait_for_subscribers(["/words", "/more"], time.sleep, timeout_s=0.1) == ["/more"]
        player.play(1.0, lambda message: None, time.sleep)
        player.flush()
    assert wait_until(lambda: len(listener.received["/words"]) == 40)


@pytest.mark.parametrize("rate", [0.25, 1.0, 4.0])
def test_messages_are_due_by_their_stamps_and_the_rate(rate, monkeypatch):
    now_s, sent_s = [17.0], []

    def wait(seconds):
        assert seconds <= bag_player.POLL_S
        now_s[0] += seconds

    def publishing(message):
        sent_s.append(now_s[0])
        now_s[0] += 1.4 / rate * (len(sent_s) == 2)  # the second one takes longer than the third can wait

    monkeypatch.setattr(bag_player, "time", SimpleNamespace(monotonic=lambda: now_s[0]))
    node = SimpleNamespace(create_publisher=lambda *_: SimpleNamespace(publish=lambda data: None))
    messages = strings(*(7 * SECOND_NS + seconds * SECOND_NS for seconds in (0, 1, 2, 4)))
    player = BagPlayer(node, reader_of(Topic("/words", STRING, 4), messages=messages), None, best_effort=False)
    player.play(rate, publishing, wait)
    assert [(at_s - 17.0) * rate for at_s in sent_s] == pytest.approx([0.0, 1.0, 2.4, 4.0])
    late = "the rhythm was not kept: messages came up to 1.6 s late; play with a lower --rate"
    assert player.lateness_notes() == ([late] if rate == 0.25 else [])


def positions_s(*stamps_ns):
    return [position_s for position_s, _ in with_positions(strings(*stamps_ns))]


def test_time_goes_on_where_stamps_are_missing_jump_back_or_lie_far_ahead():
    s = SECOND_NS
    assert positions_s(None, 0, 5 * s, 7 * s, None, 5 * s, 6 * s) == [0, 0, 0, 2, 2, 2, 3]
    assert positions_s(5 * s, 10**6 * s) == [0, MAX_PAUSE_NS / s]
