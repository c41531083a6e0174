# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whole bags of every kind say the same, as messages and as the bytes that ROS 2 sends."""

import shutil
from dataclasses import replace
from functools import partial
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
from rosbags import rosbag1

from vigg_ros.bags.reader import BagReader, SerialisedMessage, Topic
from vigg_ros.registration.errors import BagError
from vigg_ros.sensors.colour_image import decode_image
from vigg_ros.sensors.depth_image import decode_depth
from vigg_ros_testing.bag_samples import (
    COLOUR,
    DEPTH,
    FRAMES,
    INFO,
    LATENCY_NS,
    PERIOD_NS,
    START_NS,
    STORE,
    TRUTH,
    colour_pixels,
    opened,
    rgbd_entries,
    storage_file,
    tf_static_entry,
    write_bag,
    write_ros1_bag,
    write_split_bag,
)

TOPICS = (COLOUR, INFO, DEPTH, TRUTH)

WAYS = [
    *(("mcap", compression) for compression in ("NONE", "STORAGE", "MESSAGE", "FILE")),
    *(("sqlite3", compression) for compression in ("NONE", "MESSAGE", "FILE")),
]
"""Kinds of storage, and what is packed by zstd: nothing, chunks, messages or the file."""


def folder(at: Path, storage: str = "mcap", compression: str = "NONE") -> Path:
    return write_bag(at / "bag", rgbd_entries(), storage=storage, compression=compression)


KINDS = {
    **{f"{way} folder": partial(folder, storage=way[0], compression=way[1]) for way in WAYS},
    **{f"{way} alone": lambda at, way=way: storage_file(folder(at, *way)) for way in WAYS},
    "metadata.yaml itself": lambda at: folder(at) / "metadata.yaml",
    "ROS 1": lambda at: write_ros1_bag(at / "old.bag", rgbd_entries()),
    "ROS 1 lz4": lambda at: write_ros1_bag(at / "old.bag", rgbd_entries(), compress=True),
    "split mcap": lambda at: write_split_bag(at / "bag", rgbd_entries()),
    "split sqlite3": lambda at: write_split_bag(at / "bag", rgbd_entries(), storage="sqlite3"),
    "renamed": lambda at: Path(shutil.move(folder(at), at / "renamed")),
}


@pytest.mark.hostile(
    "Bags: mcap and sqlite3 folders, lone .mcap and .db3, zstd by file, message and chunk, ROS 1 .bag, split bags A"
)
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_bag_holds_the_same_messages(kind: str, tmp_path: Path) -> None:
    with BagReader(KINDS[kind](tmp_path)) as reader:
        assert {topic.name: topic.count for topic in reader.topics} == dict.fromkeys(TOPICS, FRAMES)
        entries = reader.stamps([COLOUR])
        messages, again = list(reader.messages()), list(reader.messages())
        assert not reader.damaged
        assert reader.notes == ()
    assert [one.topic for one in messages] == [one.topic for one in again]
    found = {topic: [one.message for one in messages if one.topic == topic] for topic in TOPICS}
    images = [decode_image(message) for message in found[COLOUR]]
    np.testing.assert_array_equal([one.image for one in images], [colour_pixels(k) for k in range(FRAMES)])
    depths = [1000 * decode_depth(message).depth_m[0, 0] for message in found[DEPTH]]
    np.testing.assert_allclose(depths, 1000 + np.arange(FRAMES), rtol=2e-7)
    assert [message.pose.position.x for message in found[TRUTH]] == list(range(FRAMES))
    assert {float(message.k[0]) for message in found[INFO]} == {7.0}
    # All 19 digits of the stamps, with and without decoding.
    assert [one.stamp_ns for one in images] == [START_NS + k * PERIOD_NS for k in range(FRAMES)]
    assert [(one.stamp_ns, one.log_ns) for one in entries] == [(i.stamp_ns, i.stamp_ns + LATENCY_NS) for i in images]


@pytest.mark.parametrize("order", ["stamp", "log"])
def test_only_the_chosen_topics_are_read(order: str, tmp_path: Path) -> None:
    with BagReader(write_bag(tmp_path / "bag", rgbd_entries())) as reader:
        read = [one.topic for one in reader.messages([DEPTH, "/not/there"], order=order)]
        assert list(reader.messages([], order=order)) == []
    assert read == [DEPTH] * FRAMES


def test_topics_tell_names_types_and_counts(tmp_path: Path) -> None:
    entries = [*rgbd_entries(1), tf_static_entry()]
    with BagReader(write_bag(tmp_path / "bag", entries)) as reader:
        assert reader.topics == tuple(
            sorted((Topic(one.topic, one.type, 1) for one in entries), key=attrgetter("name"))
        )
        assert reader.encodings() == {COLOUR: "bgr8", DEPTH: "16UC1"}


def test_a_bag_that_is_not_open_is_not_an_empty_bag(tmp_path: Path) -> None:
    reader = BagReader(write_bag(tmp_path / "bag", rgbd_entries(1)))
    for _ in range(2):
        with pytest.raises(BagError, match="is not open; read it within 'with"):
            next(reader.messages())
        with reader:
            assert len(list(reader.messages())) == 4
            assert not reader.damaged


@pytest.mark.hostile("Bags: 0 or 1 frames: exit 5")
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("frames", [0, 1])
def test_a_bag_with_hardly_a_frame_is_read_without_complaint(storage, frames, tmp_path: Path) -> None:
    declared = [(COLOUR, "sensor_msgs/msg/Image"), (DEPTH, "sensor_msgs/msg/Image")]
    bag = write_bag(tmp_path / "bag", rgbd_entries(frames), storage=storage, topics=declared)
    with BagReader(bag) as reader:
        assert {topic.count for topic in reader.topics if topic.name in (COLOUR, DEPTH)} == {frames}
        assert len(list(reader.messages())) == 4 * frames
        assert not reader.damaged


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("nothing.mcap", "does not exist"),
        ("empty", "holds no metadata.yaml"),
        ("text.txt", "is not a bag"),
        ("", r"give one of them: run\.bag"),  # a folder of ROS 1 bags
    ],
)
def test_what_is_no_bag_is_refused_by_name(name: str, complaint: str, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.txt").write_text("hello")
    write_ros1_bag(tmp_path / "run.bag", rgbd_entries(1))
    with pytest.raises(BagError, match=complaint):
        opened(tmp_path / name)


def test_the_split_parts_are_read_in_their_number_order_without_metadata(tmp_path: Path) -> None:
    # By name, bag_10 would stand before bag_2.
    bag = write_split_bag(tmp_path / "bag", rgbd_entries(), parts=11)
    (bag / "metadata.yaml").unlink()
    with BagReader(bag) as reader:
        log_times = [one.log_ns for one in reader.messages(order="log")]
    assert log_times == sorted(log_times)
    assert len(log_times) == 4 * FRAMES


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
    assert STORE.deserialize_cdr(image.data, image.type).data.tobytes() == bytes(8 * 6 * 3)


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
