# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page of `vigg doctor`: about the bundled bags, and about bags with one thing wrong."""

from __future__ import annotations

import shlex
from argparse import ArgumentParser
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vigg_ros.bags.writer import BagWriter
from vigg_ros.cli.console import ExitCode
from vigg_ros.cli.main import main
from vigg_ros.cli.replay import add_arguments
from vigg_ros.messages.sensor_messages import encode_camera_info
from vigg_ros_testing.doctor_bags import (
    CAMERA,
    CLOUD,
    COLOUR,
    DEPTH,
    INFO,
    PERIOD_NS,
    START_NS,
    looking_along_x,
    sensor_message,
    without_stamp,
    write,
    write_static,
)

BAGS = Path(__file__).parents[2] / "bags"


def doctor(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str]:
    code = main(["doctor", *map(str, arguments)])
    return code, capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "preset", "facts"),
    [
        ("room_rgbd", "rgbd", ["76 of 76 colour images have a depth image within 20 ms", "4.3 ms at most", "15.0 Hz"]),
        ("street_lidar", "lidar", ["25 of 25 scans have a colour image within 50 ms", "3.1 ms at most"]),
    ],
)
def test_a_bundled_bag_can_be_replayed(name: str, preset: str, facts: list[str], capsys) -> None:
    code, page = doctor(capsys, BAGS / name)
    assert code == ExitCode.OK
    assert page.splitlines()[-1].strip() == f"vigg replay {BAGS / name}"
    assert f"the preset for it is {preset}" in page
    assert all(fact in page for fact in facts), page
    assert "What is missing" not in page
    assert "What is odd" not in page
    assert "1772013245123456789 ns (2026-02-25 09:54:05 UTC)" in page


def test_the_command_on_the_page_is_one_that_replay_takes(tmp_path: Path, capsys) -> None:
    bag = write(tmp_path / "a bag", (COLOUR, INFO, DEPTH))
    code, page = doctor(capsys, bag, "--set", "visual.detector=orb", "--image-topic", COLOUR)
    assert code == ExitCode.OK
    words = shlex.split(page.splitlines()[-1])
    parser = ArgumentParser()
    add_arguments(parser)
    taken = parser.parse_args(words[2:])
    assert words[:2] == ["vigg", "replay"]
    assert (taken.bag, taken.set, taken.image_topic) == (str(bag), ["visual.detector=orb"], COLOUR)


@pytest.mark.parametrize(
    ("topics", "said"),
    [
        ((COLOUR, INFO), ["neither depth images"]),
        ((COLOUR, DEPTH), ["--camera-info-topic"]),
        ((DEPTH, INFO), ["--image-topic"]),
        ((COLOUR,), ["neither depth images", "no calibration"]),
    ],
)
def test_what_is_missing_is_said_with_its_remedy(topics, said: list[str], tmp_path: Path, capsys) -> None:
    code, page = doctor(capsys, write(tmp_path / "bag", topics))
    missing = page.partition("What is missing")[2]
    assert code == ExitCode.NOTHING_PAIRED
    assert all(text in missing for text in said), page
    assert missing.count("- ") == len(said)
    assert missing.count("-> ") == len(said)
    assert "vigg replay" not in page


def test_clocks_that_differ_are_named_with_the_measured_offset(tmp_path: Path, capsys) -> None:
    bag = write(tmp_path / "bag", (COLOUR, INFO, DEPTH), offsets_ns={DEPTH: 7_250_000_000})
    code, page = doctor(capsys, bag)
    # The last image is 0.5 s later than the first, so the median distance to the first depth image is 7.0 s.
    assert code == ExitCode.NOTHING_PAIRED
    assert "6 of 6 colour images find no depth image within 20 ms" in page
    assert "the clocks differ by 7.000 s" in page


def test_a_slop_that_would_do_is_suggested(tmp_path: Path, capsys) -> None:
    bag = write(tmp_path / "bag", (COLOUR, INFO, DEPTH), offsets_ns={DEPTH: 30_000_000})
    code, page = doctor(capsys, bag)
    assert code == ExitCode.NOTHING_PAIRED
    assert "--set pairing.sync_slop_s=0.036" in page
    code, page = doctor(capsys, bag, "--set", "pairing.sync_slop_s=0.036")
    assert code == ExitCode.OK
    assert "6 of 6 colour images have a depth image within 36 ms" in page


