# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of motions and accuracy of trajectories worked out by hand, and what must not change them."""

import math

import numpy as np
import pytest
from hypothesis import given

from vigg_ros.report.accuracy import TrajectoryMetrics, measure_session
from vigg_ros.report.trajectory import Trajectory
from vigg_ros.report.trajectory_errors import (
    Spread,
    neighbours,
    one_second_apart,
    rotation_error_deg,
    translation_error_m,
)
from vigg_ros_testing.trajectory_samples import SECOND, motions, path, pose, winding


@pytest.mark.parametrize("angle_deg", [1e-9, 0.5, 30.0, 90.0, 179.999, 180.0])
def test_the_rotation_error_is_the_angle_between(angle_deg):
    T_a, T_b = pose(1, 2, 3, yaw_deg=20), pose(yaw_deg=20 + angle_deg)
    # 1e-13 deg is the last digit of an angle of 20 deg.
    assert rotation_error_deg(T_a, T_b) == pytest.approx(angle_deg, abs=1e-13, rel=1e-9)


def test_the_translation_error_is_the_distance():
    assert translation_error_m(pose(1, 1, 1, yaw_deg=70), pose(4, 5, 1)) == 5
    T = winding(3)[2]
    assert rotation_error_deg(T, T) < 1e-13
    assert translation_error_m(T, T) == 0


@given(motions(), motions(), motions())
def test_errors_of_motions_do_not_depend_on_the_world_nor_on_the_order(T_a, T_b, T_world):
    rotation, translation = rotation_error_deg(T_a, T_b), translation_error_m(T_a, T_b)
    assert rotation_error_deg(T_b, T_a) == pytest.approx(rotation, abs=1e-9)
    assert rotation_error_deg(T_world @ T_a, T_world @ T_b) == pytest.approx(rotation, abs=1e-5)
    assert translation_error_m(T_world @ T_a, T_world @ T_b) == pytest.approx(translation, abs=1e-9)


def test_a_spread_holds_median_p95_maximum_and_rmse():
    spread = Spread.of(np.arange(101.0))
    assert (spread.count, spread.median, spread.p95, spread.maximum) == (101, 50, 95, 100)
    # Mean of the squares 0..100: 100 * 101 * 201 / 6 / 101.
    assert spread.rmse == pytest.approx(math.sqrt(3350))
    nothing = Spread.of(np.empty(0))
    assert nothing.count == 0
    assert math.isnan(nothing.median)
    assert math.isnan(nothing.rmse)


def test_neighbours_are_frames_between_which_nothing_is_missing():
    known = np.array([True, True, False, True, False, True, True, True])
    # Rows among the known ones: 0 1 . 2 . 3 4 5
    assert neighbours(known).tolist() == [[0, 1], [3, 4], [4, 5]]


def test_one_second_later_is_the_nearest_frame_within_a_tenth():
    stamps_ns = np.array([0, 400, 990, 1020, 1450, 2800]) * 1_000_000
    # 0 -> 990, 400 -> 1450; 990 and 1020 have nothing near 1990 and 2020, 1450 nothing near 2450.
    assert one_second_apart(stamps_ns).tolist() == [[0, 2], [1, 4]]
    assert one_second_apart(np.array([0, 900_000_000, 1_200_000_000])).tolist() == [[0, 1]]
    assert one_second_apart(np.array([0, 899_999_999, 1_200_000_000])).size == 0


