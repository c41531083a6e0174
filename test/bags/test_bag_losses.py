# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags that are partly readable: what is there is read, and each loss is counted."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from vigg_ros.bags.reader import BagReader
from vigg_ros.registration.errors import BagError
from vigg_ros_testing.bag_samples import (
    COLOUR,
    DEPTH,
    FRAMES,
    cut,
    edit_metadata,
    flip,
    noise_entries,
    opened,
    read,
    rgbd_entries,
    stamps_of,
    storage_file,
    write_bag,
    write_ros1_bag,
    write_split_bag,
)

FLIP_ROW = pytest.mark.hostile(
    'Bags: flipped bits: keep what was read, exit 4 (sqlite3 can read "0 messages" without an error: '
    "compare message_count)"
)


@FLIP_ROW
@pytest.mark.parametrize("compression", ["STORAGE", "NONE"])
def test_one_broken_chunk_costs_no_other(compression: str, tmp_path: Path) -> None:
    entries = noise_entries(12)
    bag = write_bag(tmp_path / "bag", entries, compression=compression)
    flip(storage_file(bag), content_of_second_chunk(storage_file(bag)), count=8)
    stamps, reader = read(bag)
    assert stamps == stamps_of(entries)[:4] + stamps_of(entries)[8:]
    assert [loss.count for loss in reader.losses if loss.topic == COLOUR] == [4]
    assert "4 messages of /camera/color/image_raw: missing of 12" in str(reader.losses[-1])


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
def test_a_broken_page_of_a_database_costs_only_its_rows(tmp_path: Path) -> None:
    entries = noise_entries(12)
    bag = write_bag(tmp_path / "bag", entries, storage="sqlite3")
    # Long rows are chains of pages; the first four bytes of a page say which is next. An odd
    # page far inside a row of 66 pages is no leaf of the table.
    flip(storage_file(bag), 4096 * 400, count=4)
    stamps, reader = read(bag)
    assert len(stamps) == 11
    assert set(stamps) < set(stamps_of(entries))
    assert [loss.count for loss in reader.losses if loss.topic == COLOUR] == [1]


@FLIP_ROW
def test_zero_messages_read_without_an_error_are_noticed(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries(), storage="sqlite3")
    database = sqlite3.connect(storage_file(bag))
    database.execute("DELETE FROM messages")
    database.commit()
    database.close()
    stamps, reader = read(bag)
    assert stamps == []
    assert {(loss.topic, loss.count) for loss in reader.losses} >= {(COLOUR, FRAMES), (DEPTH, FRAMES)}


@FLIP_ROW
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_messages_that_only_the_metadata_knows_are_missing(storage: str, tmp_path: Path) -> None:
    complete = write_bag(tmp_path / "complete", rgbd_entries(), storage=storage)
    bag = write_bag(tmp_path / "bag", rgbd_entries(FRAMES - 5), storage=storage)
    (bag / "metadata.yaml").write_bytes((complete / "metadata.yaml").read_bytes())
    edit_metadata(bag, relative_file_paths=[storage_file(bag).name])
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
def test_a_broken_part_of_a_split_bag_costs_no_other(tmp_path: Path) -> None:
    bag = write_split_bag(tmp_path / "bag", rgbd_entries(), parts=3)
    cut(bag / "bag_1.mcap", 0.5)
    stamps, reader = read(bag)
    assert len(stamps) == FRAMES - 4
    assert any("bag_1.mcap cannot be read" in loss.reason for loss in reader.losses)
    assert [loss.count for loss in reader.losses if loss.topic == COLOUR] == [4]


def test_a_missing_part_of_a_split_bag_is_counted(tmp_path: Path) -> None:
    bag = write_split_bag(tmp_path / "bag", rgbd_entries(), parts=3)
    (bag / "bag_2.mcap").unlink()
    stamps, reader = read(bag)
    assert len(stamps) == FRAMES - 4
    assert any("lists bag_2.mcap, which is not in" in loss.reason for loss in reader.losses)
    assert [loss.count for loss in reader.losses if loss.topic == COLOUR] == [4]


def test_a_storage_file_under_another_name_is_read_and_told(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries())
    storage_file(bag).rename(bag / "other.mcap")
    stamps, reader = read(bag)
    assert len(stamps) == FRAMES
    assert any("lists bag.mcap" in loss.reason for loss in reader.losses)


def test_no_storage_file_at_all_is_refused(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries(1))
    storage_file(bag).unlink()
    with pytest.raises(BagError, match=r"none of the storage files .*\(bag\.mcap\); copy the bag again"):
        opened(bag)


def test_a_promised_topic_that_no_file_holds_is_told(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries())
    text = (bag / "metadata.yaml").read_text()
    (bag / "metadata.yaml").write_text(text.replace(COLOUR, "/somewhere/else"))
    _, reader = read(bag)
    assert any(f"promises {FRAMES} messages of /somewhere/else" in loss.reason for loss in reader.losses)


def test_a_journal_that_was_never_merged_is_told(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries(), storage="sqlite3")
    (bag / "bag.db3-wal").write_bytes(b"7" * 4096)
    _, reader = read(bag)
    assert any("never merged" in loss.reason for loss in reader.losses)


def test_a_cut_zstd_file_is_told(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", noise_entries(12), compression="FILE")
    (bag / "metadata.yaml").unlink()
    cut(storage_file(bag), 0.6)
    stamps, reader = read(bag)
    assert stamps == stamps_of(noise_entries(12))[: len(stamps)]
    assert 0 < len(stamps) < 12
    assert any("cannot be unpacked to its end" in loss.reason for loss in reader.losses)


def test_ros1_damage_keeps_what_was_read(tmp_path: Path) -> None:
    entries = noise_entries(12)
    bag = write_ros1_bag(tmp_path / "old.bag", entries, compress=True)
    second_frame = bag.read_bytes().index(b"\x04\x22\x4d\x18", bag.stat().st_size // 2)  # lz4's magic number
    flip(bag, second_frame, count=4)
    stamps, reader = read(bag)
    assert stamps == stamps_of(entries)[: len(stamps)]
    assert 0 < len(stamps) < 12
    assert sum(loss.count for loss in reader.losses if loss.topic == COLOUR) == 12 - len(stamps)


def test_losses_of_two_readings_are_not_added(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", noise_entries(12), compression="STORAGE")
    flip(storage_file(bag), content_of_second_chunk(storage_file(bag)), count=8)
    with BagReader(bag) as reader:
        first, second = ((list(reader.messages()), reader.losses)[1] for _ in range(2))
    assert first == second
    assert [loss.count for loss in first if loss.topic == COLOUR] == [4]


@FLIP_ROW
def test_messages_of_no_topic_are_told_even_without_metadata(tmp_path: Path) -> None:
    file = storage_file(write_bag(tmp_path / "bag", rgbd_entries(), storage="sqlite3"))
    database = sqlite3.connect(file)
    database.execute("UPDATE messages SET topic_id = 99 WHERE id IN (3, 4)")
    database.commit()
    database.close()
    _, reader = read(file)
    assert [loss.reason for loss in reader.losses] == ["bag.db3: 2 messages belong to no topic"]