def test_one_frame_is_no_motion(tmp_path: Path, capsys) -> None:
    code, page = doctor(capsys, write(tmp_path / "bag", (COLOUR, INFO, DEPTH), frames=1))
    assert code == ExitCode.NOTHING_PAIRED
    assert "1 colour images have a depth image: there is no motion to find" in page


def test_several_cameras_give_several_commands(tmp_path: Path, capsys) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        for number in range(4):
            stamp_ns = START_NS + number * PERIOD_NS
            for topic in (COLOUR, INFO, DEPTH):
                message = sensor_message(topic, number, stamp_ns)
                for camera in ("left", "right"):
                    writer.write(f"/{camera}{topic}", message, log_ns=stamp_ns)
    code, page = doctor(capsys, tmp_path / "bag")
    commands = page.partition("Replay it with one of")[2].split("\n")[1:3]
    assert code == ExitCode.OK
    assert f"--image-topic /left{COLOUR}" in commands[0]
    assert f"--image-topic /right{COLOUR}" in commands[1]


def test_points_that_project_into_the_image_are_counted(tmp_path: Path, capsys) -> None:
    code, page = doctor(capsys, write_static(tmp_path / "bag", looking_along_x()))
    assert code == ExitCode.OK
    # Within 6.4 m to the sides and 4.8 m up and down at 10 m: 48 of 60 columns and 38 of 40 rows of the wall.
    assert "1824 of the first scan's 2400 points project into the image, over 100% of its width" in page
    assert "the preset for it is lidar" in page


@pytest.mark.parametrize(
    ("name", "config", "remedy"), [("room_rgbd", "lidar", "rgbd"), ("street_lidar", "rgbd", "lidar")]
)
def test_a_config_for_another_kind_of_sensor_gets_a_note_with_the_remedy(
    name: str, config: str, remedy: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["doctor", str(BAGS / name), "--config", config]) == ExitCode.OK
    shown = capsys.readouterr()
    (note,) = shown.err.splitlines()
    assert note.startswith("note: the bag holds ")
    assert note.endswith(f"leave --config out, or give --config {remedy}")
    assert shown.out.splitlines()[-1].endswith(f"--config {config}")
    assert main(["doctor", str(BAGS / name), "--config", f"{remedy}_paper"]) == ExitCode.OK
    assert capsys.readouterr().err == ""


@pytest.mark.hostile('PointCloud2: nothing projects into the image: NO_DEPTH, "check extrinsics"')
def test_extrinsics_that_look_away_are_missing_ones(tmp_path: Path, capsys) -> None:
    backwards = looking_along_x() @ np.diag([-1.0, 1, -1, 1])
    code, page = doctor(capsys, write_static(tmp_path / "bag", backwards))
    assert code == ExitCode.NOTHING_PAIRED
    assert "found 0 of 2400 points projecting into the image" in page
    assert "check the extrinsics" in page


@pytest.mark.hostile("Bags: no tf_static: ask for `--extrinsics`")
def test_without_tf_static_extrinsics_are_asked_for(tmp_path: Path, capsys) -> None:
    bag = write(tmp_path / "bag", (COLOUR, INFO, CLOUD))
    code, page = doctor(capsys, bag)
    assert code == ExitCode.NOTHING_PAIRED
    assert "--extrinsics" in page.partition("What is missing")[2]
    code, page = doctor(capsys, bag, "--extrinsics", 0, 0, 0, -0.5, 0.5, -0.5, 0.5)
    assert code == ExitCode.OK
    assert "--extrinsics 0.0 0.0 0.0 -0.5 0.5 -0.5 0.5" in page.splitlines()[-1]


@pytest.mark.hostile("Image: implausible depth unit (median over 100 m or under 5 cm) N")
def test_an_implausible_depth_unit_is_odd(tmp_path: Path, capsys) -> None:
    code, page = doctor(capsys, write(tmp_path / "bag", (COLOUR, INFO, DEPTH)), "--set", "input.depth_scale_m=0.00001")
    assert code == ExitCode.OK
    assert "a median depth of 0.02 m" in page.partition("What is odd")[2]
    assert "set depth_scale" in page