def test_the_last_second_of_a_path_has_no_partner():
    assert one_second_apart(np.arange(12) * SECOND // 10).tolist() == [[0, 10], [1, 11]]
    assert one_second_apart(np.array([0, 950_000_000])).size == 0


CORNERS = [(1, 1), (-1, 1), (-1, -1), (1, -1)]


def compare(estimate, truth, received=None):
    return measure_session(0, estimate, truth, received=received or len(estimate))


def test_the_ate_of_a_bent_square_is_the_bend():
    # Corners lifted by +-5 cm in turn: a saddle, whose best plane is the flat one.
    truth = path([pose(x, y) for x, y in CORNERS])
    estimate = path([pose(x, y, 0.05 * (-1) ** i) for i, (x, y) in enumerate(CORNERS)])
    result = compare(estimate, truth)
    ate = Spread.of(result.accuracy.absolute.translation_m)
    assert (ate.rmse, ate.median, ate.maximum) == pytest.approx((0.05, 0.05, 0.05))
    assert result.accuracy.alignment == "SE(3) alignment of the positions, without scale"


def test_alignment_does_not_absorb_a_wrong_scale():
    truth = path([pose(x, y) for x, y in CORNERS])
    estimate = path([pose(2 * x, 2 * y) for x, y in CORNERS])
    assert compare(estimate, truth).accuracy.absolute.translation_m == pytest.approx([math.sqrt(2)] * 4)


def test_a_step_that_is_a_hundredth_too_long_drifts_by_one_percent():
    truth = path([pose(i, 0, 0) for i in range(21)], rate_hz=5)
    estimate = path([pose(1.01 * i, 0, 0) for i in range(21)], rate_hz=5)
    accuracy = compare(estimate, truth).accuracy
    assert accuracy.consecutive.translation_m == pytest.approx([0.01] * 20)
    assert accuracy.per_second.translation_m == pytest.approx([0.05] * 16)
    assert accuracy.per_second.rotation_deg == pytest.approx([0] * 16, abs=1e-9)
    assert accuracy.path_m == pytest.approx(20)
    assert accuracy.end_error_m == pytest.approx(0.2)
    assert accuracy.drift_percent == pytest.approx(1)
    # On a line: aligned at its middle, off by -10 to 10 cm.
    assert accuracy.absolute.translation_m == pytest.approx(np.abs(np.arange(-10, 11)) / 100)
    assert "line" in accuracy.alignment


def test_a_slow_turn_shows_in_the_relative_rotation():
    truth = path([pose(math.sin(i), math.cos(i)) for i in range(31)])
    estimate = path([pose(math.sin(i), math.cos(i), yaw_deg=0.2 * i) for i in range(31)])
    accuracy = compare(estimate, truth).accuracy
    assert accuracy.consecutive.rotation_deg == pytest.approx([0.2] * 30)
    assert accuracy.per_second.rotation_deg == pytest.approx([2.0] * 21)


def test_rotations_are_not_judged_by_an_alignment_that_a_short_path_cannot_give():
    # A walk of 1 m that wanders by 2 cm, seen with 2 cm of noise: positions leave the roll open.
    truth = path([pose(0.1 * i, 0.02 * (i % 2)) for i in range(11)])
    estimate = path([pose(0.1 * i, 0, 0.02 * (i % 2)) for i in range(11)])
    rotated = compare(estimate, truth)
    assert rotation_error_deg(rotated.alignment.T_truth_estimate, np.eye(4)) > 80
    assert rotated.accuracy.absolute.rotation_deg == pytest.approx([0] * 11, abs=1e-9)


def test_a_rotation_off_to_both_sides_is_measured_from_the_middle():
    truth = path([pose(x, y) for x, y in CORNERS])
    estimate = path([pose(x, y, yaw_deg=50 + 3 * (-1) ** i) for i, (x, y) in enumerate(CORNERS)])
    assert compare(estimate, truth).accuracy.absolute.rotation_deg == pytest.approx([3] * 4)


def test_frames_without_truth_are_counted_and_not_compared():
    poses = winding(30)
    truth = Trajectory.of(path(poses).stamps_ns[5:20], poses[5:20])
    accuracy = compare(path(poses), truth, received=40).accuracy
    assert (accuracy.received, accuracy.answered, accuracy.compared) == (40, 30, 15)
    assert accuracy.coverage == 0.75
    assert accuracy.absolute.translation_m == pytest.approx([0] * 15, abs=1e-12)
    assert accuracy.absolute.stamps_ns.tolist() == truth.stamps_ns.tolist()


@pytest.mark.parametrize("answered", [0, 1])
def test_less_than_two_frames_are_not_compared(answered):
    truth = path(winding(5))
    result = compare(truth.select(np.arange(answered)), truth, received=5)
    assert result.alignment is None
    assert result.accuracy.alignment == ""
    assert (result.accuracy.answered, result.accuracy.compared) == (answered, 0)
    assert math.isnan(result.accuracy.as_dict()["absolute"]["translation_m"]["rmse"])


def test_a_camera_at_rest_has_no_drift_in_percent():
    at_rest = path([pose()] * 10)
    assert math.isnan(compare(at_rest, at_rest).accuracy.drift_percent)


def figures(accuracy):
    """All errors in one row."""
    parts = (accuracy.absolute, accuracy.consecutive, accuracy.per_second)
    errors = [values for part in parts for values in (part.translation_m, part.rotation_deg)]
    return np.concatenate([*errors, [accuracy.path_m, accuracy.end_error_m]])


@given(motions(), motions())
def test_moving_either_world_leaves_all_errors(T_a, T_b):
    truth, estimate = path(winding(25, seed=1)), path(winding(25, seed=2))
    here = compare(estimate, truth).accuracy
    there = compare(estimate.moved(T_a), truth.moved(T_b)).accuracy
    # 100 m away the last digit is 1e-14 m, of an angle 1e-14 rad; sums of 25 poses lose three more.
    np.testing.assert_allclose(figures(there), figures(here), atol=1e-9)


def test_swapping_truth_and_estimate_leaves_the_errors():
    a, b = path(winding(25, seed=1)), path(winding(25, seed=2))
    forward, backward = compare(a, b).accuracy, compare(b, a).accuracy
    np.testing.assert_allclose(figures(forward)[:-2], figures(backward)[:-2], atol=1e-9)
    assert forward.path_m != backward.path_m


def session(number, offset, count, received):
    """A square walked round and round, bent by the offset."""
    truth = [pose(*CORNERS[i % 4]) for i in range(count)]
    estimate = [pose(*CORNERS[i % 4], offset * (-1) ** i) for i in range(count)]
    return measure_session(number, path(estimate), path(truth), received=received)


def test_sessions_are_pooled_by_their_errors_not_by_their_averages():
    metrics = TrajectoryMetrics.of([session(0, 0.1, 4, 10), session(3, 0.4, 12, 12)])
    pooled = metrics.pooled
    assert (pooled.received, pooled.answered, pooled.compared) == (22, 16, 16)
    expected = math.sqrt((4 * 0.1**2 + 12 * 0.4**2) / 16)
    assert Spread.of(pooled.absolute.translation_m).rmse == pytest.approx(expected)
    assert pooled.path_m == pytest.approx(2 * 3 + 2 * 11)
    assert pooled.alignment.endswith("each session by itself")
    assert [one["session"] for one in metrics.as_dict()["sessions"]] == [0, 3]
    nothing = TrajectoryMetrics.of([]).pooled
    assert (nothing.received, nothing.compared, nothing.coverage, nothing.alignment) == (0, 0, 0, "")
