# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages as the bytes that ROS 2 sends, with their stamps moved, and which topics were latched."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags import rosbag1

from vigg_ros.bags.reader import BagReader, SerialisedMessage
from vigg_ros.bags.restamping import moved
from vigg_ros.bags.writer import BagWriter
from vigg_ros.messages.pose_messages import encode_tf, encode_transform
from vigg_ros.messages.sensor_messages import encode_image
from vigg_ros.sensors.point_cloud import decode_points
from vigg_ros_testing.bag_samples import (
    COLOUR,
    INFO,
    LATENCY_NS,
    PERIOD_NS,
    START_NS,
    STORE,
    Entry,
    entry,
    rgbd_entries,
    tf_static_entry,
    write_bag,
    write_ros1_bag,
)

IMAGE, TF = "sensor_msgs/msg/Image", "tf2_msgs/msg/TFMessage"
POINTS = "sensor_msgs/msg/PointCloud2"


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


def message_of(one: Entry, stamp_ns: int | None) -> SerialisedMessage:
    return SerialisedMessage(one.topic, one.type, one.log_ns, stamp_ns, one.data)


def stamp_of(message: SerialisedMessage) -> int:
    stamp = STORE.deserialize_cdr(message.data, message.type).header.stamp
    return stamp.sec * 10**9 + stamp.nanosec


@given(st.integers(-START_NS + 1, 2**31 * 10**9 - START_NS - 1), st.sampled_from([0, 1, 2, 3]))
def test_a_moved_stamp_is_later_by_exactly_that_and_nothing_else_changes(shift_ns: int, kind: int) -> None:
    before = message_of(rgbd_entries(1)[kind], START_NS)
    after = moved(before, shift_ns)
    assert stamp_of(after) == after.stamp_ns == START_NS + shift_ns
    assert after.data[:4] == before.data[:4]
    assert after.data[12:] == before.data[12:]
    assert moved(after, -shift_ns) == before


def test_big_endian_messages_stay_big_endian() -> None:
    header = struct.pack(">iI", 5, 6)
    before = SerialisedMessage(COLOUR, IMAGE, 0, 5_000_000_006, b"\0\0\0\0" + header + b"rest")
    assert moved(before, 1_000_000_001).data == b"\0\0\0\0" + struct.pack(">iI", 6, 7) + b"rest"


@pytest.mark.parametrize("shift_ns", [-START_NS, -2 * START_NS, 2**62])
def test_a_stamp_is_never_moved_out_of_its_range(shift_ns: int) -> None:
    before = message_of(rgbd_entries(1)[0], START_NS)
    assert moved(before, shift_ns) == before


def test_a_stamp_of_zero_stays_zero() -> None:
    one = entry(INFO, encode_image(np.zeros((1, 1), np.uint8), stamp_ns=START_NS, frame_id="a"), START_NS)
    zero = replace(message_of(one, 0), data=one.data[:4] + bytes(8) + one.data[12:])
    assert moved(zero, START_NS) == zero


def test_messages_without_a_header_stay_as_they_are() -> None:
    text = SerialisedMessage("/words", "std_msgs/msg/String", 7, None, b"\0\1\0\0\2\0\0\0a\0")
    assert moved(text, START_NS) == text


def test_the_stamps_in_transforms_move_too() -> None:
    one = tf_static_entry()
    message = SerialisedMessage(one.topic, TF, one.log_ns, None, one.data)
    (transform,) = STORE.deserialize_cdr(moved(message, 5).data, TF).transforms
    assert transform.header.stamp.sec * 10**9 + transform.header.stamp.nanosec == START_NS + 5
    assert moved(moved(message, 5), -5).data == message.data


def scan(times: np.ndarray) -> SerialisedMessage:
    """Points with a time each, as drivers of scanners publish them."""
    dtype = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("timestamp", times.dtype.newbyteorder("<"))]
    table = np.zeros(len(times), dtype)
    table["x"], table["timestamp"] = 3.0, times
    kinds = {"f4": 7, "f8": 8, "u4": 6}
    field, header = STORE.types["sensor_msgs/msg/PointField"], STORE.types["std_msgs/msg/Header"]
    columns = [(name, kind.str[1:], offset) for name, (kind, offset) in table.dtype.fields.items()]
    fields = [field(name, offset, kinds[kind], 1) for name, kind, offset in columns]
    stamp = STORE.types["builtin_interfaces/msg/Time"](*divmod(START_NS, 10**9))
    data = np.frombuffer(table.tobytes(), np.uint8)
    cloud = STORE.types[POINTS](
        header(stamp, "lidar"), 1, len(times), fields, False, table.itemsize, table.nbytes, data, True
    )
    return SerialisedMessage("/points", POINTS, START_NS, START_NS, bytes(STORE.serialize_cdr(cloud, POINTS)))


@pytest.mark.parametrize("unit_s", [1.0, 1e-6, 1e-9])
def test_times_of_points_by_the_clock_move_with_the_stamp(unit_s: float) -> None:
    offsets_s = np.linspace(0.0, 0.1, 50)
    after = moved(scan((START_NS * 1e-9 + offsets_s) / unit_s), 10**17)
    cloud = decode_points(STORE.deserialize_cdr(after.data, POINTS))
    assert cloud.stamp_ns == after.stamp_ns == START_NS + 10**17
    # float64 resolves times since 1970 to 0.24 us, in seconds as in nanoseconds; here it is rounded a few times.
    np.testing.assert_allclose(cloud.times_s, offsets_s, atol=2e-6)


@pytest.mark.parametrize(
    "times", [np.linspace(0, 0.1, 9, dtype="f4"), np.arange(0, 10**8, 10**7, dtype="u4"), np.zeros(9)]
)
def test_times_of_points_from_the_stamp_stay(times: np.ndarray) -> None:
    before = scan(times)
    after = moved(before, 10**17)
    assert stamp_of(after) == START_NS + 10**17
    assert after.data[12:] == before.data[12:]


def test_a_cloud_with_a_fault_keeps_it() -> None:
    before = scan(np.linspace(0, 0.1, 9) + START_NS * 1e-9)
    cloud = STORE.deserialize_cdr(before.data, POINTS)
    cloud.data = cloud.data[:-5]
    short = replace(before, data=bytes(STORE.serialize_cdr(cloud, POINTS)))
    assert moved(short, 10**17).data[12:] == short.data[12:]
