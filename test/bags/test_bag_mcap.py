# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The MCAP reader that needs no index, on files built record by record after the specification."""

import struct
from pathlib import Path
from zlib import crc32

import lz4.frame
import pytest
from backports import zstd

from vigg_ros.bags import mcap
from vigg_ros.bags.losses import Ledger
from vigg_ros.bags.mcap import MAGIC, McapScan
from vigg_ros.bags.reader import BagReader
from vigg_ros_testing.message_samples import allocating_less_than

IMAGE = "sensor_msgs/msg/Image"
HEADER = b"\x04\0\0\0ros2\0\0\0\0"


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


SCHEMA = record(0x03, struct.pack("<H", 1) + text(IMAGE) + text("ros2msg") + text("uint8 x"))
CHANNEL = record(0x04, struct.pack("<HH", 1, 1) + text("/image") + text("cdr") + text(""))
DATA_END = record(0x0F, bytes(4))


def message(number: int, *, channel: int = 1) -> bytes:
    head = struct.pack("<HIQQ", channel, number, 100 - number, 100 - number)
    return record(0x05, head + b"data%d" % number)


def chunk(records: bytes, *, compression: str = "", size: int | None = None, crc: int | None = None) -> bytes:
    packed = {"zstd": zstd.compress, "lz4": lz4.frame.compress}.get(compression, bytes)(records)
    head = struct.pack("<QQQI", 0, 0, len(records) if size is None else size, crc or 0)
    return record(0x06, head + text(compression) + struct.pack("<Q", len(packed)) + packed)


def scan(tmp_path: Path, *parts: bytes, begin: bytes = MAGIC, end: bytes = DATA_END + MAGIC):
    """Numbers of the messages that are read, and what the ledger says."""
    path = tmp_path / "x.mcap"
    path.write_bytes(begin + record(0x01, HEADER) + b"".join(parts) + end)
    ledger = Ledger()
    reader = McapScan(path, ledger)
    numbers = [int(raw.data[4:]) for raw in reader.messages({"/image"})]
    assert reader.counts.total() >= len(numbers)
    return numbers, [loss.reason for loss in ledger.losses], reader


HEAD = SCHEMA + CHANNEL


@pytest.mark.parametrize("compression", ["", "zstd", "lz4"])
def test_chunks_are_read(compression: str, tmp_path: Path) -> None:
    first, second = (chunk(part, compression=compression) for part in (HEAD + message(1), message(2)))
    numbers, damage, reader = scan(tmp_path, first, second)
    assert (numbers, damage, reader.cut) == ([1, 2], [], False)
    (channel,) = reader.channels
    assert (channel.key, channel.encoding) == (("/image", IMAGE), "cdr")
    assert (channel.definition, channel.definition_format) == ("uint8 x", "ros2msg")


ATTACHMENT, UNKNOWN = record(0x09, b"x" * 100), record(0x7F, b"y" * 10)


@pytest.mark.parametrize(
    "parts",
    [
        (HEAD, message(1), message(2)),  # outside of chunks
        (ATTACHMENT, HEAD, message(1), UNKNOWN, message(2)),
        (HEAD, chunk(message(1), crc=crc32(message(1))), message(2)),
    ],
)
def test_what_is_good_is_read_and_what_is_not_asked_for_passed_over(parts, tmp_path: Path) -> None:
    numbers, damage, _ = scan(tmp_path, *parts)
    assert (numbers, damage) == ([1, 2], [])


def test_the_statistics_promise_what_was_written(tmp_path: Path) -> None:
    statistics = record(0x0B, struct.pack("<QHIIIIQQIHQ", 9, 1, 1, 0, 0, 0, 0, 0, 10, 1, 9))
    _, _, reader = scan(tmp_path, HEAD, message(1), DATA_END, statistics, end=MAGIC)
    assert reader.counts == {("/image", IMAGE): 9}


