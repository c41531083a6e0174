# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses between poses, and alignment, against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vigg_ros.registration.errors import DataError
from vigg_ros.registration.rigid import inverse
from vigg_ros.report.trajectory import BY_ORIENTATIONS, BY_POSITIONS, Trajectory, align, interpolate
from vigg_ros_testing.trajectory_samples import SECOND, motions, path, pose, winding

TENTH = SECOND // 10


def at(*stamps_ns):
    return np.array(stamps_ns, np.int64)


def test_between_two_poses_positions_are_linear_and_rotations_follow_the_arc():
    truth = Trajectory.of([0, TENTH], [pose(1, 0, 0, yaw_deg=10), pose(3, 4, 0, yaw_deg=50)])
    found, known = interpolate(truth, at(TENTH // 4))
    assert known.all()
    # A quarter of the way: (1, 0) + (2, 4) / 4, and 10 deg + 40 deg / 4.
    np.testing.assert_allclose(found.T_world_sensor[0], pose(1.5, 1, 0, yaw_deg=20), atol=1e-12)


def test_the_shortest_arc_is_taken():
    truth = Trajectory.of([0, TENTH], [pose(yaw_deg=170), pose(yaw_deg=-170)])
    found, _ = interpolate(truth, at(TENTH // 2))
    np.testing.assert_allclose(found.T_world_sensor[0], pose(yaw_deg=180), atol=1e-12)


@pytest.mark.parametrize(
    ("intervals_ms", "widest_ms"),
    [([10], 100), ([66], 100), ([100, 106], 159), ([300], 450), ([400], 500), ([5000], 500)],
)
def test_gaps_of_half_an_interval_more_are_bridged_and_a_nanosecond_more_is_not(intervals_ms, widest_ms):
    # 1.5 median intervals, from 0.1 to 0.5 s: a lost pose of a truth of 10 Hz is a gap, its jitter is none.
    steps_ns = [*(intervals_ms * 4), widest_ms, *(intervals_ms * 4)]
    for more_ns, bridged in ((0, True), (1, False)):
        stamps_ns = np.cumsum([0, *np.array(steps_ns) * 1_000_000])
        stamps_ns[len(intervals_ms) * 4 + 1 :] += more_ns
        truth = Trajectory.of(stamps_ns, winding(len(stamps_ns)))
        middle_ns = at(stamps_ns[len(intervals_ms) * 4] + 5)
        assert interpolate(truth, middle_ns)[1].tolist() == [bridged]


def test_a_truth_that_keeps_its_rate_loosely_is_known_everywhere_but_in_its_hole():
    # As KITTI's GPS packets: 100 to 106 ms apart. From the 30th on, 3 s are missing.
    intervals_ms = [100 + i % 7 for i in range(60)]
    stamps_ns = np.cumsum([0, *intervals_ms]) * 1_000_000
    stamps_ns[30:] += 3 * SECOND
    asked_ns = np.arange(stamps_ns[0], stamps_ns[-1], TENTH)
    known = interpolate(Trajectory.of(stamps_ns, winding(61)), asked_ns)[1]
    np.testing.assert_array_equal(known, (asked_ns <= stamps_ns[29]) | (asked_ns >= stamps_ns[30]))
    assert np.count_nonzero(~known) >= 30


def test_a_pose_at_the_stamp_itself_is_taken_as_it_is_whatever_the_gaps_around_it():
    poses = winding(3)
    found, known = interpolate(Trajectory.of([0, SECOND, 2 * SECOND], poses), at(0, 7, SECOND, 2 * SECOND))
    assert known.tolist() == [True, False, True, True]
    np.testing.assert_array_equal(found.T_world_sensor, poses)


def test_nothing_is_known_before_the_first_pose_and_after_the_last():
    truth = Trajectory.of([TENTH, 2 * TENTH], [pose(0), pose(1)])
    assert interpolate(truth, at(TENTH - 1, TENTH, 2 * TENTH, 2 * TENTH + 1))[1].tolist() == [
        False, True, True, False,
    ]  # fmt: skip
    found, known = interpolate(Trajectory.of([], []), at(1, 2))
    assert len(found) == 0
    assert known.tolist() == [False, False]


def test_stamps_of_nineteen_digits_keep_their_nanoseconds():
    start = 1_700_000_000_123_456_789
    truth = Trajectory.of([start, start + 4], [pose(0), pose(4)])
    found, _ = interpolate(truth, at(start + 1, start + 3))
    np.testing.assert_allclose(found.positions[:, 0], [1, 3], atol=1e-12)


@given(motions(), motions(), st.integers(0, TENTH))
def test_interpolation_commutes_with_moving_the_world(T_world_a, T_other_world, stamp_ns):
    truth = Trajectory.of([0, TENTH], [T_world_a, T_world_a @ winding(2, seed=3)[1]])
    here, _ = interpolate(truth, at(stamp_ns))
    there, _ = interpolate(truth.moved(T_other_world), at(stamp_ns))
    np.testing.assert_allclose(here.moved(T_other_world).T_world_sensor, there.T_world_sensor, atol=1e-9)


def test_poses_are_sorted_and_of_equal_stamps_the_first_one_counts():
    trajectory = Trajectory.of([5, 3, 5], [pose(5), pose(3), pose(99)])
    assert trajectory.stamps_ns.tolist() == [3, 5]
    assert trajectory.positions[:, 0].tolist() == [3, 5]


@pytest.mark.parametrize(
    ("stamps_ns", "poses", "code"),
    [
        (at(1, 2), np.zeros((3, 4, 4)), "TRAJECTORY_SHAPE"),
        (np.array([1.0]), np.zeros((1, 4, 4)), "TRAJECTORY_SHAPE"),
        (at(2, 2), np.zeros((2, 4, 4)), "TRAJECTORY_ORDER"),
        (at(1), np.full((1, 4, 4), np.nan), "TRAJECTORY_ORDER"),
    ],
)
def test_what_is_no_trajectory_is_refused(stamps_ns, poses, code):
    with pytest.raises(DataError) as caught:
        Trajectory(stamps_ns, poses)
    assert caught.value.code == code


def test_the_length_is_the_sum_of_the_steps():
    assert path([pose(0, 0), pose(3, 4), pose(3, 16)]).length_m == 5 + 12


@given(motions())
def test_alignment_finds_the_motion_between_two_worlds(T_truth_estimate):
    estimate = path(winding(8))
    alignment = align(estimate.moved(T_truth_estimate), estimate)
    assert alignment.words == BY_POSITIONS
    # Positions are up to 100 m, with 16 digits.
    np.testing.assert_allclose(alignment.T_truth_estimate, T_truth_estimate, atol=1e-11)


@pytest.mark.parametrize("count", [1, 2, 7])
@given(T_truth_estimate=motions())
def test_on_a_line_the_orientations_say_what_the_positions_leave_open(count, T_truth_estimate):
    estimate = path([pose(0.3 * i, yaw_deg=5 * i) for i in range(count)])
    alignment = align(estimate.moved(T_truth_estimate), estimate)
    assert alignment.words == BY_ORIENTATIONS
    assert "orientations" in alignment.words
    np.testing.assert_allclose(alignment.T_truth_estimate, T_truth_estimate, atol=1e-11)


def test_alignment_by_orientations_takes_their_mean_and_no_reflection():
    # Turned by +10 and -10 deg against the truth: the mean is no turn at all.
    truth = path([pose(0), pose(1)])
    estimate = path([pose(0, yaw_deg=10), pose(1, yaw_deg=-10)])
    np.testing.assert_allclose(align(truth, estimate).T_truth_estimate, np.eye(4), atol=1e-12)


@given(motions())
def test_swapping_the_two_inverts_the_alignment(T_truth_estimate):
    a = path(winding(9, seed=1))
    b = path([T_truth_estimate @ noisy for noisy in winding(9, seed=2)])
    forward, backward = align(a, b).T_truth_estimate, align(b, a).T_truth_estimate
    np.testing.assert_allclose(backward, inverse(forward), atol=1e-9)
