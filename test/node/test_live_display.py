# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is shown while a node runs and at its end, from counts made by hand."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from vigg_ros.node.player import live_display
from vigg_ros.node.player.live_display import LINE_S, REDRAW_S, LiveDisplay, cpu_percent
from vigg_ros.node.player.live_summary import Run, advice_on_drops, summary_table
from vigg_ros.node.player.node_process import Usage
from vigg_ros.node.player.scoreboard import Score

SCORE = Score(
    state="LOST LOW_OVERLAP",
    sent=50,
    answered=40,
    unanswered=Counter({"DROPPED NEWER_FRAME": 7, "LOST LOW_OVERLAP": 2}),
    silent=1,
    rate_hz=12.34,
    recent_latency_ms=81.6,
    latencies_ms=np.arange(1.0, 42.0),
    errors_m=np.array([0.0, 0.01, 0.03]),
)
NOTHING = Score("WAITING", 3, 0, Counter(), 3, 0.0, float("nan"), np.array([]), np.array([]))
USAGE = Usage(at_s=100.0, cpu_s=10.0, rss_mb=300.4, peak_rss_mb=310.0)
RUN = Run("room", "colour image", SCORE, 4.9, True, USAGE, Usage(105.0, 17.5, 320.0, 400.2), 0)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [100.0]
    monkeypatch.setattr(live_display.time, "monotonic", lambda: now[0])
    return now


def test_without_a_terminal_there_is_a_line_every_five_seconds(
    clock: list[float], capsys: pytest.CaptureFixture[str]
) -> None:
    usages = [USAGE, replace(USAGE, at_s=105.0, cpu_s=17.5)]
    display = LiveDisplay(lambda: (SCORE, usages[int(clock[0] > 104)]), start_s=100.0)
    for now_s in np.arange(100.0, 109.0, 0.5):
        clock[0] = now_s
        display.update()
    (line,) = capsys.readouterr().err.splitlines()
    assert line == (
        f"{LINE_S:.0f} s: LOST LOW_OVERLAP; poses 40 of 50, rate 12.3 Hz, latency 82 ms, dropped 7, error 3.0 cm, "
        "CPU 150 %, memory 300 MB"
    )


def test_on_a_terminal_a_table_is_drawn_over_itself_and_never_wraps(
    clock: list[float], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_display.sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "60")
    display = LiveDisplay(lambda: (SCORE, None), start_s=100.0)
    display.update()
    clock[0] += REDRAW_S / 2
    display.update()
    clock[0] += REDRAW_S
    display.update()
    first, second = capsys.readouterr().err.split("\x1b[2A\r")
    rows = [row.removeprefix("\x1b[2K") for row in second.splitlines()]
    assert first.splitlines()[0] == second.splitlines()[0]
    assert rows[0].split() == ["time", "state", "poses", "rate", "latency", "dropped", "erro"]
    assert rows[1].startswith("0 s   LOST LOW_OVE 40 of 50    12.3 Hz 82 ms   7")
    assert max(map(len, rows)) < 60


def test_the_table_at_the_end_counts_every_frame_once() -> None:
    rows = dict(line.split("  ", 1) for line in summary_table(RUN).splitlines())
    rows = {name.strip(): text.strip() for name, text in rows.items()}
    assert rows == {
        "recording": "room",
        "frames sent": "50 in 4.9 s (10.0 Hz)",
        "poses received": "40 (80.0%)",
        "without a pose": "DROPPED NEWER_FRAME: 7, LOST LOW_OVERLAP: 2",
        "without an answer": "1 (lost on the way, without partner, or still waiting)",
        "latency": "median 21 ms, p95 39 ms, max 41 ms, from publishing the colour image to receiving its pose",
        "position error": "median 1.00 cm, max 3.00 cm, over 3 frames",
        "aligned": "at the first pose of each odometry frame: errors are those of the motion since then",
        "node": "CPU mean 150 % of one core while the bag played, memory at most 400 MB, exit code 0",
    }


@pytest.mark.parametrize(
    ("sent", "dropped", "silent", "rate", "words"),
    [
        # 37 frames of 100 were registered, in 5 s.
        (100, 60, 3, 1.0, "registered about 7.4 frames a second here; 60 of 100 frames were dropped because newer "
         "ones came; try --rate 0.3"),
        (100, 60, 3, 0.2, "try --rate 0.07"),
        (100, 1, 0, 1.0, "try --rate 0.9"),
        (100, 40, 0, 4.0, "try --rate 2"),
        (100, 40, 0, 0.5, "try --rate 0.3"),
        (3, 3, 0, 1.0, "3 of 3 frames were dropped because newer ones came"),
        (100, 0, 3, 1.0, ""),
    ],
)
def test_dropped_frames_end_in_advice(sent: int, dropped: int, silent: int, rate: float, words: str) -> None:
    drops = Counter({"DROPPED NEWER_FRAME": dropped}) if dropped else Counter()
    run = replace(RUN, score=replace(SCORE, sent=sent, unanswered=drops, silent=silent), played_s=5.0)
    advice = advice_on_drops(run, rate)
    assert advice.endswith(words)
    assert bool(advice) == bool(words)


@pytest.mark.parametrize(
    ("has_truth", "words"), [(True, "no answered frame has a true pose"), (False, "no ground truth to compare with")]
)
def test_what_is_not_known_is_said_to_be_so(has_truth: bool, words: str) -> None:
    table = summary_table(replace(RUN, score=NOTHING, has_truth=has_truth, at_start=None, at_end=None, exit_code=-9))
    assert f"position error     {words}" in table
    assert "latency            -" in table
    assert table.splitlines()[-1] == "node               exit code -9"


def test_cpu_between_measurements_of_one_moment_is_not_known() -> None:
    assert np.isnan(cpu_percent(USAGE, USAGE))
