# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Growth is measured on what it names; how long it takes is for ``vigg benchmark`` to say."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from vigg_ros.bench import growth
from vigg_ros.bench.commands import benchmark
from vigg_ros.cli.console import ExitCode
from vigg_ros.cli.main import main
from vigg_ros.registration import Registration, Rejection


def test_inputs_are_what_they_say() -> None:
    points = growth.rolling_ground(5_000)
    assert points.shape == (5_000, 3)
    distance_m = np.linalg.norm(points[:, :2], axis=1)
    assert 3 <= distance_m.min() < distance_m.max() <= 60.01
    assert isinstance(growth.registration_of(5_000)(), (Registration, Rejection))
    for work in (growth.cliques_of(100), growth.cliques_of(100, right=1.0)):
        # A translation of (0.3, -0.2, 0.1) back, from 30 or 100 matches with 1 cm of noise.
        np.testing.assert_allclose(work().T_target_source[0][:3, 3], (-0.3, 0.2, -0.1), atol=0.01)


def test_one_size_is_measured_in_a_process_of_its_own() -> None:
    row = growth.measure_in_new_process("visual matches, 30 % right", 50)
    assert (row.what, row.size) == ("visual matches, 30 % right", 50)
    assert row.milliseconds > 0
    assert 20 < row.peak_mb < 5_000


def test_the_command_prints_and_draws(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = [growth.GrowthSample("points", size, 0.01 * size, 100 + 0.001 * size) for size in (10, 100, 1000)]
    monkeypatch.setattr(benchmark, "measure", lambda: iter(rows))
    plot = tmp_path / "growth.png"
    assert main(["benchmark", "--growth", "--plot", str(plot)]) == ExitCode.OK
    printed = capsys.readouterr().out
    assert "peak MB" in printed
    assert any(line.split() == ["points", "1000", "10.0", "101"] for line in printed.splitlines())
    picture = cv2.imread(str(plot))
    assert picture is not None
    assert np.ptp(picture) > 100
    assert main(["benchmark", "--growth", "--plot", str(plot)]) == ExitCode.USAGE, "never overwritten"
    assert main(["benchmark"]) == ExitCode.USAGE
    assert "name a BAG, or give --growth" in capsys.readouterr().err


def test_a_profile_names_the_kernels(capsys: pytest.CaptureFixture[str]) -> None:
    bag = Path(__file__).parents[2] / "bags" / "room_rgbd"
    assert main(["benchmark", str(bag), "--frames", "3", "--profile"]) == ExitCode.OK
    printed = capsys.readouterr().out
    assert "configuration rgbd, by what the bag holds" in printed
    assert "own ms per frame" in printed
    assert "depth_planes (depth_planes.py:" in printed
