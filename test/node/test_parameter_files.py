# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Notes on parameter files. Needs no ROS."""

from __future__ import annotations

from pathlib import Path

import pytest

from vigg_ros.node.parameter_files import notes_on_files


def notes(path: Path) -> list[str]:
    return list(notes_on_files(["--params-file", str(path)], "/registrar"))


def test_a_file_for_another_node_is_noted(tmp_path: Path) -> None:
    path = tmp_path / "other.yaml"
    path.write_text("front_camera:\n  ros__parameters:\n    odom_frame: map\n")
    (note,) = notes(path)
    assert "found parameters of front_camera, expected /registrar" in note


@pytest.mark.parametrize("value", ["=", "!foo odom", "2024-13-45", "\x07"])
def test_what_only_rcl_can_read_gives_no_note_and_no_error(tmp_path: Path, value: str) -> None:
    path = tmp_path / "odd.yaml"
    path.write_text(f"registrar:\n  ros__parameters:\n    odom_frame: {value}\n")
    assert notes(path) == []


def test_a_file_that_is_gone_or_no_text_gives_no_note(tmp_path: Path) -> None:
    path = tmp_path / "gone.yaml"
    assert notes(path) == []
    path.write_bytes(b"\xff\xfe\x00")
    assert notes(path) == []
