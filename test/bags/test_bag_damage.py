# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags that are cut, broken or incomplete: refused with a remedy, or read as far as it goes with each loss counted."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from vigg_ros.bags.reader import BagReader
from vigg_ros.registration.errors import BagError
from vigg_ros_testing.bag_samples import (
    COLOUR,
    FRAMES,
    cut,
    flip,
    noise_entries,
    opened,
    read,
    rgbd_entries,
    storage_file,
    write_bag,
    write_ros1_bag,
    write_split_bag,
)

CUT_ROW = pytest.mark.hostile("Bags: cut mcap, cut db3, 0 bytes: exit 3 with the remedy")
METADATA_ROW = pytest.mark.hostile(
    "Bags: metadata.yaml missing: open the file directly N; garbage in it: exit 3 "
    "(rosbags lets UnicodeDecodeError escape)"
)
FLIP_ROW = pytest.mark.hostile(
    'Bags: flipped bits: keep what was read, exit 4 (sqlite3 can read "0 messages" without an error: '
    "compare message_count)"
)
BOTH = pytest.mark.parametrize("storage", ["mcap", "sqlite3"])

NOISE = noise_entries(12)
NOISE_NS = [one.log_ns for one in NOISE]


def lost(reader: BagReader, topic: str = COLOUR) -> list[int | None]:
    return [loss.count for loss in reader.losses if loss.topic == topic]


@CUT_ROW
@pytest.mark.parametrize("share", [0, 0.001, 0.3, 0.6, 0.99])
@pytest.mark.parametrize(
    ("storage", "complaint"),
    [
        ("mcap", r"is cut: .*copy the bag again, or give bag\.mcap itself"),
        ("sqlite3", r"copy it again, or"),
        ("ROS 1", r"cannot be read .*rosbag reindex"),
    ],
)
def test_a_cut_copy_is_refused_with_the_remedy(storage, complaint, share, tmp_path: Path) -> None:
    if storage == "ROS 1":
        file = bag = write_ros1_bag(tmp_path / "old.bag", NOISE)
    else:
        bag = write_bag(tmp_path / "bag", NOISE, storage=storage)
        file = storage_file(bag)
    cut(file, share)
    # A stump that holds no message at all cannot be read, whatever its metadata says.
    complaint = (
        rf"{complaint}|cannot be read.*copy it again" if share else r"is empty \(0 bytes\): nothing was recorded"
    )
    with pytest.raises(BagError, match=complaint):
        opened(bag)


