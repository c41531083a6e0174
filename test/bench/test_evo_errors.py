# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""evo's figures against hand-computed ones, and our own metrics against evo's."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest

from vigg_ros.bench.evo_errors import compare, covered_share
from vigg_ros.registration.errors import DataError
from vigg_ros.report.accuracy import measure_session
from vigg_ros.report.trajectory import Trajectory
from vigg_ros_testing.trajectory_samples import SECOND, path, pose, winding

needs_evo = pytest.mark.skipif(importlib.util.find_spec("evo") is None, reason="evo is not installed")


@needs_evo
def test_a_zigzag_is_measured_as_by_hand():
    # A square of 2 m, of which every corner is off by 10 cm up or down, in turn: no alignment can take that out.
    corners = [(0, 0), (2, 0), (2, 2), (0, 2)]
    truth = path([pose(x, y) for x, y in corners])
    estimate = path([pose(x, y, 0.1 * (-1) ** i) for i, (x, y) in enumerate(corners)])
    errors = compare(estimate, truth, slop_s=0.01, delta_frames=1)
    assert errors.ate_m.rmse == pytest.approx(0.1)
    # From corner to corner 20 cm up or down.
    assert errors.rpe_m.median == pytest.approx(0.2)
    assert errors.rpe_deg.maximum == pytest.approx(0, abs=1e-6)
    assert (errors.poses, errors.compared, errors.covered) == (4, 4, 1.0)
    assert "SE(3)" in errors.alignment


@needs_evo
def test_our_own_figures_are_evos():
    truth, estimate = path(winding(60, seed=1)), path(winding(60, seed=2))
    theirs = compare(estimate, truth, slop_s=0.01, delta_frames=1)
    ours = measure_session(0, estimate, truth, received=60).accuracy
    for their, our in (
        (theirs.ate_m, ours.absolute.translation_m),
        (theirs.rpe_m, ours.consecutive.translation_m),
        (theirs.rpe_deg, ours.consecutive.rotation_deg),
    ):
        assert their.count == len(our)
        assert their.rmse == pytest.approx(np.sqrt(np.mean(our**2)), rel=1e-6)
        assert their.maximum == pytest.approx(our.max(), rel=1e-6)


@needs_evo
def test_stamps_of_nineteen_digits_find_their_partners():
    start = 1_700_000_000 * SECOND + 123_456_789
    truth, estimate = path(winding(9), start_ns=start), path(winding(9), start_ns=start + 400_000)
    assert compare(estimate, truth, slop_s=0.0005, delta_frames=1).compared == 9
    with pytest.raises(DataError, match="0 poses whose stamps are within"):
        compare(estimate, truth, slop_s=0.0003, delta_frames=1)


@needs_evo
def test_fewer_than_three_poses_are_not_compared():
    with pytest.raises(DataError, match="expected at least 3"):
        compare(path(winding(2)), path(winding(2)), slop_s=0.01, delta_frames=1)
    with pytest.raises(DataError, match="expected at least 3"):
        compare(Trajectory.of([], []), path(winding(5)), slop_s=0.01, delta_frames=1)


@needs_evo
def test_a_path_on_a_line_is_aligned_by_its_first_poses():
    truth = path([pose(x) for x in range(5)])
    estimate = path([pose(x + 7, 0.1 * (x == 4), yaw_deg=0) for x in range(5)])
    on_a_line = compare(path([pose(2 * x) for x in range(5)]), truth, slop_s=0.01, delta_frames=1)
    assert "first poses" in on_a_line.alignment
    # 1 m too far after the first step, 4 m after the fourth.
    assert (on_a_line.ate_m.median, on_a_line.ate_m.maximum) == (pytest.approx(2), pytest.approx(4))
    assert "positions (Umeyama" in compare(estimate, path([pose(x, 0.1 * x**2) for x in range(5)]), slop_s=0.01,
                                           delta_frames=1).alignment  # fmt: skip


@needs_evo
def test_rpe_needs_one_more_pose_than_it_spans():
    assert compare(path(winding(5)), path(winding(5)), slop_s=0.01, delta_frames=4).rpe_m.count == 1
    with pytest.raises(DataError, match="expected at least 6"):
        compare(path(winding(5)), path(winding(5)), slop_s=0.01, delta_frames=5)


def test_covered_is_the_time_in_which_poses_follow_each_other():
    truth = path([pose(i) for i in range(101)])  # 10 s
    kept = [i for i in range(101) if i <= 40 or i >= 70]
    assert covered_share(truth.select(np.array(kept)), truth) == pytest.approx(0.7)
    assert covered_share(truth, truth.select(np.arange(51))) == 1.0
    assert covered_share(truth.select(np.arange(1)), truth) == 0.0
