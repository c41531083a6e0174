# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages that are not what their type says, and definitions that are not definitions."""

import struct
from dataclasses import replace
from pathlib import Path

import pytest
from backports import zstd

from vigg_ros.bags import decoding
from vigg_ros.bags.decoding import Decoder, Undecodable, header_stamp_ns
from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.storage import Channel, RawMessage
from vigg_ros_testing.bag_samples import (
    COLOUR,
    FRAMES,
    PERIOD_NS,
    START_NS,
    STORE,
    Entry,
    read,
    rgbd_entries,
    storage_file,
    write_bag,
    write_ros1_bag,
)
from vigg_ros_testing.message_samples import allocating_less_than

CDR_ROW = pytest.mark.hostile("Bags: CDR truncated, a 4 GiB length, bad UTF-8: skip, count, continue")
SCHEMA_ROW = pytest.mark.hostile(
    "Bags: a broken schema of an unrelated topic must not refuse the whole bag "
    "(AnyReader does; the low-level Reader does not)"
)
IMAGE = "sensor_msgs/msg/Image"

# A serialised image begins: encapsulation 4, sec 4, nanosec 4, length of frame_id 4, "camera\\0" 7, pad 1,
# height 4, width 4, length of encoding 4, "bgr8\\0" 5, is_bigendian 1, pad 2, step 4, length of data 4.
FRAME_ID_LENGTH, FRAME_ID, DATA_LENGTH = 12, 16, 48


def broken_images() -> dict[str, bytes]:
    data = rgbd_entries(1)[0].data
    assert struct.unpack_from("<I", data, FRAME_ID_LENGTH) == (len("camera\0"),)
    assert struct.unpack_from("<I", data, DATA_LENGTH) == (6 * 8 * 3,)
    return {
        "truncated within the header": data[:10],
        "truncated within the pixels": data[:-20],
        "empty": b"",
        "encapsulation only": data[:4],
        "4 GiB of pixels": with_u32(data, DATA_LENGTH, 2**32 - 1),
        "4 GiB of text": with_u32(data, FRAME_ID_LENGTH, 2**32 - 1),
        "2 GiB of pixels": with_u32(data, DATA_LENGTH, 2**31),
        "text of length 0": with_u32(data, FRAME_ID_LENGTH, 0),
        "bad UTF-8": data[:FRAME_ID] + b"\xff\xfe\x80" + data[FRAME_ID + 3 :],
        "unknown encapsulation": b"\x00\x0b" + data[2:],
        "broken zstd": b"\x28\xb5\x2f\xfd" + data,
        "noise": bytes(range(256)),
    }


def with_u32(data: bytes, position: int, value: int) -> bytes:
    return data[:position] + struct.pack("<I", value) + data[position + 4 :]


@CDR_ROW
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("kind", broken_images())
def test_a_message_that_cannot_be_decoded_is_skipped_and_counted(kind, storage, tmp_path: Path) -> None:
    entries = rgbd_entries()
    entries[4 * 5] = replace(entries[4 * 5], data=broken_images()[kind])
    stamps, reader = read(write_bag(tmp_path / "bag", entries, storage=storage))
    assert stamps == [START_NS + k * PERIOD_NS for k in range(FRAMES) if k != 5]
    (loss,) = reader.losses
    assert (loss.topic, loss.count) == (COLOUR, 1)
    assert str(loss).startswith(f"1 message of {COLOUR}: not decodable; first: ")