@pytest.mark.parametrize(
    ("broken", "says"),
    [
        (chunk(message(8), compression="zstd", size=7), "fails its size or checksum"),
        (chunk(message(8), crc=crc32(message(8)) ^ 1), "fails its size or checksum"),
        (chunk(message(8), compression="zstd").replace(b"\x28\xb5\x2f\xfd", b"\0\0\0\0"), "zstd data that"),
        (chunk(message(8), compression="lz4").replace(b"\x04\x22\x4d\x18", b"\0\0\0\0"), "lz4 data that"),
        (chunk(message(8), compression="gzip"), "the unknown compression 'gzip'"),
        (chunk(message(8), size=2**40), "a chunk of 1099511627776 bytes"),
        (record(0x06, b"short"), "record that ends at byte"),
        (record(0x05, b"short"), "record that ends at byte"),
        (record(0x04, struct.pack("<HHI", 2, 1, 2**31)), "beyond its record"),
        (record(0x03, struct.pack("<HI", 2, 2) + b"\xff\xff"), "record that ends at byte"),
        (chunk(record(0x06, b"")), "a record of kind 6"),
        (chunk(b"\x05" + struct.pack("<Q", 2**63)), "a record of kind 5 and 9223372036854775808 bytes"),
        (chunk(b"\x05\0\0"), "ends within a record"),
        (message(8, channel=7), "channel 7, which no readable record describes"),
    ],
    ids=range(14),
)
def test_a_broken_record_costs_no_other(broken: bytes, says: str, tmp_path: Path) -> None:
    numbers, damage, _ = scan(tmp_path, HEAD, message(1), broken, message(2))
    assert numbers == [1, 2]
    assert len(damage) == 1
    assert says in damage[0]


@pytest.mark.parametrize("length", [2**31, 2**40, 2**63, 2**64 - 1])
def test_a_length_beyond_the_file_ends_the_reading_and_allocates_nothing(length: int, tmp_path: Path) -> None:
    with allocating_less_than(1_000_000):
        numbers, damage, _ = scan(tmp_path, HEAD, message(1), struct.pack("<BQ", 0x05, length), message(2))
    assert numbers == [1]
    assert f"a record of {length} bytes, of which" in damage[0]


def test_what_is_too_large_to_be_believed_is_passed_over(tmp_path: Path, monkeypatch) -> None:
    bomb, huge = chunk(bytes(2**26), compression="zstd", size=1000), record(0x05, bytes(20_000))
    monkeypatch.setattr(mcap, "UNPACKED_BYTES_MAX", 10_000)
    with allocating_less_than(4_000_000):
        numbers, damage, _ = scan(tmp_path, HEAD, message(1), bomb, huge, message(2))
    assert numbers == [1, 2]
    assert "fails its size" in damage[0]
    assert "record that ends at byte" in damage[1]


@pytest.mark.parametrize(("end", "cut"), [(b"", True), (DATA_END, False), (MAGIC, False)])
def test_a_missing_end_is_a_cut_only_without_both_marks(end: bytes, cut: bool, tmp_path: Path) -> None:
    _, _, reader = scan(tmp_path, HEAD, message(1), end=end)
    assert reader.cut == cut


def test_a_flipped_beginning_is_told(tmp_path: Path) -> None:
    numbers, damage, _ = scan(tmp_path, HEAD, message(1), begin=b"\x89MCAP1\r\n")
    assert (numbers, damage) == ([1], ["x.mcap: the beginning of the file is not MCAP's"])


def test_disorder_in_a_file_without_an_index_is_no_damage(tmp_path: Path) -> None:
    # rosbags reads such files front to back too, but gives up at the first step back in log time.
    path = tmp_path / "x.mcap"
    footer = record(0x02, bytes(20))
    parts = (record(0x01, HEADER), HEAD, message(1), message(2), message(3), DATA_END, footer)
    path.write_bytes(MAGIC + b"".join(parts) + MAGIC)
    with BagReader(path) as reader:
        assert [entry.log_ns for entry in reader.stamps()] == [99, 98, 97]
        assert not reader.damaged
        assert "the rest is read front to back" in reader.notes[0]
