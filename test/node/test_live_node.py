# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg live`` with the real node: it finds the node's topics, and the node what it was told by the command line."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: source Jazzy, or pip install 'vigg_ros[ros]'")

from vigg_ros.cli.main import main
from vigg_ros.node.player.dds_profile import VARIABLE

BAGS = Path(__file__).parents[2] / "bags"


@pytest.mark.parametrize(
    ("bag", "config", "rate", "duration_s", "frames"),
    [("room_rgbd", "rgbd", 0.1, 0.35, 6), ("street_lidar", "lidar", 0.15, 0.35, 4)],
)
def test_the_real_node_answers_the_bundled_bags(
    bag: str,
    config: str,
    rate: float,
    duration_s: float,
    frames: int,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv(VARIABLE, os.environ.get(VARIABLE, ""))  # the command sets it, and here it is taken back
    playing = ["--rate", str(rate), "--duration", str(duration_s)]
    assert main(["live", str(BAGS / bag), "--config", config, *playing]) == 0
    rows = dict(re.split("  +", line, maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert rows["frames sent"].startswith(f"{frames} in ")
    answered = int(rows["poses received"].split()[0])
    dropped = re.fullmatch(r"DROPPED NEWER_FRAME: (\d+)", rows.get("without a pose", "DROPPED NEWER_FRAME: 0"))
    assert dropped is not None
    # On a busy machine frames are dropped; none may be lost without a word.
    assert answered + int(dropped[1]) == frames
    assert answered >= 1
    median_cm = float(rows["position error"].split()[1])
    # A third of a second of motion: replay's errors there are some millimetres, and centimetres for the LiDAR.
    assert median_cm < (1.0 if config == "rgbd" else 10.0)
    assert rows["node"].endswith("exit code 0")
