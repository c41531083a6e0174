# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Figures of trajectories against hand-computed ones, and against evo's where it is installed."""

import numpy as np
import pytest

from vigg_ros.bench.trajectory_comparison import compare_trajectories, covered_share
from vigg_ros.registration import DataError
from vigg_ros.report.trajectory import Trajectory
from vigg_ros_testing.trajectory_samples import SECOND, path, pose, winding


def compare(estimate, reference, slop_s=0.01, delta_frames=1):
    return compare_trajectories(estimate, reference, slop_s=slop_s, delta_frames=delta_frames)


def test_a_zigzag_is_measured_as_by_hand():
    # A square of 2 m, of which every corner is off by 10 cm up or down, in turn: no alignment can take that out.
    corners = [(0, 0), (2, 0), (2, 2), (0, 2)]
    truth = path([pose(x, y) for x, y in corners])
    errors = compare(path([pose(x, y, 0.1 * (-1) ** i) for i, (x, y) in enumerate(corners)]), truth)
    assert errors.ate_m.rmse == pytest.approx(0.1)
    # From corner to corner 20 cm up or down.
    assert errors.rpe_m.median == pytest.approx(0.2)
    assert errors.rpe_deg.maximum == pytest.approx(0, abs=1e-6)
    assert (errors.poses, errors.compared, errors.covered) == (4, 4, 1.0)
    assert "SE(3) alignment of the positions" in errors.alignment


def evo_errors(estimate, reference, slop_s, delta_frames):
    """ATE (m), RPE (m), RPE (deg) of each pose or pair, by evo."""
    from evo.core import metrics, sync
    from evo.core.trajectory import PoseTrajectory3D

    parts = sync.associate_trajectories(
        *(PoseTrajectory3D(poses_se3=list(t.T_world_sensor.copy()), timestamps=t.stamps_ns / SECOND)
          for t in (reference, estimate)), max_diff=slop_s,
    )  # fmt: skip
    relations = metrics.PoseRelation.translation_part, metrics.PoseRelation.rotation_angle_deg
    rpe = [metrics.RPE(one, delta_frames, metrics.Unit.frames, all_pairs=True) for one in relations]
    for metric in rpe:
        metric.process_data(parts)
    parts[1].align(parts[0], correct_scale=False)
    ate = metrics.APE(relations[0])
    ate.process_data(parts)
    return ate.error, rpe[0].error, rpe[1].error


@pytest.mark.parametrize("delta_frames", [1, 4])
@pytest.mark.parametrize(("rate_hz", "offset_ns"), [(10, 0), (20, 3_000_000)])
def test_our_figures_are_evos(rate_hz, offset_ns, delta_frames):
    pytest.importorskip("evo")
    estimate = path(winding(60, seed=2))
    reference = path(winding(120, seed=1), rate_hz=rate_hz, start_ns=SECOND + offset_ns)
    ours = compare(estimate, reference, delta_frames=delta_frames)
    assert ours.compared == 60
    theirs = evo_errors(estimate, reference, 0.01, delta_frames)
    for their, our in zip(theirs, (ours.ate_m, ours.rpe_m, ours.rpe_deg), strict=True):
        assert our.count == len(their)
        assert our.rmse == pytest.approx(np.sqrt(np.mean(np.square(their))), rel=1e-6)
        assert (our.maximum, our.median) == pytest.approx((max(their), np.median(their)), rel=1e-6)


def test_stamps_of_nineteen_digits_find_their_partners():
    start = 1_700_000_000 * SECOND + 123_456_789
    truth, estimate = path(winding(9), start_ns=start), path(winding(9), start_ns=start + 400_000)
    assert compare(estimate, truth, slop_s=0.0004).compared == 9
    with pytest.raises(DataError, match="0 poses whose stamps are within"):
        compare(estimate, truth, slop_s=0.0003)


@pytest.mark.parametrize(("poses", "delta_frames", "needed"), [(2, 1, 3), (0, 1, 3), (5, 5, 6)])
def test_too_few_poses_are_not_compared(poses, delta_frames, needed):
    estimate = path(winding(5)).select(np.arange(poses)) if poses else Trajectory.of([], [])
    with pytest.raises(DataError, match=f"found {poses} poses.*expected at least {needed}"):
        compare(estimate, path(winding(5)), delta_frames=delta_frames)


def test_covered_is_the_time_in_which_poses_follow_each_other():
    truth = path([pose(i) for i in range(101)])  # 10 s
    kept = [i for i in range(101) if i <= 40 or i >= 70]
    assert covered_share(truth.select(np.array(kept)), truth) == pytest.approx(0.7)
    assert covered_share(truth, truth.select(np.arange(51))) == 1.0
    assert covered_share(truth.select(np.arange(1)), truth) == 0.0
