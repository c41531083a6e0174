# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg play`` and ``vigg live`` before anything is played: mistakes, missing ROS, and the node's command line."""

import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import choose_topics
from vigg_ros.bags.writer import BagWriter
from vigg_ros.cli import node_command
from vigg_ros.cli.console import UsageError
from vigg_ros.cli.main import main
from vigg_ros.cli.node_command import arguments_for_bag, node_arguments
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image, encode_points
from vigg_ros.registration.camera import Camera

ROOT = Path(__file__).parents[2]
ROOM, STREET = ROOT / "bags" / "room_rgbd", ROOT / "bags" / "street_lidar"


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
    assert "pip install '.[ros]'" in line
    assert done.stdout == ""


@pytest.mark.parametrize("words", [["--rate", "0"], ["--rate", "nan"], ["--domain-id", "233"], ["--clock"]])
def test_options_that_make_no_sense_are_refused(words: list[str], capsys) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["play", str(ROOM), *words])
    assert words[0] in capsys.readouterr().err


def words_for(bag: Path) -> list[str]:
    with BagReader(bag) as reader:
        return shlex.split(arguments_for_bag(reader).shell_line())


def test_the_command_for_a_camera_with_depth(monkeypatch) -> None:
    monkeypatch.setattr(node_command.shutil, "which", lambda name: None)
    colour, depth = "/camera/color", "/camera/aligned_depth_to_color"
    assert words_for(ROOM) == [
        *("registrar", "--ros-args"),
        *("-r", f"rgb/image:={colour}/image_raw/compressed"),
        *("-r", f"rgb/camera_info:={colour}/camera_info"),
        *("-r", f"depth/image:={depth}/image_raw/compressedDepth"),
        *("-p", "config:=rgbd", "-p", "geometry:=depth", "-p", "image_transport:=compressed"),
    ]


def test_the_command_for_a_camera_with_lidar_knows_where_the_camera_stands(monkeypatch) -> None:
    monkeypatch.setattr(node_command.shutil, "which", lambda name: f"/opt/ros/jazzy/bin/{name}")
    words = words_for(STREET)
    assert words[:4] == ["ros2", "run", "vigg_ros", "registrar"]
    assert {"points:=/lidar/points", "geometry:=points", "config:=lidar"} < set(words)
    (extrinsics,) = [word for word in words if word.startswith("extrinsics:=")]
    numbers = [float(number) for number in extrinsics.partition("[")[2].strip("]").split(", ")]
    # As bags/render_bags.py mounts them: 0.6 m forward, 8 cm to the left, 0.4 m below the LiDAR, looking forward.
    assert numbers[:3] == pytest.approx([0.6, 0.08, -0.4], abs=0.01)
    assert np.linalg.norm(numbers[3:]) == pytest.approx(1.0)


def test_what_the_bag_does_not_say_is_asked_for_and_given_to_the_node(tmp_path: Path) -> None:
    camera = Camera(width_px=8, height_px=6, fx_px=7.0, fy_px=7.0, cx_px=3.5, cy_px=2.5)
    header = {"stamp_ns": 10**18, "frame_id": "camera"}
    with BagWriter(tmp_path / "bag") as writer:
        writer.write("/image", encode_image(np.zeros((6, 8, 3), np.uint8), **header), log_ns=10**18)
        writer.write("/camera_info", encode_camera_info(camera, **header), log_ns=10**18)
        points = np.full((9, 3), 30.0, np.float32)  # far: a LiDAR's
        writer.write("/points", encode_points(points, stamp_ns=10**18, frame_id="lidar"), log_ns=10**18)
    with BagReader(tmp_path / "bag") as reader:
        with pytest.raises(UsageError, match="--extrinsics"):
            arguments_for_bag(reader)
        choice = choose_topics(reader.topics)
        found = node_arguments(reader, choice, extrinsics=[0.5, 0, 0, 0, 0, 0, 1], options=["visual.top_k=3"])
    assert {"config": "lidar", "visual.top_k": "3"}.items() < found.parameters.items()
    assert found.parameters["extrinsics"].startswith("[0.500000000, 0.000000000, ")