@CUT_ROW
@pytest.mark.parametrize("name", ["x.mcap", "x.db3", "x.bag", "x.mcap.zstd"])
@pytest.mark.parametrize("content", [b"", b"\0" * 5000, b"no bag at all " * 400])
def test_an_empty_file_or_one_of_something_else_is_refused(name, content, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(BagError, match=r"cannot be read|is empty \(0 bytes\): nothing was recorded"):
        opened(tmp_path / name)


def test_a_recording_that_was_never_closed_is_read_to_its_end(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", NOISE)
    (bag / "metadata.yaml").unlink()
    cut(storage_file(bag), 0.6)
    stamps, reader = read(bag)
    # A chunk holds four images (4 x 270 kB > 1 MiB); 0.6 of the file hold one whole chunk of three.
    assert stamps == NOISE_NS[:4]
    assert "what follows is lost" in str(reader.losses[0])
    assert any("no metadata.yaml" in note for note in reader.notes)


@METADATA_ROW
@BOTH
@pytest.mark.parametrize("compression", ["NONE", "MESSAGE", "FILE"])
def test_without_metadata_the_file_is_opened_directly_with_a_note(storage, compression, tmp_path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries(), storage=storage, compression=compression)
    (bag / "metadata.yaml").unlink()
    stamps, reader = read(bag)
    assert len(stamps) == FRAMES
    assert not reader.damaged
    assert "no metadata.yaml (recording not closed?)" in reader.notes[0]


@METADATA_ROW
@pytest.mark.parametrize(
    "garbage",
    [
        b"",
        b"\xff\xfe\x00garbage",
        b"\x80\x81",
        b"a: [",
        b"just text",
        b"[1, 2]",
        b"rosbag2_bagfile_information:",
        b"rosbag2_bagfile_information: {topics_with_message_count: 7, relative_file_paths: []}",
        b"rosbag2_bagfile_information: {topics_with_message_count: [], relative_file_paths: bag.mcap}",
        b"{" * 500,
        b"&a [*a]",
    ],
)
def test_garbage_in_the_metadata_is_refused_with_the_remedy(garbage: bytes, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries(1))
    (bag / "metadata.yaml").write_bytes(garbage)
    with pytest.raises(BagError, match=r"is not readable metadata .*ros2 bag reindex"):
        opened(bag)


def content_of_second_chunk(file: Path) -> int:
    """Where the second chunk's data begin: the first record's head, or the head of a zstd frame."""
    data = file.read_bytes()
    chunks, start = 0, 8
    while True:
        length = int.from_bytes(data[start + 1 : start + 9], "little")
        chunks += data[start] == 0x06
        if chunks == 2:
            break
        start += 9 + length
    # Opcode and length 9, times 16, size 8, crc 4, the compression's name, packed size 8.
    name = start + 9 + 16 + 8 + 4
    return name + 4 + int.from_bytes(data[name : name + 4], "little") + 8


@FLIP_ROW
@pytest.mark.parametrize("compression", ["STORAGE", "NONE"])
def test_one_broken_chunk_costs_no_other_and_is_counted_once(compression: str, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", NOISE, compression=compression)
    flip(storage_file(bag), content_of_second_chunk(storage_file(bag)), count=8)
    with BagReader(bag) as reader:
        for _ in range(2):
            assert [one.log_ns for one in reader.messages()] == NOISE_NS[:4] + NOISE_NS[8:]
            assert lost(reader) == [4]
            assert "4 messages of /camera/color/image_raw: missing of 12" in str(reader.losses[-1])


@FLIP_ROW
def test_a_broken_page_of_a_database_costs_only_its_rows(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", NOISE, storage="sqlite3")
    # Long rows are chains of pages; the first four bytes of a page say which is next. An odd
    # page far inside a row of 66 pages is no leaf of the table.
    flip(storage_file(bag), 4096 * 400, count=4)
    stamps, reader = read(bag)
    assert len(stamps) == 11
    assert set(stamps) < set(NOISE_NS)
    assert lost(reader) == [1]


@FLIP_ROW
@pytest.mark.parametrize(
    ("statement", "lost"),
    [
        ("DELETE FROM messages", [f"missing of {FRAMES}"] * 4),
        (
            "UPDATE messages SET topic_id = 99 WHERE id IN (3, 4)",
            ["2 messages belong to no topic", "missing of", "missing of"],
        ),
    ],
)
def test_what_is_read_without_an_error_is_compared_with_the_metadata(statement, lost, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries(), storage="sqlite3")
    with closing(sqlite3.connect(storage_file(bag))) as database, database:
        database.execute(statement)
    _, reader = read(bag)
    reasons = sorted(map(str, reader.losses))
    assert len(reasons) == len(lost), reasons
    assert all(any(text in reason for reason in reasons) for text in lost)
    (bag / "metadata.yaml").unlink()
    assert len(read(bag)[1].losses) == lost.count("2 messages belong to no topic")


@FLIP_ROW
@BOTH
def test_messages_that_only_the_metadata_knows_are_missing(storage: str, tmp_path: Path) -> None:
    complete, bag = tmp_path / "complete" / "bag", tmp_path / "bag"
    for path, frames in ((complete, FRAMES), (bag, FRAMES - 5)):
        write_bag(path, rgbd_entries(frames), storage=storage)
    (complete / "metadata.yaml").replace(bag / "metadata.yaml")
    stamps, reader = read(bag)
    assert len(stamps) == FRAMES - 5
    assert [loss.count for loss in reader.losses] == [5, 5, 5, 5]


@FLIP_ROW
@pytest.mark.parametrize("position", [0, 3, -1, -3, -20])
def test_a_flipped_end_or_beginning_of_an_mcap_costs_nothing(position: int, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries())
    flip(storage_file(bag), position)
    stamps, _ = read(bag)
    assert len(stamps) == FRAMES


@FLIP_ROW
@pytest.mark.parametrize(
    ("part", "damage", "says"),
    [
        ("bag_1.mcap", lambda path: cut(path, 0.5), "bag_1.mcap cannot be read"),
        ("bag_2.mcap", Path.unlink, "lists bag_2.mcap, which is not in"),
    ],
)
def test_a_broken_or_missing_part_of_a_split_bag_costs_no_other(part, damage, says, tmp_path: Path) -> None:
    bag = write_split_bag(tmp_path / "bag", rgbd_entries(), parts=3)
    damage(bag / part)
    stamps, reader = read(bag)
    assert len(stamps) == FRAMES - 4
    assert lost(reader) == [4]
    assert any(says in loss.reason for loss in reader.losses)


def test_no_storage_file_at_all_is_refused(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries(1))
    storage_file(bag).unlink()
    with pytest.raises(BagError, match=r"none of the storage files .*\(bag\.mcap\); copy the bag again"):
        opened(bag)


def test_a_cut_zstd_file_is_told(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", NOISE, compression="FILE")
    (bag / "metadata.yaml").unlink()
    cut(storage_file(bag), 0.6)
    stamps, reader = read(bag)
    assert stamps == NOISE_NS[: len(stamps)]
    assert 0 < len(stamps) < 12
    assert any("cannot be unpacked to its end" in loss.reason for loss in reader.losses)


def test_ros1_damage_keeps_what_was_read(tmp_path: Path) -> None:
    bag = write_ros1_bag(tmp_path / "old.bag", NOISE, compress=True)
    second_frame = bag.read_bytes().index(b"\x04\x22\x4d\x18", bag.stat().st_size // 2)  # lz4's magic number
    flip(bag, second_frame, count=4)
    stamps, reader = read(bag)
    assert stamps == NOISE_NS[: len(stamps)]
    assert 0 < len(stamps) < 12
    assert sum(filter(None, lost(reader))) == 12 - len(stamps)


@pytest.mark.parametrize(
    ("storage", "damage", "says"),
    [
        ("mcap", lambda bag: storage_file(bag).rename(bag / "other.mcap"), "lists bag.mcap"),
        ("mcap", lambda bag: replace_in_metadata(bag, COLOUR, "/other"), f"promises {FRAMES} messages of /other"),
        ("sqlite3", lambda bag: (bag / "bag.db3-wal").write_bytes(b"7" * 4096), "never merged"),
    ],
)
def test_what_does_not_fit_together_is_read_and_told(storage, damage, says, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries(), storage=storage)
    damage(bag)
    stamps, reader = read(bag)
    assert len(stamps) == FRAMES
    assert any(says in loss.reason for loss in reader.losses)


def replace_in_metadata(bag: Path, old: str, new: str) -> None:
    (bag / "metadata.yaml").write_text((bag / "metadata.yaml").read_text().replace(old, new))
