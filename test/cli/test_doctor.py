# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page of `vigg doctor`: about the bundled bags, and about bags with one thing wrong."""

import shlex
from argparse import ArgumentParser
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vigg_ros.cli.console import ExitCode
from vigg_ros.cli.main import main
from vigg_ros.cli.replay import add_arguments
from vigg_ros.messages.fields import Message
from vigg_ros.messages.sensor_messages import encode_camera_info
from vigg_ros_testing.doctor_bags import (
    CAMERA,
    CLOUD,
    COLOUR,
    DEPTH,
    INFO,
    PERIOD_NS,
    RGBD,
    looking_along_x,
    sensor_message,
    with_fields,
    write,
    write_static,
)

BAGS = Path(__file__).parents[2] / "bags"
COMPRESSED = "/camera/color/image_raw/compressed"
"""The colour images of room_rgbd."""


def doctor(capsys: pytest.CaptureFixture[str], *arguments: object, code: ExitCode = ExitCode.OK) -> str:
    """The page, where the command ends with this code."""
    assert main(["doctor", *map(str, arguments)]) == code
    return capsys.readouterr().out


def section(page: str, title: str) -> str:
    """What the page says below a title; empty where it has no such section."""
    return page.partition(f"\n{title}\n")[2].partition("\n\n")[0]


@pytest.mark.parametrize(
    ("name", "preset", "facts"),
    [
        ("room_rgbd", "rgbd", ["76 of 76 colour images have a depth image within 20 ms", "4.3 ms at most", "15.0 Hz"]),
        ("street_lidar", "lidar", ["25 of 25 scans have a colour image within 50 ms", "3.1 ms at most"]),
    ],
)
def test_a_bundled_bag_can_be_replayed(name: str, preset: str, facts: list[str], capsys) -> None:
    page = doctor(capsys, BAGS / name)
    assert page.splitlines()[-1].strip() == f"vigg replay {BAGS / name}"
    assert f"the preset for it is {preset}" in page
    assert all(fact in page for fact in facts), page
    assert "What is missing" not in page
    assert "What is odd" not in page
    assert "1772013245123456789 ns (2026-02-25 09:54:05 UTC)" in page


def test_the_command_on_the_page_is_one_that_replay_takes(tmp_path: Path, capsys) -> None:
    bag = write(tmp_path / "a bag", RGBD)
    page = doctor(capsys, bag, "--set", "visual.detector=orb", "--image-topic", COLOUR)
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
    page = doctor(capsys, write(tmp_path / "bag", topics), code=ExitCode.NOTHING_PAIRED)
    missing = section(page, "What is missing")
    assert all(text in missing for text in said), page
    assert missing.count("- ") == missing.count("-> ") == len(said)
    assert "vigg replay" not in page


@pytest.mark.parametrize(
    ("bag", "said"),
    [
        # The last image is 0.5 s later than the first: the median distance to the first depth image is 7.0 s.
        (
            {"offsets_ns": {DEPTH: 7_250_000_000}},
            ["6 of 6 colour images find no depth", "the clocks differ by 7.000 s"],
        ),
        ({"offsets_ns": {DEPTH: 30_000_000}}, ["--set pairing.sync_slop_s=0.036"]),
        ({"frames": 1}, ["1 colour images have a depth image: there is no motion to find"]),
    ],
    ids=["clocks that differ", "a slop that would do", "one frame"],
)
def test_what_cannot_be_paired_is_said_with_what_would_help(bag: dict, said: list[str], tmp_path: Path, capsys) -> None:
    page = doctor(capsys, write(tmp_path / "bag", RGBD, **bag), code=ExitCode.NOTHING_PAIRED)
    assert all(text in page for text in said), page
    if "--set" in said[0]:
        page = doctor(capsys, tmp_path / "bag", *said[0].split())
        assert "6 of 6 colour images have a depth image within 36 ms" in page


def test_several_cameras_give_several_commands(tmp_path: Path, capsys) -> None:
    topics = tuple(f"/{camera}{topic}" for topic in RGBD for camera in ("left", "right"))

    def message_of(topic: str, number: int, stamp_ns: int) -> Message:
        return sensor_message(topic.removeprefix("/left").removeprefix("/right"), number, stamp_ns)

    page = doctor(capsys, write(tmp_path / "bag", topics, message_of=message_of))
    left, right = section(page, "Replay it with one of").splitlines()
    assert f"--image-topic /left{COLOUR}" in left
    assert f"--image-topic /right{COLOUR}" in right


def test_points_that_project_into_the_image_are_counted(tmp_path: Path, capsys) -> None:
    page = doctor(capsys, write_static(tmp_path / "bag", looking_along_x()))
    # Within 6.4 m to the sides and 4.8 m up and down at 10 m: 48 of 60 columns and 38 of 40 rows of the wall.
    assert "1824 of the first scan's 2400 points project into the image, over 100% of its width" in page
    assert "the preset for it is lidar" in page


