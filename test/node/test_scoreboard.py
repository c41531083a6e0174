# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What was sent against what came back, by hand-made answers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vigg_ros.node.player.scoreboard import Errors, Scoreboard
from vigg_ros.registration.rigid import inverse
from vigg_ros.report.trajectory import Trajectory

PERIOD_NS = 100_000_000
STAMPS_NS = [1_700_000_000_000_000_001 + k * PERIOD_NS for k in range(6)]


def placed(x_m: float, *, yaw_deg: float = 0.0) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("z", yaw_deg, degrees=True).as_matrix()
    T[0, 3] = x_m
    return T


TRUE_POSES = [placed(0.1 * k, yaw_deg=10 * k) for k in range(6)]
T_ODOM_WORLD = placed(-3.0, yaw_deg=120.0)
"""The odometry frame is any other frame than the truth's."""


def board_with_truth() -> Scoreboard:
    return Scoreboard(Errors(Trajectory.of(STAMPS_NS, TRUE_POSES)))


def answer(
    board: Scoreboard, k: int, T_odom_frame: np.ndarray, state: str = "TRACKING", *, first: str = "pose"
) -> None:
    """Frame k is sent at k seconds; pose and status come 0.25 s later, in either order."""
    board.sent(STAMPS_NS[k], STAMPS_NS[k], float(k))
    for what in ("pose", "status") if first == "pose" else ("status", "pose"):
        if what == "pose":
            board.posed(STAMPS_NS[k], T_odom_frame, k + 0.25)
        else:
            board.stated(STAMPS_NS[k], state, "", k + 0.25, has_pose=True)


def test_exact_answers_in_another_frame_have_no_error() -> None:
    board = board_with_truth()
    for k, T_world_frame in enumerate(TRUE_POSES):
        answer(board, k, T_ODOM_WORLD @ T_world_frame, "TRACKING" if k else "STARTED")
    score = board.score(5.5)
    assert score.errors_m == pytest.approx(np.zeros(6), abs=1e-12)
    assert score.latencies_ms == pytest.approx(np.full(6, 250.0))
    assert (score.sent, score.answered, score.silent, score.dropped) == (6, 6, 0, 0)
    assert score.state == "TRACKING"


def test_an_error_is_that_of_the_position_relative_to_the_first_frame() -> None:
    board = board_with_truth()
    answer(board, 0, T_ODOM_WORLD @ TRUE_POSES[0], "STARTED")
    answer(board, 1, T_ODOM_WORLD @ TRUE_POSES[1] @ placed(0.03))
    assert board.score(2.0).errors_m == pytest.approx([0.0, 0.03])


@pytest.mark.parametrize("first", ["pose", "status"])
def test_a_new_odometry_frame_is_aligned_anew_whichever_message_comes_first(first: str) -> None:
    board = board_with_truth()
    for k in range(3):
        answer(board, k, T_ODOM_WORLD @ TRUE_POSES[k], "TRACKING" if k else "STARTED", first=first)
    T_other_world = inverse(TRUE_POSES[3])
    for k in range(3, 6):
        answer(board, k, T_other_world @ TRUE_POSES[k], "TRACKING" if k > 3 else "STARTED", first=first)
    assert board.score(6.0).errors_m == pytest.approx(np.zeros(6), abs=1e-12)


def test_answers_are_compared_by_the_stamps_of_the_recording() -> None:
    board = board_with_truth()
    moved_ns = 10**18
    for k, T_world_frame in enumerate(TRUE_POSES):
        board.sent(STAMPS_NS[k], STAMPS_NS[k] + moved_ns, float(k))
        board.posed(STAMPS_NS[k] + moved_ns, T_world_frame, k + 0.1)
    assert board.score(6.0).errors_m == pytest.approx(np.zeros(6), abs=1e-12)


def test_frames_whose_truth_is_not_known_are_answered_but_not_compared() -> None:
    board = Scoreboard(Errors(Trajectory.of(STAMPS_NS[2:4], TRUE_POSES[2:4])))
    for k, T_world_frame in enumerate(TRUE_POSES):
        answer(board, k, T_world_frame, "TRACKING" if k else "STARTED")
    score = board.score(6.0)
    assert score.answered == 6
    assert len(score.errors_m) == 2


def test_without_truth_there_are_no_errors() -> None:
    board = Scoreboard(Errors(None))
    answer(board, 0, np.eye(4), "STARTED")
    assert board.score(1.0).errors_m.size == 0


def test_what_has_no_pose_is_counted_by_reason_and_a_drop_is_not_the_state() -> None:
    board = board_with_truth()
    for k, (state, reason) in enumerate([("LOST", "LOW_OVERLAP"), *[("DROPPED", "NEWER_FRAME")] * 2]):
        board.sent(STAMPS_NS[k], STAMPS_NS[k], float(k))
        board.stated(STAMPS_NS[k], state, reason, k + 0.1, has_pose=False)
    board.sent(STAMPS_NS[3], STAMPS_NS[3], 3.0)
    score = board.score(4.0)
    assert score.unanswered == {"LOST LOW_OVERLAP": 1, "DROPPED NEWER_FRAME": 2}
    assert (score.sent, score.answered, score.silent, score.dropped) == (4, 0, 1, 2)
    assert score.state == "LOST LOW_OVERLAP"


def test_answers_to_frames_of_others_count_for_nothing() -> None:
    board = board_with_truth()
    board.sent(STAMPS_NS[0], STAMPS_NS[0], 0.0)
    board.posed(STAMPS_NS[1], np.eye(4), 1.0)
    board.stated(STAMPS_NS[1], "LOST", "LOW_OVERLAP", 1.0, has_pose=False)
    score = board.score(2.0)
    assert (score.answered, score.silent, sum(score.unanswered.values())) == (0, 1, 0)


def test_rate_and_latency_are_those_of_the_last_seconds() -> None:
    board = board_with_truth()
    for k in range(6):
        answer(board, k, np.eye(4))
    # 0.25 s after k = 3, 4 and 5 lie in the 3 s before 6.0.
    score = board.score(6.0)
    assert score.rate_hz == pytest.approx(1.0)
    assert score.recent_latency_ms == pytest.approx(250.0)
    assert np.isnan(board.score(100.0).recent_latency_ms)
