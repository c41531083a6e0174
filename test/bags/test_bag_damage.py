# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Damaged bags: refused with a remedy, or read as far as they go with each loss counted."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest
from bag_samples import (
    COLOUR,
    DEPTH,
    FRAMES,
    cut,
    edit_metadata,
    flip,
    noise_entries,
    rgbd_entries,
    storage_file,
    write_bag,
    write_ros1_bag,
    write_split_bag,
)

from vigg_ros.bags.reader import BagReader
from vigg_ros.messages.decode import decode_image
from vigg_ros.registration.errors import BagError

CUT_ROW = pytest.mark.hostile("Bags: cut mcap, cut db3, 0 bytes: exit 3 with the remedy")
METADATA_ROW = pytest.mark.hostile(
    "Bags: metadata.yaml missing: open the file directly N; garbage in it: exit 3 "
    "(rosbags lets UnicodeDecodeError escape)"
)
FLIP_ROW = pytest.mark.hostile(
    'Bags: flipped bits: keep what was read, exit 4 (sqlite3 can read "0 messages" without an error: '
    "compare message_count)"
)


def opened(path: Path) -> None:
    with BagReader(path):
        pass


def read(path: Path) -> tuple[list[int], BagReader]:
    """Header stamps of the colour images, and the reader after reading everything."""
    with BagReader(path) as reader:
        stamps = [decode_image(one.message).stamp_ns for one in reader.messages() if one.topic == COLOUR]
    return stamps, reader


def stamps_of(entries) -> list[int]:
    return [entry.log_ns for entry in entries]


@CUT_ROW
@pytest.mark.parametrize("share", [0.001, 0.3, 0.6, 0.99])
@pytest.mark.parametrize(
    ("storage", "complaint"),
    [("mcap", r"is cut: .*copy the bag again, or give bag\.mcap itself"), ("sqlite3", r"copy it again, or")],
)
def test_a_cut_copy_is_refused_with_the_remedy(storage, complaint, share, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", noise_entries(12), storage=storage)
    cut(storage_file(bag), share)
    # A stump that holds no message at all cannot be read, whatever its metadata says.
    with pytest.raises(BagError, match=rf"{complaint}|cannot be read.*copy it again"):
        opened(bag)


@CUT_ROW
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("alone", [False, True])
def test_an_empty_file_is_refused(storage, alone, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries(), storage=storage)
    storage_file(bag).write_bytes(b"")
    with pytest.raises(BagError, match=r"is empty \(0 bytes\): nothing was recorded"):
        opened(storage_file(bag) if alone else bag)


@CUT_ROW
@pytest.mark.parametrize("name", ["x.mcap", "x.db3", "x.bag", "x.mcap.zstd"])
@pytest.mark.parametrize("content", [b"\0" * 5000, b"no bag at all " * 400])
def test_a_file_of_something_else_is_refused(name, content, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(BagError, match=r"cannot be read|is empty"):
        opened(tmp_path / name)


@CUT_ROW
def test_a_cut_ros1_bag_is_refused_with_the_remedy(tmp_path: Path) -> None:
    bag = write_ros1_bag(tmp_path / "old.bag", rgbd_entries())
    cut(bag, 0.5)
    with pytest.raises(BagError, match=r"cannot be read .*rosbag reindex"):
        opened(bag)


def test_a_recording_that_was_never_closed_is_read_to_its_end(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", noise_entries(12))
    (bag / "metadata.yaml").unlink()
    cut(storage_file(bag), 0.6)
    stamps, reader = read(bag)
    # A chunk holds four images (4 x 270 kB > 1 MiB); 0.6 of the file hold one whole chunk of three.
    assert stamps == stamps_of(noise_entries(12))[:4]
    assert reader.damaged
    assert "what follows is lost" in str(reader.losses[0])
    assert any("no metadata.yaml" in note for note in reader.notes)


def test_only_the_footer_missing_loses_nothing_but_is_said(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries())
    file = storage_file(bag)
    file.write_bytes(file.read_bytes()[:-20])
    stamps, reader = read(bag)
    assert len(stamps) == FRAMES
    assert not reader.damaged
    assert any("without its index" in note for note in reader.notes)


@METADATA_ROW
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
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
        b"{" * 100_000,
        b"&a [*a]",
    ],
)
def test_garbage_in_the_metadata_is_refused_with_the_remedy(garbage: bytes, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", rgbd_entries(1))
    (bag / "metadata.yaml").write_bytes(garbage)
    with pytest.raises(BagError, match=r"is not readable metadata .*ros2 bag reindex"):
        opened(bag)


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
