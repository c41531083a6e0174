# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg live`` over real DDS, with a process in the node's place whose answers are known: ``fake_node.py``."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: source Jazzy, or pip install 'vigg_ros[ros]'")

from vigg_ros.bags.writer import BagWriter
from vigg_ros.cli.main import main
from vigg_ros.messages.pose_messages import encode_pose, encode_tf, encode_transform
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image, encode_points
from vigg_ros.node.player import live_run
from vigg_ros.node.player.dds_profile import VARIABLE
from vigg_ros.registration.camera import Camera

FAKE_NODE = Path(__file__).with_name("fake_node.py")
START_NS = 1_700_000_000_123_456_789
PERIOD_NS = 40_000_000
FRAMES = 20
CAMERA = Camera(width_px=8, height_px=6, fx_px=7.0, fy_px=7.0, cx_px=3.5, cy_px=2.5)


def placed(x_m: float) -> np.ndarray:
    T = np.eye(4)
    T[0, 3] = x_m
    return T


def write(path: Path, *, with_points: bool) -> Path:
    """Frame k stands at x = k cm, as the fake node says, but for the last one, which is 5 cm further."""
    with BagWriter(path) as writer:
        link = encode_transform(placed(0.5), stamp_ns=START_NS, frame_id="lidar", child_frame_id="camera")
        writer.write("/tf_static", encode_tf([link]), log_ns=START_NS)
        for k in range(FRAMES):
            stamp_ns = START_NS + k * PERIOD_NS
            header = {"stamp_ns": stamp_ns, "frame_id": "camera"}
            messages = {
                "/cam/image": encode_image(np.zeros((6, 8, 3), np.uint8), **header),
                "/cam/camera_info": encode_camera_info(CAMERA, **header),
                "/truth": encode_pose(placed(0.01 * k + 0.05 * (k == FRAMES - 2)), stamp_ns=stamp_ns, frame_id="map"),
            }
            if with_points:
                points = np.full((4, 3), 20.0, np.float32)
                messages["/scan"] = encode_points(points, stamp_ns=stamp_ns, frame_id="lidar")
            else:
                messages["/cam/depth"] = encode_image(np.full((6, 8), 1000, np.uint16), **header)
            for topic, message in messages.items():
                writer.write(topic, message, log_ns=stamp_ns)
    return path


@pytest.fixture(autouse=True)
def fake_node(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_run, "node_command", lambda words: [sys.executable, str(FAKE_NODE), *words])
    monkeypatch.setenv(VARIABLE, os.environ.get(VARIABLE, ""))  # the command sets it, and here it is taken back


@pytest.mark.parametrize(("with_points", "now"), [(False, False), (True, True)])
def test_the_table_says_what_the_node_answered(
    with_points: bool, now: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write(tmp_path / "bag", with_points=with_points)
    config = "lidar" if with_points else "rgbd"
    assert main(["live", str(bag), "--rate", "2", *(["--now"] if now else [])]) == 0
    shown = capsys.readouterr()
    advice = shown.out.splitlines()[-1]
    assert "4 of 20 frames were dropped because newer ones came; try --rate 1" in advice
    assert "were dropped so far" not in shown.err
    rows = rows_of(shown.out)
    assert rows["frames sent"].startswith(f"{FRAMES} in ")
    assert rows["poses received"] == "16 (80.0%)"
    assert rows["without a pose"] == "DROPPED: 4"
    # Of the answered frames one is 5 cm off, and the rest exact.
    assert rows["position error"] == "median 0.00 cm, max 5.00 cm, over 16 frames"
    leader = "scan" if with_points else "colour image"
    assert rows["latency"].endswith(f"from publishing the {leader} to receiving its pose")
    assert rows["node"].endswith("exit code 0")
    command = shown.err.splitlines()[0]
    assert f"config:={config}" in command
    if with_points:
        assert "[0.500000000, 0.000000000, 0.000000000, 0.000000000, 0.000000000, 0.000000000, 1.000000000]" in command


@pytest.mark.parametrize(
    ("behaviour", "code", "words"),
    [
        ("mute", 5, "no frame got a pose"),
        ("crash", 1, "ended by itself with exit code 7; it said:\nRuntimeError: as asked for"),
        ("stubborn", 1, "the node ended with exit code 3, expected 0"),
    ],
)
def test_a_node_that_fails_is_told(
    behaviour: str,
    code: int,
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("FAKE_NODE", behaviour)
    monkeypatch.setattr(live_run, "QUIET_S", 0.3)
    assert main(["live", str(write(tmp_path / "bag", with_points=False)), "--rate", "4"]) == code
    shown = capsys.readouterr()
    assert words in shown.err
    assert "Traceback" not in shown.err


def test_a_node_that_does_not_subscribe_is_given_up(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_run, "node_command", lambda words: [sys.executable, "-c", "import time; time.sleep(60)"])
    monkeypatch.setattr(live_run, "READY_S", 0.5)
    assert main(["live", str(write(tmp_path / "bag", with_points=False))]) == 1
    assert "did not subscribe to /cam/image, /cam/camera_info, /cam/depth" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("number", "ignored"), [(signal.SIGINT, False), (signal.SIGINT, True), (signal.SIGTERM, False)]
)
def test_it_can_be_interrupted_and_takes_the_node_with_it(number: int, ignored: bool, tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", with_points=False)
    code = (
        "import sys\nfrom vigg_ros.node.player import live_display, live_run\nfrom vigg_ros.cli.main import main\n"
        f"live_run.node_command = lambda words: [sys.executable, {str(FAKE_NODE)!r}, {str(tmp_path)!r}, *words]\n"
        "live_display.LINE_S = 0.5\n"
        f"sys.exit(main(['live', {str(bag)!r}, '--loop']))"
    )
    command = [sys.executable, "-c", code]
    # As a shell starts what a script puts into the background with &.
    command = ["sh", "-c", "trap '' INT; exec \"$@\"", "sh", *command] if ignored else command
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    while "TRACKING; poses" not in process.stderr.readline():
        assert process.poll() is None
    process.send_signal(number)
    table, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "vigg live: interrupted" in errors.splitlines()
    assert "Traceback" not in errors
    assert int(rows_of(table)["poses received"].split()[0]) > 0
    assert rows_of(table)["node"].endswith("exit code 0")
    assert not [one for one in running_commands() if str(tmp_path) in one]


def rows_of(table: str) -> dict[str, str]:
    """Name and text of each row, without the sentence below the table."""
    return dict(re.split("  +", line, maxsplit=1) for line in table.splitlines() if "  " in line)


def running_commands() -> list[str]:
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            found.append(path.read_bytes().decode(errors="replace"))
        except OSError:  # it has ended meanwhile
            continue
    return found
