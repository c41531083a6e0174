# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers, files and frames that cannot be used: one line and an exit code, never a traceback."""

from pathlib import Path

import pytest

from vigg_ros.cli.console import ExitCode
from vigg_ros.cli.main import main
from vigg_ros.messages.fields import Message
from vigg_ros_testing.doctor_bags import (
    COLOUR,
    INTRINSICS,
    RGBD,
    looking_along_x,
    sensor_message,
    with_fields,
    write,
    write_static,
)


@pytest.mark.parametrize(
    "arguments",
    [
        ["evaluate", "pairs", "7scenes", "x", "--every", "0"],
        ["evaluate", "pairs", "7scenes", "x", "--gaps", "0"],
        ["evaluate", "pairs", "7scenes", "x", "--gaps", "5", "-1"],
        ["benchmark", "x", "--frames", "-10"],
        ["register", "a", "b", "c", "d", *INTRINSICS, "--depth-scale", "0"],
        ["register", "a", "b", "c", "d", *INTRINSICS, "--depth-scale", "nan"],
        ["convert", "images", "x", "-o", "y", "--rate", "0"],
    ],
)
def test_numbers_that_must_be_positive_are(arguments: list[str], capsys) -> None:
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == ExitCode.USAGE
    assert "is not a positive number" in capsys.readouterr().err


@pytest.mark.parametrize("options", [[], ["--storage", "sqlite3", "--compression", "chunk"]])
def test_what_cannot_be_written_as_asked_is_usage(options: list[str], scene_folder: Path, tmp_path: Path) -> None:
    output = tmp_path if not options else tmp_path / "bag"
    assert main(["convert", "7scenes", str(scene_folder), "-o", str(output), *options]) == ExitCode.USAGE


def test_a_replay_with_hardly_a_pose_is_written_and_not_done(tmp_path: Path, capsys) -> None:
    # Flat depth and noise that differs from frame to frame: each is a frame, and none follows from another.
    bag, output = write(tmp_path / "bag", RGBD), tmp_path / "out"
    assert main(["replay", str(bag), "--output", str(output)]) == ExitCode.NOTHING_PAIRED
    said = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("note: ")]
    assert len(said) == 1
    assert "of 6 colour images got a pose, fewer than the 2" in said[0]
    assert {"frames.csv", "report.html"} <= {path.name for path in output.iterdir()}


def test_a_replay_without_frames_names_what_leads(tmp_path: Path, capsys) -> None:
    bag = write_static(tmp_path / "bag", looking_along_x())
    options = ["--config", "lidar", "--set", "pairing.sync_slop_s=0"]
    assert main(["replay", str(bag), "--output", str(tmp_path / "out"), *options]) == ExitCode.NOTHING_PAIRED
    assert "6 scans" in capsys.readouterr().err


def test_a_benchmark_leaves_out_what_is_refused(tmp_path: Path, capsys) -> None:
    def with_one_broken(topic: str, number: int, stamp_ns: int) -> Message:
        message = sensor_message(topic, number, stamp_ns)
        return with_fields(message, encoding="unheard-of") if (topic, number) == (COLOUR, 1) else message

    bag = write(tmp_path / "bag", RGBD, message_of=with_one_broken)
    assert main(["benchmark", str(bag), "--image-topic", COLOUR]) == ExitCode.OK
    assert capsys.readouterr().out.startswith("2 frames;")  # of 6, one is refused and three warm up
