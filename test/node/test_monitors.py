# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Counters: gaps of stamps, offsets, rates, latencies, throttled lines."""

import numpy as np
import pytest

from vigg_ros.node.input_monitor import InputMonitor, StampGaps, offset_s
from vigg_ros.node.rates import Latencies, Rate, RateLimit, Throttle

PERIOD_NS = 33_333_333


@pytest.mark.parametrize(
    ("kept", "missing", "expected"),
    [
        (range(51), 0, 50),
        ([n for n in range(51) if n % 5 != 3], 10, 50),
        ([n for n in range(51) if n % 5 in (0, 1)], 30, 50),
        (range(5), 0, 0),
    ],
)
def test_missing_stamps_of_a_regular_topic_are_counted(kept, missing, expected):
    gaps = StampGaps()
    rng = np.random.default_rng(0)
    for number in kept:
        gaps.add(number * PERIOD_NS + int(rng.integers(-2_000_000, 2_000_000)))
    assert gaps.recent() == (missing, expected)


def test_a_topic_without_a_period_misses_nothing():
    gaps, rng = StampGaps(), np.random.default_rng(3)
    for stamp_ns in np.cumsum(rng.integers(10_000_000, 90_000_000, 100)).tolist():
        gaps.add(stamp_ns)
    assert gaps.recent() == (0, 0)


def test_a_loop_or_a_pause_is_no_gap():
    gaps = StampGaps()
    for number in (*range(20), *range(20), *range(200, 220)):
        gaps.add(number * PERIOD_NS)
    assert gaps.recent()[0] == 0


def test_the_offset_between_two_topics_is_measured():
    leader, follower = InputMonitor(), InputMonitor()
    assert offset_s(leader, follower) is None
    for number in range(30):
        leader.accept(number * PERIOD_NS)
        follower.accept(number * PERIOD_NS + 7_000_000)
    assert offset_s(leader, follower) == pytest.approx(0.007)
    assert offset_s(follower, leader) == pytest.approx(-0.007)


def test_a_monitor_forgets_a_refusal_when_the_next_message_is_good():
    monitor = InputMonitor()
    monitor.arrive(10.0)
    monitor.refuse("STAMP_ZERO", "found stamp 0")
    assert monitor.last_refusal == "found stamp 0 (STAMP_ZERO)"
    assert monitor.age_s(12.5) == 2.5
    monitor.accept(5)
    assert monitor.last_refusal == ""
    assert monitor.refused == {"STAMP_ZERO": 1}


@pytest.mark.parametrize(("limit_hz", "passed"), [(0.0, 300), (20.0, 200), (15.0, 150), (10.0, 100), (1.0, 10)])
def test_a_rate_limit_goes_by_stamps(limit_hz, passed):
    limit = RateLimit(limit_hz)
    rng = np.random.default_rng(1)
    stamps = [number * PERIOD_NS + int(rng.integers(-1_000_000, 1_000_000)) for number in range(300)]
    # Ten seconds; the first frame passes at once, and so does the one before the end, which is a little early.
    assert passed <= sum(limit.allows(stamp, 0) for stamp in stamps) <= passed + 1


def test_a_higher_rate_holds_from_the_next_frame_on():
    limit = RateLimit(0.02)
    assert limit.allows(0, 0)
    assert not limit.allows(10**9, 0)
    limit.max_rate_hz = 30.0
    assert limit.allows(10**9 + PERIOD_NS, 0)
    assert limit.allows(10**9 + 2 * PERIOD_NS, 0)
    assert not limit.allows(10**9 + 2 * PERIOD_NS + PERIOD_NS // 2, 0)
    assert limit.allows(10**9 + 2 * PERIOD_NS + PERIOD_NS // 2, 1), "the first frame of a session always passes"


def test_a_rate_is_that_of_the_last_seconds():
    rate = Rate(window_s=5.0)
    for number in range(101):
        rate.count(number * 0.1)
    assert rate.hz(10.0) == pytest.approx(10.0, rel=0.02)
    assert rate.hz(100.0) == 0.0


def test_latencies_are_summed_up_by_stage():
    latencies = Latencies()
    for ms in range(1, 101):
        latencies.add({"total": float(ms)} | ({"refinement": 1.0} if ms > 50 else {}))
    assert latencies.summary() == {"total": (50.5, pytest.approx(95.05)), "refinement": (1.0, 1.0)}


def test_equal_lines_are_held_back_and_counted():
    throttle = Throttle(10.0)
    assert [throttle.due("a", now_s) for now_s in (0.0, 1.0, 9.9, 10.0, 10.1)] == [0, None, None, 2, None]
    assert throttle.due("b", 1.0) == 0


def test_the_memory_of_a_throttle_is_bounded():
    throttle = Throttle(10.0, capacity=3)
    for number in range(1000):
        throttle.due(f"key {number}", 0.0)
    assert throttle.due("key 999", 1.0) is None
    assert throttle.due("key 0", 1.0) == 0
