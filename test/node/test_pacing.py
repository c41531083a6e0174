# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The rhythm of a recording, on a clock that the tests hold in their hands."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vigg_ros.node.player import pacing
from vigg_ros.node.player.pacing import JUMP_NS, Pace, Timeline

SECOND_NS = 1_000_000_000


class FakeClock:
    """Time passes by sleeping, and by ``work``."""

    def __init__(self) -> None:
        self.now_ns = 17 * SECOND_NS
        self.longest_sleep_s = 0.0

    def monotonic_ns(self) -> int:
        return self.now_ns

    def sleep(self, seconds: float) -> None:
        self.longest_sleep_s = max(self.longest_sleep_s, seconds)
        self.now_ns += max(1, round(seconds * SECOND_NS))

    def work(self, seconds: float) -> None:
        self.now_ns += round(seconds * SECOND_NS)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> FakeClock:
    clock = FakeClock()
    monkeypatch.setattr(pacing, "time", clock)
    return clock


def test_positions_count_from_the_first_message() -> None:
    timeline = Timeline()
    assert [timeline.advance(1000 + step) for step in (0, 5, 5, 30)] == [0, 5, 5, 30]


def test_small_disorder_delays_nothing() -> None:
    timeline = Timeline()
    assert [timeline.advance(time_ns) for time_ns in (100, 300, 200, 400)] == [0, 200, 200, 300]


def test_after_a_jump_back_the_recording_goes_on_where_it_was() -> None:
    timeline = Timeline()
    times = [5 * SECOND_NS, 7 * SECOND_NS, 5 * SECOND_NS, 6 * SECOND_NS]
    assert [timeline.advance(time_ns) for time_ns in times] == [0, 2 * SECOND_NS, 2 * SECOND_NS, 3 * SECOND_NS]


@given(st.lists(st.integers(-(2**62), 2**62), min_size=1, max_size=30))
def test_positions_never_go_back(times: list[int]) -> None:
    timeline = Timeline()
    positions = [timeline.advance(time_ns) for time_ns in times]
    assert positions == sorted(positions)
    assert positions[0] == 0


@given(st.lists(st.integers(0, JUMP_NS - 1), min_size=2, max_size=30))
def test_within_a_second_the_order_of_arrival_does_not_change_the_end(times: list[int]) -> None:
    timeline = Timeline()
    timeline.advance(0)
    for time_ns in times:
        timeline.advance(time_ns)
    assert timeline.position_ns == max(times)


@pytest.mark.parametrize("rate", [0.25, 1.0, 4.0])
def test_the_first_message_is_due_at_once_and_the_others_by_the_rate(clock: FakeClock, rate: float) -> None:
    start_ns = clock.now_ns
    pace = Pace(rate)
    pace.wait(3 * SECOND_NS)
    assert clock.now_ns == start_ns
    pace.wait(5 * SECOND_NS)
    assert clock.now_ns - start_ns == pytest.approx(2 * SECOND_NS / rate, abs=2)
    assert pace.late_s == 0.0


def test_a_delay_is_made_up_for_and_remembered(clock: FakeClock) -> None:
    start_ns = clock.now_ns
    pace = Pace(1.0)
    pace.wait(0)
    clock.work(1.5)
    pace.wait(SECOND_NS)
    assert clock.now_ns - start_ns == 1.5 * SECOND_NS
    pace.wait(3 * SECOND_NS)
    assert clock.now_ns - start_ns == pytest.approx(3 * SECOND_NS, abs=2)
    assert pace.late_s == pytest.approx(0.5)


def test_ticks_tell_the_position_at_100_hz_while_waiting(clock: FakeClock) -> None:
    ticks: list[int] = []
    pace = Pace(2.0, tick=ticks.append)
    pace.wait(0)
    pace.wait(SECOND_NS)
    # Half a second at 100 Hz; each tick is 20 ms of the recording further.
    assert len(ticks) == pytest.approx(50, abs=1)
    steps = {later - earlier for earlier, later in itertools.pairwise(ticks)}
    assert all(step == pytest.approx(20_000_000, rel=0.01) for step in steps)
    assert clock.longest_sleep_s <= pacing.TICK_S
