# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg play`` and ``vigg live`` before anything is played: mistakes, missing ROS, and the node's command line."""

from __future__ import annotations

import shlex
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.writer import BagWriter
from vigg_ros.cli import node_command
from vigg_ros.cli.console import UsageError
from vigg_ros.cli.main import main
from vigg_ros.cli.node_command import arguments_for_bag, shown
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image, encode_points
from vigg_ros.registration.camera import Camera

ROOT = Path(__file__).parents[2]
ROOM, STREET = ROOT / "bags" / "room_rgbd", ROOT / "bags" / "street_lidar"
NEEDS_ROS = pytest.mark.skipif(
    find_spec("rclpy") is None, reason="needs ROS 2: source Jazzy, or pip install 'vigg_ros[ros]'"
)


@pytest.mark.parametrize("command", ["play", "live"])
def test_without_ros_one_line_names_both_remedies(command: str, tmp_path: Path) -> None:
    code = (
        "import sys; sys.modules['rclpy'] = None\nfrom vigg_ros.cli.main import main\n"
        f"sys.exit(main([{command!r}, {str(ROOM)!r}]))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"vigg {command}: needs ROS 2 Jazzy")
    assert "source /opt/ros/jazzy/setup.bash" in line
    assert "pip install 'vigg_ros[ros]'" in line
    assert done.stdout == ""


@pytest.mark.parametrize("command", ["play", "live"])
def test_explaining_itself_takes_no_ros(command: str) -> None:
    code = (
        "import sys; from vigg_ros.cli.main import main\n"
        f"try: main([{command!r}, '--help'])\nexcept SystemExit: pass\n"
        "print('rclpy' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False"


@NEEDS_ROS
@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["play", "nowhere"], 3, "nowhere does not exist"),
        (["play", str(ROOM), "--topics", "/x", "/camera/color/camera_info"], 2, "does not hold x, but: /camera/"),
        (["play", str(ROOM), "--clock", "--now"], 2, "give one of them"),
        (["play", str(ROOM), "--start", "60", "--wait", "0"], 2, "nothing to play"),
        (["live", "nowhere"], 3, "nowhere does not exist"),
        (["live", str(ROOM), "--config", "rgdb"], 2, "did you mean rgbd"),
        (["live", str(ROOM), "--set", "visual.topk=3"], 2, "did you mean visual.top_k"),
        (["live", str(ROOM), "--image-topic", "/nope"], 2, "/nope"),
        (["live", str(ROOM), "--ground-truth", "nowhere.tum"], 2, "nowhere.tum"),
    ],
)
def test_mistakes_get_one_line_and_a_code(
    arguments: list[str], code: int, words: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", "")
    assert main(arguments) == code
    shown = capsys.readouterr()
    assert words in shown.err.splitlines()[-1]
    assert "Traceback" not in shown.err


@pytest.mark.parametrize(
    "words",
    [["--rate", "0"], ["--rate", "nan"], ["--loop", "0"], ["--start", "-1"], ["--wait", "nan"], ["--order", "name"]],
)
def test_numbers_that_make_no_sense_are_refused(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["play", str(ROOM), *words])
    assert stop.value.code == 2
    assert words[0] in capsys.readouterr().err


def words_for(bag: Path) -> list[str]:
    with BagReader(bag) as reader:
        return shlex.split(shown(arguments_for_bag(reader)))


def test_the_command_for_a_camera_with_depth(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(node_command.shutil, "which", lambda name: None)
    colour, depth = "/camera/color", "/camera/aligned_depth_to_color"
    assert words_for(ROOM) == [
        *("registrar", "--ros-args"),
        *("-r", f"rgb/image:={colour}/image_raw/compressed"),
        *("-r", f"rgb/camera_info:={colour}/camera_info"),
        *("-r", f"depth/image:={depth}/image_raw/compressedDepth"),
        *("-p", "config:=rgbd", "-p", "geometry:=depth", "-p", "image_transport:=compressed"),
    ]


def test_the_command_for_a_camera_with_lidar_knows_where_the_camera_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(node_command.shutil, "which", lambda name: f"/opt/ros/jazzy/bin/{name}")
    words = words_for(STREET)
    assert words[:4] == ["ros2", "run", "vigg_ros", "registrar"]
    assert {"points:=/lidar/points", "geometry:=points", "config:=lidar"} < set(words)
    (extrinsics,) = [word for word in words if word.startswith("extrinsics:=")]
    numbers = [float(number) for number in extrinsics.partition("[")[2].strip("]").split(", ")]
    # As bags/render_bags.py mounts them: 0.6 m forward, 8 cm to the left, 0.4 m below the LiDAR, looking forward.
    assert numbers[:3] == pytest.approx([0.6, 0.08, -0.4], abs=0.01)
    assert np.linalg.norm(numbers[3:]) == pytest.approx(1.0)


def write_scans(path: Path, *, range_m: float) -> Path:
    camera = Camera(width_px=8, height_px=6, fx_px=7.0, fy_px=7.0, cx_px=3.5, cy_px=2.5)
    header = {"stamp_ns": 10**18, "frame_id": "camera"}
    with BagWriter(path) as writer:
        writer.write("/image", encode_image(np.zeros((6, 8, 3), np.uint8), **header), log_ns=10**18)
        writer.write("/camera_info", encode_camera_info(camera, **header), log_ns=10**18)
        points = np.full((9, 3), range_m, np.float32)
        writer.write("/points", encode_points(points, stamp_ns=10**18, frame_id="lidar"), log_ns=10**18)
    return path


def test_a_bag_that_does_not_say_where_the_camera_stands_has_no_command(tmp_path: Path) -> None:
    path = write_scans(tmp_path / "bag", range_m=30.0)
    with BagReader(path) as reader, pytest.raises(UsageError, match="--extrinsics"):
        arguments_for_bag(reader)


@pytest.mark.parametrize(("range_m", "preset"), [(30.0, "lidar"), (2.0, "rgbd")])
def test_the_preset_is_that_for_the_range_of_the_points(
    range_m: float, preset: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class OneFrame:
        lookup = staticmethod(lambda target, source: np.eye(4))

    monkeypatch.setattr(node_command, "read_extrinsics", lambda reader, choice: OneFrame)
    with BagReader(write_scans(tmp_path / "bag", range_m=range_m)) as reader:
        assert arguments_for_bag(reader).parameters["config"] == preset
