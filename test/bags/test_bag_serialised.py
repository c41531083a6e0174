# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages as the bytes that ROS 2 sends, and which topics were latched."""

from dataclasses import replace
from pathlib import Path

import pytest
from rosbags import rosbag1

from vigg_ros.bags.reader import BagReader, SerialisedMessage
from vigg_ros_testing.bag_samples import COLOUR, LATENCY_NS, STORE, rgbd_entries, write_bag, write_ros1_bag

IMAGE = "sensor_msgs/msg/Image"


def serialised(path: Path, **options) -> list[SerialisedMessage]:
    with BagReader(path) as reader:
        return list(reader.serialised(**options))


@pytest.mark.parametrize("compression", ["NONE", "MESSAGE"])
def test_the_bytes_are_those_that_were_recorded_in_that_order_or_by_stamp(compression: str, tmp_path: Path) -> None:
    late, *others = rgbd_entries()
    entries = [*others, replace(late, log_ns=late.log_ns + 10**9)]
    path = write_bag(tmp_path / "bag", entries, compression=compression)
    found = serialised(path)
    assert [(one.topic, one.type, one.log_ns, one.data) for one in found] == [
        (one.topic, one.type, one.log_ns, one.data) for one in entries
    ]
    assert {one.log_ns - one.stamp_ns for one in found[:-1]} == {LATENCY_NS}
    assert [one.stamp_ns for one in serialised(path, order="stamp")] == sorted(one.stamp_ns for one in found)


def test_messages_of_ros_1_become_those_of_ros_2(tmp_path: Path) -> None:
    entries = rgbd_entries(3)
    found = serialised(write_ros1_bag(tmp_path / "old.bag", entries))
    by_key = {(one.topic, one.log_ns): one.data for one in entries}
    assert len(found) == len(entries)
    for one in found:
        ours, theirs = (STORE.deserialize_cdr(data, one.type) for data in (one.data, by_key[one.topic, one.log_ns]))
        assert ours.header == theirs.header
    image = next(one for one in found if one.topic == COLOUR)
    assert STORE.deserialize_cdr(image.data, IMAGE).data.tobytes() == bytes(8 * 6 * 3)


def test_bytes_that_are_no_message_are_kept_from_subscribers(tmp_path: Path) -> None:
    good, broken = rgbd_entries(2), rgbd_entries(3)[8]
    path = write_bag(tmp_path / "bag", [*good, replace(broken, data=broken.data[:40])])
    with BagReader(path) as reader:
        assert len(list(reader.serialised())) == len(good)
        assert [(loss.topic, loss.count) for loss in reader.losses] == [(COLOUR, 1)]


def test_latched_topics_of_ros_1_are_known_too(tmp_path: Path) -> None:
    one = rgbd_entries(1)[1]
    with rosbag1.Writer(tmp_path / "old.bag") as writer:
        for topic, latching in (("/kept", 1), ("/passing", None)):
            connection = writer.add_connection(topic, one.type, typestore=STORE, latching=latching)
            writer.write(connection, one.log_ns, STORE.cdr_to_ros1(one.data, one.type))
    with BagReader(tmp_path / "old.bag") as reader:
        assert reader.latched() == {"/kept"}
