# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags that are cut, empty or without metadata: refused with a remedy, or opened with a note."""

from __future__ import annotations

from pathlib import Path

import pytest

from vigg_ros.registration.errors import BagError
from vigg_ros_testing.bag_samples import (
    FRAMES,
    cut,
    noise_entries,
    opened,
    read,
    rgbd_entries,
    stamps_of,
    storage_file,
    write_bag,
    write_ros1_bag,
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
