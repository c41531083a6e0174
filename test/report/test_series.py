# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings as series over time."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vigg_ros.report.recording import measure, truth_frame_note
from vigg_ros.report.series import (
    LOST,
    NO_FRAME,
    REFUSED,
    STRIP_COLUMNS,
    TRACKING,
    choose_plan,
    evidence_series,
    find_routes,
    frame_errors,
    positions,
    runs,
    stage_times_ms,
    state_columns,
    time_axis,
    totals_ms,
)
from vigg_ros.sensors.observation import StampedPose
from vigg_ros_testing.report_samples import lost, pose_at, recording, refused, stamp, started, tracked, truth


def frames(*estimates):
    return recording(estimates).frames


def test_time_counts_from_the_first_frame():
    axis = time_axis(frames(started(3), tracked(4), tracked(6)))
    assert axis.values == pytest.approx([0, 0.1, 0.3])
    assert axis.label == "time (s)"
    assert axis.place(2) == "0.30 s"


def test_refused_images_with_broken_stamps_stay_between_their_neighbours():
    shown = frames(started(1), tracked(2), refused(3), refused(0, stamp_ns=9), refused(99), tracked(4), tracked(5))
    assert time_axis(shown).values == pytest.approx([0, 0.1, 0.2, 0.2, 0.3, 0.3, 0.4])


def test_refused_images_at_either_end_take_no_more_time_than_their_number_allows():
    shown = frames(refused(0, stamp_ns=0), refused(0), started(1), tracked(2), refused(3), refused(99))
    # Of the first two one could be 0.2 s before the start, and is put there.
    assert time_axis(shown).values == pytest.approx([0, 0.1, 0.2, 0.3, 0.4, 0.5])


def test_frame_numbers_stand_for_time_where_the_clock_jumps_back():
    axis = time_axis(frames(started(5), tracked(6), started(0, session=1)))
    assert axis.values.tolist() == [0, 1, 2]
    assert axis.label == "frame, in order of arrival"
    assert axis.place(2) == "frame 2"


@pytest.mark.parametrize("estimates", [(), (refused(0),), (refused(0), refused(1, stamp_ns=0))])
def test_without_a_good_frame_there_are_only_numbers(estimates):
    assert time_axis(frames(*estimates)).values.tolist() == list(range(len(estimates)))


def test_columns_show_each_state_for_as_long_as_it_held():
    shown = frames(started(0), tracked(1), lost(2), refused(3))
    columns = state_columns(shown, time_axis(shown))
    quarter = STRIP_COLUMNS // 4
    expected = np.repeat([TRACKING, TRACKING, LOST, REFUSED], quarter)
    # A frame ends up to a column off, by rounding.
    assert np.count_nonzero(columns != expected) <= 3


def test_one_lost_frame_of_thousands_is_still_seen():
    estimates = [started(0), *(tracked(i) for i in range(1, 5000))]
    estimates[2345] = lost(2345)
    shown = frames(*estimates)
    columns = state_columns(shown, time_axis(shown))
    assert np.count_nonzero(columns == LOST) == 1


def test_a_pause_of_the_recording_shows_no_frame():
    shown = frames(started(0), tracked(1), tracked(2), tracked(100))
    columns = state_columns(shown, time_axis(shown))
    # 0.2 s and five intervals of 0.1 s after it, of 10.1 s; then one frame at the end.
    assert np.count_nonzero(columns == NO_FRAME) / STRIP_COLUMNS == pytest.approx(1 - 0.8 / 10.1, abs=0.005)


@given(st.lists(st.integers(0, 4), min_size=1, max_size=50))
def test_runs_cover_the_axis_without_a_gap(values):
    axis = time_axis(frames(started(0), tracked(1), tracked(4)))
    found = runs(np.array(values), axis)
    assert all(a[0] != b[0] for a, b in pairwise(found))
    assert [a[1] + a[2] for a in found[:-1]] == pytest.approx([b[1] for b in found[1:]])
    assert (found[0][1], found[-1][1] + found[-1][2]) == pytest.approx(axis.range)


def test_evidence_and_positions_are_nan_where_there_are_none():
    shown = frames(started(0), tracked(1, overlap=0.7), lost(2), refused(3))
    assert evidence_series(shown, "overlap") == pytest.approx([np.nan, 0.7, np.nan, np.nan], nan_ok=True)
    assert np.isnan(positions(shown)).any(axis=1).tolist() == [False, False, True, True]


def test_times_count_frames_that_were_processed_and_stages_that_were_skipped():
    shown = frames(started(0, timings_ms={"keypoints": 2.0}), tracked(1), refused(2))
    assert totals_ms(shown).tolist() == [2, 55]
    assert {stage: times.tolist() for stage, times in stage_times_ms(shown).items()} == {
        "keypoints": [2, 20], "features": [0, 30], "verification": [0, 5],
    }  # fmt: skip


def test_the_truth_is_laid_onto_the_route_and_says_where_frames_were_lost():
    walked = recording([started(0), *map(tracked, range(1, 6)), lost(6), tracked(7)], truth=truth(8))
    (route,) = find_routes(walked, measure(walked))
    expected = [pose_at(i)[:3, 3] for i in range(8)]
    np.testing.assert_allclose(route.truth, expected, atol=1e-9)
    assert route.lost.tolist() == [False] * 6 + [True, False]


def test_errors_stand_with_their_frames():
    walked = recording([started(0), lost(1), *map(tracked, range(2, 6)), refused(6)], truth=truth(5))
    errors = frame_errors(walked, measure(walked))
    assert np.isnan(errors[:, 0]).tolist() == [False, True, False, False, False, True, True]
    assert np.nanmax(errors[:, 0]) < 1e-9


def test_the_longest_route_comes_first_and_sessions_without_an_answer_have_none():
    estimates = [started(0), lost(1, session=2), started(2, session=5), tracked(3, session=5)]
    assert [route.session for route in find_routes(recording(estimates), None)] == [5, 0]


@pytest.mark.parametrize(
    ("extent", "plan"), [((3, 1, 2), (0, 2, 1)), ((3, 2, 1), (0, 1, 2)), ((1, 2, 3), (1, 2, 0)), ((0, 0, 0), (0, 2, 1))]
)
def test_a_map_is_seen_along_the_axis_of_least_extent(extent, plan):
    points = np.array([np.zeros(3), extent, np.full(3, np.nan)])
    assert choose_plan(points) == plan


def test_truth_of_another_frame_is_pointed_out():
    T = np.eye(4)
    poses = [StampedPose(stamp(0), "map", "base_link", T)]
    note = truth_frame_note(recording([started(0)], truth=poses))
    assert "base_link" in note
    assert "camera" in note
    assert truth_frame_note(recording([started(0, frame_id="base_link")], truth=poses)) == ""
    assert truth_frame_note(recording([started(0)], truth=[StampedPose(stamp(0), "map", "", T)])) == ""


def test_sessions_are_measured_by_themselves():
    # The second session starts in its own frame: poses 4 to 7 as seen from pose 4.
    start = np.linalg.inv(pose_at(4))
    second = [tracked(i, session=1, T_odom_frame=start @ pose_at(i)) for i in range(5, 8)]
    walked = recording(
        [started(0), *map(tracked, range(1, 4)), started(4, session=1, T_odom_frame=np.eye(4)), *second],
        truth=truth(8),
    )
    metrics = measure(walked)
    assert [one.accuracy.compared for one in metrics.sessions] == [4, 4]
    assert metrics.pooled.absolute.translation_m.max() < 1e-9
    assert measure(recording([started(0), tracked(1)])) is None, "without truth"
