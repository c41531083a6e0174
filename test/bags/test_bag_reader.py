# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whole bags of every kind say the same."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from vigg_ros.bags.reader import BagReader, Topic
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
    TRUTH,
    colour_pixels,
    rgbd_entries,
    storage_file,
    tf_static_entry,
    write_bag,
    write_ros1_bag,
    write_split_bag,
)

KINDS_ROW = pytest.mark.hostile(
    "Bags: mcap and sqlite3 folders, lone .mcap and .db3, zstd by file, message and chunk, ROS 1 .bag, split bags A"
)

KINDS = {
    "mcap folder": lambda at: write_bag(at / "bag", rgbd_entries()),
    "sqlite3 folder": lambda at: write_bag(at / "bag", rgbd_entries(), storage="sqlite3"),
    "lone mcap": lambda at: storage_file(write_bag(at / "bag", rgbd_entries())),
    "lone db3": lambda at: storage_file(write_bag(at / "bag", rgbd_entries(), storage="sqlite3")),
    "metadata.yaml itself": lambda at: write_bag(at / "bag", rgbd_entries()) / "metadata.yaml",
    "mcap zstd by chunk": lambda at: write_bag(at / "bag", rgbd_entries(), compression="STORAGE"),
    "mcap zstd by message": lambda at: write_bag(at / "bag", rgbd_entries(), compression="MESSAGE"),
    "mcap zstd by file": lambda at: write_bag(at / "bag", rgbd_entries(), compression="FILE"),
    "sqlite3 zstd by message": lambda at: write_bag(
        at / "bag", rgbd_entries(), storage="sqlite3", compression="MESSAGE"
    ),
    "sqlite3 zstd by file": lambda at: write_bag(at / "bag", rgbd_entries(), storage="sqlite3", compression="FILE"),
    "lone mcap zstd by message": lambda at: storage_file(write_bag(at / "bag", rgbd_entries(), compression="MESSAGE")),
    "lone mcap.zstd": lambda at: storage_file(write_bag(at / "bag", rgbd_entries(), compression="FILE")),
    "ROS 1": lambda at: write_ros1_bag(at / "old.bag", rgbd_entries()),
    "ROS 1 lz4": lambda at: write_ros1_bag(at / "old.bag", rgbd_entries(), compress=True),
    "split mcap": lambda at: write_split_bag(at / "bag", rgbd_entries()),
    "split sqlite3": lambda at: write_split_bag(at / "bag", rgbd_entries(), storage="sqlite3"),
}


@KINDS_ROW
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_bag_holds_the_same_messages(kind: str, tmp_path: Path) -> None:
    with BagReader(KINDS[kind](tmp_path)) as reader:
        assert {topic.name: topic.count for topic in reader.topics} == dict.fromkeys(
            (COLOUR, INFO, DEPTH, TRUTH), FRAMES
        )
        messages = list(reader.messages())
        assert not reader.damaged
        assert reader.notes == ()
    for topic, read in (
        (COLOUR, lambda message: decode_image(message).image[0, 0, 0]),
        (DEPTH, lambda message: round(1000 * decode_depth(message).depth_m[0, 0]) - 1000),
        (TRUTH, lambda message: message.pose.position.x),
    ):
        assert [read(one.message) for one in messages if one.topic == topic] == list(range(FRAMES))
    assert {float(one.message.k[0]) for one in messages if one.topic == INFO} == {7.0}


@KINDS_ROW
@pytest.mark.parametrize("kind", KINDS)
def test_stamps_keep_all_19_digits(kind: str, tmp_path: Path) -> None:
    with BagReader(KINDS[kind](tmp_path)) as reader:
        entries = reader.stamps([COLOUR])
        stamps = [decode_image(one.message).stamp_ns for one in reader.messages([COLOUR])]
    assert stamps == [START_NS + k * PERIOD_NS for k in range(FRAMES)]
    assert [(one.stamp_ns, one.log_ns) for one in entries] == [(ns, ns + LATENCY_NS) for ns in stamps]