def test_a_calibration_of_another_camera_is_missing(tmp_path: Path, capsys) -> None:
    other = replace(CAMERA, width_px=100)
    with BagWriter(tmp_path / "bag") as writer:
        for number in range(4):
            stamp_ns = START_NS + number * PERIOD_NS
            for topic in (COLOUR, DEPTH):
                writer.write(topic, sensor_message(topic, number, stamp_ns), log_ns=stamp_ns)
            writer.write(INFO, encode_camera_info(other, stamp_ns=stamp_ns, frame_id="other"), log_ns=stamp_ns)
    code, page = doctor(capsys, tmp_path / "bag")
    assert code == ExitCode.NOTHING_PAIRED
    assert "an image of 64x48 with a CameraInfo for 100x48" in page.partition("What is missing")[2]
    assert "the images are in 'camera', their calibration is in 'other'" in page.partition("What is odd")[2]


def test_stamps_that_repeat_or_are_zero_are_counted(tmp_path: Path, capsys) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        for number in range(6):
            log_ns = START_NS + number * PERIOD_NS
            for topic in (COLOUR, INFO, DEPTH):
                repeated = topic == COLOUR and number == 3
                message = sensor_message(topic, number, log_ns - repeated * PERIOD_NS)
                if topic == COLOUR and number == 5:
                    message = without_stamp(message)
                writer.write(topic, message, log_ns=log_ns)
    code, page = doctor(capsys, tmp_path / "bag")
    assert code == ExitCode.OK
    assert "2 of 6 colour images have a zero or duplicate stamp and are refused" in page
    assert "4 of 6 colour images have a depth image within 20 ms" in page


def test_a_damaged_bag_says_what_is_lost(tmp_path: Path, capsys) -> None:
    bag = write(tmp_path / "bag", (COLOUR, INFO, DEPTH), frames=200)
    (storage,) = bag.glob("*.mcap")
    (bag / "metadata.yaml").unlink()
    storage.write_bytes(storage.read_bytes()[: storage.stat().st_size * 2 // 3])
    code, page = doctor(capsys, bag)
    assert code == ExitCode.PARTLY_READABLE
    assert "can be replayed, but a part of it is lost" in page
    assert "What is lost" in page


def test_what_is_no_bag_is_unreadable(tmp_path: Path, capsys) -> None:
    assert main(["doctor", str(tmp_path)]) == ExitCode.UNREADABLE
    assert "is not a bag" in capsys.readouterr().err


def test_a_wrong_topic_is_said_with_the_candidates(capsys) -> None:
    code, page = doctor(capsys, BAGS / "room_rgbd", "--depth-topic", "/depth")
    assert code == ExitCode.NOTHING_PAIRED
    assert "--depth-topic /depth is not in the bag" in page


def test_a_topic_cannot_be_colour_and_depth(capsys) -> None:
    name = "/camera/color/image_raw/compressed"
    code, page = doctor(capsys, BAGS / "room_rgbd", "--depth-topic", name)
    assert code == ExitCode.NOTHING_PAIRED
    assert f"{name} cannot be both --image-topic and --depth-topic" in page.partition("What is missing")[2]


def test_depth_at_a_third_of_the_rate_is_no_matter_of_the_slop(tmp_path: Path, capsys) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        for number in range(12):
            stamp_ns = START_NS + number * PERIOD_NS
            for topic in (COLOUR, INFO) if number % 3 else (COLOUR, INFO, DEPTH):
                writer.write(topic, sensor_message(topic, number, stamp_ns), log_ns=stamp_ns)
    code, page = doctor(capsys, tmp_path / "bag")
    odd = page.partition("What is odd")[2]
    assert code == ExitCode.OK
    assert "8 of 12 colour images find no depth image within 20 ms" in odd
    assert "lower rate" in odd
    assert "sync_slop_s" not in odd


def test_the_help_says_where_the_configuration_comes_from(capsys) -> None:
    with pytest.raises(SystemExit):
        main(["doctor", "--help"])
    shown = " ".join(capsys.readouterr().out.split())
    assert "(default: by what the bag holds)" in shown
    assert "None" not in shown
