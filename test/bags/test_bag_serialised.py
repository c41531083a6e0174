# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages as the bytes that ROS 2 sends, and which topics were latched."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rosbags import rosbag1

from vigg_ros.bags.reader import BagReader, SerialisedMessage
from vigg_ros.bags.writer import BagWriter
from vigg_ros.messages.pose_messages import encode_tf, encode_transform
from vigg_ros.messages.sensor_messages import encode_image
from vigg_ros_testing.bag_samples import (
    COLOUR,
    LATENCY_NS,
    PERIOD_NS,
    START_NS,
    STORE,
    rgbd_entries,
    write_bag,
    write_ros1_bag,
)

IMAGE = "sensor_msgs/msg/Image"


def serialised(path: Path, **options) -> list[SerialisedMessage]:
    with BagReader(path) as reader:
        return list(reader.serialised(**options))


@pytest.mark.parametrize("compression", ["NONE", "MESSAGE"])
def test_the_bytes_are_those_that_were_recorded(compression: str, tmp_path: Path) -> None:
    entries = rgbd_entries()
    found = serialised(write_bag(tmp_path / "bag", entries, compression=compression))
    assert [(one.topic, one.type, one.log_ns, one.data) for one in found] == [
        (one.topic, one.type, one.log_ns, one.data) for one in entries
    ]
    assert {one.log_ns - one.stamp_ns for one in found} == {LATENCY_NS}


def test_messages_of_ros_1_become_those_of_ros_2(tmp_path: Path) -> None:
    entries = rgbd_entries(3)
    found = serialised(write_ros1_bag(tmp_path / "old.bag", entries))
    by_key = {(one.topic, one.log_ns): one.data for one in entries}
    assert len(found) == len(entries)
    for one in found:
        ours, theirs = (STORE.deserialize_cdr(data, one.type) for data in (one.data, by_key[one.topic, one.log_ns]))
        assert ours.header.stamp == theirs.header.stamp
        assert ours.header.frame_id == theirs.header.frame_id
    image = next(one for one in found if one.topic == COLOUR)
    assert STORE.deserialize_cdr(image.data, IMAGE).data.tobytes() == bytes(8 * 6 * 3)


def test_bytes_that_are_no_message_are_kept_from_subscribers(tmp_path: Path) -> None:
    good, broken = rgbd_entries(2), rgbd_entries(3)[8]
    path = write_bag(tmp_path / "bag", [*good, replace(broken, data=broken.data[:40])])
    with BagReader(path) as reader:
        assert len(list(reader.serialised())) == len(good)
        (loss,) = reader.losses
    assert loss.topic == COLOUR
    assert loss.count == 1


def test_the_order_is_that_of_recording_unless_stamps_are_asked_for(tmp_path: Path) -> None:
    late, *others = rgbd_entries(4)
    entries = [*others, replace(late, log_ns=late.log_ns + 10 * PERIOD_NS)]
    path = write_bag(tmp_path / "bag", entries)
    as_recorded, by_stamp = serialised(path), serialised(path, order="stamp")
    assert as_recorded[-1].stamp_ns == START_NS
    assert [one.stamp_ns for one in by_stamp] == sorted(one.stamp_ns for one in as_recorded)


def test_only_the_topics_asked_for_are_read(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "bag", rgbd_entries(3))
    assert {one.topic for one in serialised(path, topics=[COLOUR, "/nowhere"])} == {COLOUR}


def test_latched_topics_are_known_from_the_quality_of_service_in_the_bag(tmp_path: Path) -> None:
    image = encode_image(np.zeros((2, 2, 3), np.uint8), stamp_ns=START_NS, frame_id="camera")
    with BagWriter(tmp_path / "bag") as writer:
        writer.write("/image", image, log_ns=START_NS)
        transform = encode_transform(np.eye(4), stamp_ns=START_NS, frame_id="a", child_frame_id="b")
        writer.write("/tf_static", encode_tf([transform]), log_ns=START_NS)
    with BagReader(tmp_path / "bag") as reader:
        assert reader.latched() == {"/tf_static"}


def test_latched_topics_of_ros_1_are_known_too(tmp_path: Path) -> None:
    one = rgbd_entries(1)[1]
    with rosbag1.Writer(tmp_path / "old.bag") as writer:
        for topic, latching in (("/kept", 1), ("/passing", None)):
            connection = writer.add_connection(topic, one.type, typestore=STORE, latching=latching)
            writer.write(connection, one.log_ns, STORE.cdr_to_ros1(one.data, one.type))
    with BagReader(tmp_path / "old.bag") as reader:
        assert reader.latched() == {"/kept"}