@CDR_ROW
@pytest.mark.parametrize("kind", ["4 GiB of pixels", "4 GiB of text"])
def test_a_claimed_length_allocates_nothing(kind: str, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", [replace(rgbd_entries(1)[0], data=broken_images()[kind])])
    with BagReader(bag) as reader:
        list(reader.messages())  # what the type store compiles once is not counted below
        with allocating_less_than(2_000_000):
            assert list(reader.messages()) == []


@CDR_ROW
def test_a_packed_message_is_unpacked_only_to_the_cap(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(decoding, "UNPACKED_BYTES_MAX", 2**20)
    bomb = replace(rgbd_entries(1)[0], data=zstd.compress(bytes(2**26)))
    with BagReader(write_bag(tmp_path / "bag", [bomb])) as reader:
        with allocating_less_than(2**23):
            assert list(reader.messages()) == []
        assert "a message of more than 1048576 bytes" in reader.losses[0].reason


@CDR_ROW
def test_a_broken_ros1_message_is_skipped_and_counted(tmp_path: Path, monkeypatch) -> None:
    entries = rgbd_entries()
    original = STORE.cdr_to_ros1
    cut = entries[8].data
    monkeypatch.setattr(STORE, "cdr_to_ros1", lambda data, name: original(data, name)[: -20 if data is cut else None])
    stamps, reader = read(write_ros1_bag(tmp_path / "old.bag", entries))
    assert len(stamps) == FRAMES - 1
    assert [(loss.topic, loss.count) for loss in reader.losses] == [(COLOUR, 1)]


STRANGE = Entry("/strange", "my_msgs/msg/Strange", START_NS, bytes(12))


@SCHEMA_ROW
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize(
    "definition", ["\n", "no definition at all {{{", "float64[", "unknown/Type x", "uint8 a\nuint8 a", "\0" * 50]
)
def test_a_broken_definition_of_another_type_refuses_nothing(definition, storage, tmp_path: Path) -> None:
    definitions = {STRANGE.type: definition}
    bag = write_bag(tmp_path / "bag", [*rgbd_entries(), STRANGE], storage=storage, definitions=definitions)
    with BagReader(bag) as reader:
        assert len(list(reader.messages([COLOUR]))) == FRAMES
        assert not reader.damaged
        assert len(list(reader.messages())) >= 4 * FRAMES


@SCHEMA_ROW
def test_messages_of_a_broken_definition_are_counted_when_asked_for(tmp_path: Path) -> None:
    _, reader = read(write_bag(tmp_path / "bag", [*rgbd_entries(), STRANGE], definitions={STRANGE.type: "float64["}))
    assert [str(loss) for loss in reader.losses] == [
        "1 message of /strange: not decodable; first: the bag's definition of my_msgs/msg/Strange is "
        "broken (TypesysError)"
    ]


@SCHEMA_ROW
def test_a_broken_definition_of_a_standard_type_does_no_harm(tmp_path: Path) -> None:
    definitions = {IMAGE: "float64[", "sensor_msgs/msg/CameraInfo": "???"}
    stamps, reader = read(write_bag(tmp_path / "bag", rgbd_entries(), definitions=definitions))
    assert len(stamps) == FRAMES
    assert not reader.damaged


@SCHEMA_ROW
def test_a_schema_encoding_that_rosbags_does_not_know_refuses_nothing(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", [STRANGE, *rgbd_entries()], definitions={STRANGE.type: "uint8 x"})
    file = storage_file(bag)
    data = file.read_bytes()
    ros2msg, protobuf = (b"Strange\x07\x00\x00\x00" + name for name in (b"ros2msg", b"protobu"))
    assert data.count(ros2msg) == 2  # in the chunk and in the summary
    file.write_bytes(data.replace(ros2msg, protobuf))
    stamps, reader = read(bag)
    assert "without its index (KeyError: 'protobu')" in reader.notes[0]
    assert len(stamps) == FRAMES


def test_types_of_ones_own_are_read_by_the_definition_in_the_bag(tmp_path: Path) -> None:
    # CDR aligns the float64 to 8 bytes after the encapsulation: 4 bytes of padding follow the 7.
    own = [Entry("/own", "my_msgs/msg/Own", START_NS, b"\x00\x01\x00\x00" + struct.pack("<IId", 7, 0, 2.5))]
    bag = write_bag(tmp_path / "bag", own, definitions={"my_msgs/msg/Own": "uint32 a\nfloat64 b\n"})
    with BagReader(bag) as reader:
        (message,) = (one.message for one in reader.messages())
    assert (message.a, message.b) == (7, 2.5)


def test_an_unknown_serialisation_is_named() -> None:
    with pytest.raises(Undecodable, match="its encoding is 'json', expected CDR or ROS 1"):
        Decoder().message(RawMessage(Channel("/x", IMAGE, "json"), 1, b"{}"))


@pytest.mark.parametrize(("encapsulation", "order"), [(b"\x00\x01\x00\x00", "<"), (b"\x00\x00\x00\x00", ">")])
def test_stamps_are_read_in_both_byte_orders(encapsulation: bytes, order: str) -> None:
    data = encapsulation + struct.pack(order + "iI", 1_700_000_000, 123_456_789)
    assert header_stamp_ns(RawMessage(Channel("/x", IMAGE, "cdr"), 1, data)) == START_NS
    assert header_stamp_ns(RawMessage(Channel("/x", "tf2_msgs/msg/TFMessage", "cdr"), 1, data)) is None, "no header"