@pytest.mark.parametrize("order", ["stamp", "log"])
def test_only_the_chosen_topics_are_read(order: str, tmp_path: Path) -> None:
    with BagReader(write_bag(tmp_path / "bag", rgbd_entries())) as reader:
        read = [one.topic for one in reader.messages([DEPTH, "/not/there"], order=order)]
    assert read == [DEPTH] * FRAMES


def test_no_topics_is_not_all_topics(tmp_path: Path) -> None:
    with BagReader(write_bag(tmp_path / "bag", rgbd_entries())) as reader:
        assert list(reader.messages([])) == []


def test_topics_tell_names_types_and_counts(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", [*rgbd_entries(1), tf_static_entry()])
    with BagReader(bag) as reader:
        assert reader.topics == (
            Topic(DEPTH, "sensor_msgs/msg/Image", 1),
            Topic(INFO, "sensor_msgs/msg/CameraInfo", 1),
            Topic(COLOUR, "sensor_msgs/msg/Image", 1),
            Topic(TRUTH, "geometry_msgs/msg/PoseStamped", 1),
            Topic("/tf_static", "tf2_msgs/msg/TFMessage", 1),
        )
        assert reader.encodings() == {COLOUR: "bgr8", DEPTH: "16UC1"}


def test_messages_are_deserialised_only_when_asked_for(tmp_path: Path, monkeypatch) -> None:
    decoded = []
    with BagReader(write_bag(tmp_path / "bag", rgbd_entries())) as reader:
        original = reader._decoder.message
        monkeypatch.setattr(reader._decoder, "message", lambda raw: decoded.append(raw) or original(raw))
        messages = reader.messages()
        assert decoded == []
        next(messages)
        assert len(decoded) == 1


def test_a_second_reading_says_the_same(tmp_path: Path) -> None:
    with BagReader(write_bag(tmp_path / "bag", rgbd_entries())) as reader:
        first, second = ([(one.topic, one.log_ns) for one in reader.messages()] for _ in range(2))
    assert first == second
    assert len(first) == 4 * FRAMES


def test_a_bag_that_is_not_open_is_not_an_empty_bag(tmp_path: Path) -> None:
    reader = BagReader(write_bag(tmp_path / "bag", rgbd_entries(1)))
    for _ in range(2):
        with pytest.raises(BagError, match="is not open; read it within 'with"):
            next(reader.messages())
        with reader:
            assert len(list(reader.messages())) == 4
            assert not reader.damaged


def test_pixels_survive(tmp_path: Path) -> None:
    with BagReader(write_bag(tmp_path / "bag", rgbd_entries(3))) as reader:
        images = [decode_image(one.message).image for one in reader.messages([COLOUR])]
    np.testing.assert_array_equal(images, [colour_pixels(k) for k in range(3)])


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
    [("nothing.mcap", "does not exist"), ("empty", "holds no metadata.yaml"), ("text.txt", "is not a bag")],
)
def test_what_is_no_bag_is_refused_by_name(name: str, complaint: str, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.txt").write_text("hello")
    with pytest.raises(BagError, match=complaint), BagReader(tmp_path / name):
        pass


def test_a_folder_of_ros1_bags_asks_for_one_of_them(tmp_path: Path) -> None:
    write_ros1_bag(tmp_path / "run.bag", rgbd_entries(1))
    with pytest.raises(BagError, match=r"give one of them: run\.bag"), BagReader(tmp_path):
        pass


def test_the_split_parts_are_read_in_their_number_order_without_metadata(tmp_path: Path) -> None:
    # By name, bag_10 would stand before bag_2.
    bag = write_split_bag(tmp_path / "bag", rgbd_entries(), parts=11)
    (bag / "metadata.yaml").unlink()
    with BagReader(bag) as reader:
        log_times = [one.log_ns for one in reader.messages(order="log")]
    assert log_times == sorted(log_times)
    assert len(log_times) == 4 * FRAMES


def test_a_renamed_bag_is_found(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries())
    moved = shutil.move(bag, tmp_path / "renamed")
    with BagReader(moved) as reader:
        assert len(list(reader.messages())) == 4 * FRAMES
        assert not reader.damaged