def test_a_config_for_another_kind_of_sensor_gets_a_note(capsys) -> None:
    assert main(["doctor", str(BAGS / "room_rgbd"), "--config", "lidar"]) == ExitCode.OK
    shown = capsys.readouterr()
    assert shown.err.startswith("note: the bag holds ")
    assert shown.out.splitlines()[-1].endswith("--config lidar")


@pytest.mark.hostile('PointCloud2: nothing projects into the image: NO_DEPTH, "check extrinsics"')
def test_extrinsics_that_look_away_are_missing_ones(tmp_path: Path, capsys) -> None:
    backwards = looking_along_x() @ np.diag([-1.0, 1, -1, 1])
    page = doctor(capsys, write_static(tmp_path / "bag", backwards), code=ExitCode.NOTHING_PAIRED)
    assert "found 0 of 2400 points projecting into the image" in page
    assert "check the extrinsics" in page


@pytest.mark.hostile("Bags: no tf_static: ask for `--extrinsics`")
def test_without_tf_static_extrinsics_are_asked_for(tmp_path: Path, capsys) -> None:
    bag = write(tmp_path / "bag", (COLOUR, INFO, CLOUD))
    assert "--extrinsics" in section(doctor(capsys, bag, code=ExitCode.NOTHING_PAIRED), "What is missing")
    page = doctor(capsys, bag, "--extrinsics", 0, 0, 0, -0.5, 0.5, -0.5, 0.5)
    assert "--extrinsics 0.0 0.0 0.0 -0.5 0.5 -0.5 0.5" in page.splitlines()[-1]


@pytest.mark.hostile("Image: implausible depth unit (median over 100 m or under 5 cm) N")
def test_an_implausible_depth_unit_is_odd(tmp_path: Path, capsys) -> None:
    page = doctor(capsys, write(tmp_path / "bag", RGBD), "--set", "input.depth_scale_m=0.00001")
    assert "a median depth of 0.02 m" in section(page, "What is odd")
    assert "set depth_scale" in page


def of_another_camera(topic: str, number: int, stamp_ns: int) -> Message:
    if topic == INFO:
        return encode_camera_info(replace(CAMERA, width_px=100), stamp_ns=stamp_ns, frame_id="other")
    return sensor_message(topic, number, stamp_ns)


def test_a_calibration_of_another_camera_is_missing(tmp_path: Path, capsys) -> None:
    bag = write(tmp_path / "bag", RGBD, message_of=of_another_camera)
    page = doctor(capsys, bag, code=ExitCode.NOTHING_PAIRED)
    assert "an image of 64x48 with a CameraInfo for 100x48" in section(page, "What is missing")
    assert "the images are in 'camera', their calibration is in 'other'" in section(page, "What is odd")


def with_a_repeated_and_a_zero_stamp(topic: str, number: int, stamp_ns: int) -> Message:
    if (topic, number) == (COLOUR, 3):
        return sensor_message(topic, number, stamp_ns - PERIOD_NS)
    message = sensor_message(topic, number, stamp_ns)
    if (topic, number) != (COLOUR, 5):
        return message
    zero = Message("builtin_interfaces/msg/Time", {"sec": 0, "nanosec": 0})
    return with_fields(message, header=with_fields(message.fields["header"], stamp=zero))


def test_stamps_that_repeat_or_are_zero_are_counted(tmp_path: Path, capsys) -> None:
    page = doctor(capsys, write(tmp_path / "bag", RGBD, message_of=with_a_repeated_and_a_zero_stamp))
    assert "2 of 6 colour images have a zero or duplicate stamp and are refused" in page
    assert "4 of 6 colour images have a depth image within 20 ms" in page


def test_a_damaged_bag_says_what_is_lost(tmp_path: Path, capsys) -> None:
    bag = write(tmp_path / "bag", RGBD, frames=200)
    (storage,) = bag.glob("*.mcap")
    (bag / "metadata.yaml").unlink()
    storage.write_bytes(storage.read_bytes()[: storage.stat().st_size * 2 // 3])
    page = doctor(capsys, bag, code=ExitCode.PARTLY_READABLE)
    assert "can be replayed, but a part of it is lost" in page
    assert "What is lost" in page


@pytest.mark.parametrize(
    ("topic", "said"),
    [
        ("/depth", "--depth-topic /depth is not in the bag"),
        (COMPRESSED, f"{COMPRESSED} cannot be both --image-topic and --depth-topic"),
    ],
)
def test_a_wrong_topic_is_missing(topic: str, said: str, capsys) -> None:
    page = doctor(capsys, BAGS / "room_rgbd", "--depth-topic", topic, code=ExitCode.NOTHING_PAIRED)
    assert said in section(page, "What is missing")


def test_depth_at_a_third_of_the_rate_is_no_matter_of_the_slop(tmp_path: Path, capsys) -> None:
    def message_of(topic: str, number: int, stamp_ns: int) -> Message | None:
        return None if topic == DEPTH and number % 3 else sensor_message(topic, number, stamp_ns)

    odd = section(doctor(capsys, write(tmp_path / "bag", RGBD, frames=12, message_of=message_of)), "What is odd")
    assert "8 of 12 colour images find no depth image within 20 ms" in odd
    assert "lower rate" in odd
    assert "sync_slop_s" not in odd
