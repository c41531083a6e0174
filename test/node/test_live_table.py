# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What ``vigg live`` counts and shows, from answers made by hand."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vigg_ros.node.player import live_frames, live_table
from vigg_ros.node.player.live_frames import LiveFrames
from vigg_ros.node.player.live_table import REDRAW_S, REPEAT_S, LiveDisplay, advice_on_drops, live_rows
from vigg_ros.node.player.node_process import Usage
from vigg_ros.registration.rigid import inverse
from vigg_ros.report.trajectory import Trajectory
from vigg_ros.report.wording import table_text

STAMPS_NS = [1_700_000_000_000_000_001 + k * 100_000_000 for k in range(6)]
NOTHING = Usage(100.0, 10.0, 300.0)


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    now_s = [100.0]
    for module in (live_frames, live_table):
        monkeypatch.setattr(module.time, "monotonic", lambda: now_s[0])
    return now_s


def placed(x_m, *, yaw_deg=0.0):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("z", yaw_deg, degrees=True).as_matrix()
    T[0, 3] = x_m
    return T


TRUE_POSES = [placed(0.1 * k, yaw_deg=10 * k) for k in range(6)]
TRUTH = Trajectory.of(STAMPS_NS, TRUE_POSES)
T_ODOM_WORLD = placed(-3.0, yaw_deg=120.0)
"""The odometry frame is any other frame than the truth's."""


def answered(truth, poses, *, first="pose", starts=0):
    """All frames, each answered at once, by pose and status in either order; sessions begin with 0 and ``starts``."""
    frames = LiveFrames(truth)
    for k, (stamp_ns, T_odom_frame) in enumerate(zip(STAMPS_NS, poses, strict=True)):
        frames.send(stamp_ns)
        for what in ("pose", "status") if first == "pose" else ("status", "pose"):
            if what == "pose":
                frames.take_pose(stamp_ns, T_odom_frame)
            else:
                frames.take_status(stamp_ns, "STARTED" if k in (0, starts) else "TRACKING", "")
    return frames


def test_an_error_is_that_of_the_position_relative_to_the_first_frame():
    poses = [T_ODOM_WORLD @ T @ placed(0.03 * (k == 4)) for k, T in enumerate(TRUE_POSES)]
    assert answered(TRUTH, poses).position_errors_m() == pytest.approx([0, 0, 0, 0, 0.03, 0], abs=1e-12)


@pytest.mark.parametrize("first", ["pose", "status"])
def test_a_new_session_is_aligned_anew_whichever_message_comes_first(first):
    poses = [(T_ODOM_WORLD if k < 3 else inverse(TRUE_POSES[3])) @ T for k, T in enumerate(TRUE_POSES)]
    errors_m = answered(TRUTH, poses, first=first, starts=3).position_errors_m()
    assert errors_m == pytest.approx(np.zeros(6), abs=1e-12)


@pytest.mark.parametrize(("truth", "count"), [(Trajectory.of(STAMPS_NS[2:4], TRUE_POSES[2:4]), 2), (None, 0)])
def test_frames_whose_truth_is_not_known_are_answered_but_not_compared(truth, count):
    frames = answered(truth, TRUE_POSES)
    assert len(frames.answered) == 6
    assert len(frames.position_errors_m()) == count


def test_answers_to_frames_of_others_count_for_nothing():
    frames = LiveFrames(TRUTH)
    frames.send(STAMPS_NS[0])
    frames.take_pose(STAMPS_NS[1], np.eye(4))
    frames.take_status(STAMPS_NS[1], "LOST", "LOW_OVERLAP")
    assert (len(frames.answered), frames.failures.total(), frames.pending) == (0, 0, 1)


def test_the_table_counts_every_frame_once(clock):
    frames = LiveFrames(TRUTH)
    for k, (state, latency_s) in enumerate([("STARTED", 0.1), ("TRACKING", 0.2), ("TRACKING", 0.3)]):
        clock[0] = 100.0 + k
        frames.send(STAMPS_NS[k])
        clock[0] += latency_s
        frames.take_pose(STAMPS_NS[k], TRUE_POSES[k] @ placed(0.05 * k))
        frames.take_status(STAMPS_NS[k], state, "")
    for k, state in enumerate(["DROPPED NEWER_FRAME", "LOST LOW_OVERLAP"], 3):
        frames.send(STAMPS_NS[k])
        frames.take_status(STAMPS_NS[k], *state.split())
    clock[0] = 105.0
    frames.send(STAMPS_NS[5])
    frames.take_status(STAMPS_NS[5], "TRACKING", "")  # whose pose is still on its way
    assert live_rows(frames, NOTHING, Usage(105.0, 17.5, 400.2)) == {
        "frames sent": "6 in 5.0 s (1.0 Hz)",
        "poses received": "3 (50.0%, 0.4 Hz)",
        "without a pose": "DROPPED NEWER_FRAME: 1, LOST LOW_OVERLAP: 1",
        "without an answer": "1 (lost on the way, without partner, or still waiting)",
        "latency": "median 200 ms, p95 290 ms, from publishing to receiving the pose",
        "position error": "median 5.00 cm, max 10.00 cm, over 3 frames, aligned at the first pose of each session",
        "node": "CPU 150 % of one core in the mean, memory 400 MB at most",
    }


def test_what_is_not_known_is_not_made_up():
    rows = live_rows(LiveFrames(None), NOTHING, None)
    assert rows["latency"] == "-"
    assert rows["position error"] == "- (no answered frame has a true pose)"
    assert "node" not in rows


@pytest.mark.parametrize(
    ("dropped", "pending", "rate", "words"),
    [
        (60, 3, 1.0, "60 of 100 frames were dropped because newer ones came; try --rate 0.3"),  # of 0.37
        (60, 3, 0.2, "try --rate 0.07"),
        (1, 0, 1.0, "try --rate 0.9"),
        (40, 0, 4.0, "try --rate 2"),
        (40, 0, 0.5, "try --rate 0.3"),  # exactly
        (100, 0, 1.0, "100 of 100 frames were dropped because newer ones came"),
        (0, 3, 1.0, ""),
    ],
)
def test_dropped_frames_end_in_advice(dropped, pending, rate, words):
    frames = LiveFrames(None)
    for number in range(100):
        frames.send(number)
        if number >= pending:
            frames.take_status(number, "DROPPED" if number < pending + dropped else "LOST", "")
    advice = advice_on_drops(frames, rate)
    assert advice.endswith(words)
    assert bool(advice) == bool(words)


@pytest.mark.parametrize("is_terminal", [True, False])
def test_the_table_is_drawn_over_itself_on_a_terminal_and_repeated_elsewhere(is_terminal, clock, capsys, monkeypatch):
    monkeypatch.setattr(live_table.sys.stderr, "isatty", lambda: is_terminal, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "20")
    display = LiveDisplay(lambda: {"now": f"{clock[0]:g}", "wide": 30 * "x"})
    for step_s in (0.0, 0.1, REDRAW_S if is_terminal else REPEAT_S):
        clock[0] += step_s
        display.update()
    display.clear()
    now_s = [f"{at_s:g}" for at_s in (100.0, clock[0])]
    if is_terminal:  # on which nothing wraps, and nothing is left
        shown = [f"now   {at_s}\nwide  {13 * 'x'}\n" for at_s in now_s]
        assert capsys.readouterr().err == f"{shown[0]}\x1b[2F\x1b[J{shown[1]}\x1b[2F\x1b[J"
    else:
        shown = [table_text({"now": at_s, "wide": 30 * "x"}) + "\n\n" for at_s in now_s]
        assert capsys.readouterr().err == "".join(shown)
