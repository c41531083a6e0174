# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pairs of stamps against the definition: mutual nearest within an inclusive slop, in any order of arrival."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vigg_ros.registration import DataError
from vigg_ros.tracking.pairing import Pair, Pairing, Unpaired

SLOP = 20
FIRST, SECOND = 0, 1
Arrival = tuple[int, int]
"""Topic and stamp."""
MS = 1_000_000
START_NS = 1_772_013_245_123_456_789


def run(arrivals: Iterable[Arrival], *, slop: int = SLOP, queue: int = 100, flush: bool = True) -> list[object]:
    """What comes out; every item is its own stamp."""
    pairing: Pairing[int, int] = Pairing(slop, queue)
    done: list[object] = []
    for topic, stamp in arrivals:
        done += (pairing.add_first, pairing.add_second)[topic](stamp, stamp)
    return done + (pairing.flush() if flush else [])


def pairs(done: Iterable[object], loop: int | None = None) -> list[tuple[int, int]]:
    return [(d.first, d.second) for d in done if isinstance(d, Pair) and loop in (None, d.loop)]


def unpaired(done: Iterable[object]) -> list[int]:
    return [d.first for d in done if isinstance(d, Unpaired)]


def by_definition(first: list[int], second: list[int], slop: int) -> list[tuple[int, int]]:
    """Each stamp's nearest of the other topic, of two the earlier; both must choose each other."""

    def nearest(stamp: int, others: list[int]) -> int:
        return min(others, key=lambda other: (abs(other - stamp), other))

    return [
        (a, nearest(a, second))
        for a in first
        if second and abs(nearest(a, second) - a) <= slop and nearest(nearest(a, second), first) == a
    ]


def test_equal_stamps_pair_at_once() -> None:
    done = run([(FIRST, 100), (SECOND, 100)], flush=False)
    assert pairs(done) == [(100, 100)]
    assert done[0].loop == 0  # type: ignore[attr-defined]


@pytest.mark.parametrize(("gap", "paired"), [(SLOP - 1, True), (SLOP, True), (SLOP + 1, False)])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("order", [(FIRST, SECOND), (SECOND, FIRST)])
def test_the_slop_is_inclusive(gap: int, paired: bool, sign: int, order: tuple[int, int]) -> None:
    stamps = {FIRST: START_NS, SECOND: START_NS + sign * gap}
    done = run([(topic, stamps[topic]) for topic in order])
    assert pairs(done) == ([(START_NS, START_NS + sign * gap)] if paired else [])
    assert unpaired(done) == ([] if paired else [START_NS])


def test_a_slop_of_zero_takes_equal_stamps_only() -> None:
    done = run([(FIRST, 1), (SECOND, 2), (FIRST, 3), (SECOND, 3)], slop=0)
    assert pairs(done) == [(3, 3)]
    assert unpaired(done) == [1]


def test_the_nearest_is_mutual() -> None:
    """10 and 25 both want 22, which wants 25."""
    done = run([(FIRST, 10), (SECOND, 22), (FIRST, 25), (SECOND, 60), (FIRST, 60)])
    assert pairs(done) == [(25, 22), (60, 60)]
    assert unpaired(done) == [10]


def test_of_two_equally_near_the_earlier_is_taken() -> None:
    assert pairs(run([(FIRST, 10), (SECOND, 5), (SECOND, 15)])) == [(10, 5)]
    assert pairs(run([(FIRST, 5), (FIRST, 15), (SECOND, 10)])) == [(5, 10)]


def test_a_pair_waits_until_nothing_nearer_can_come() -> None:
    pairing: Pairing[int, int] = Pairing(SLOP, 100)
    assert pairing.add_first(100, 100) == []
    assert pairing.add_second(110, 110) == []
    # 110 could still find a nearer first at up to 120; the first topic must get there.
    assert pairing.add_first(119, 119) == []
    assert pairing.add_second(131, 131) == []
    assert pairing.add_first(128, 128) == [Unpaired(100, 0), Pair(119, 110, 0)]


stamps = st.lists(st.integers(0, 200), unique=True, max_size=14).map(sorted)


@st.composite
def interleavings(draw: st.DrawFn) -> tuple[list[int], list[int], list[list[Arrival]]]:
    """Two topics, and a few orders of arrival that keep each topic's own order."""
    first, second = draw(stamps), draw(stamps)
    orders = []
    for _ in range(3):
        topics = draw(st.permutations([FIRST] * len(first) + [SECOND] * len(second)))
        left = {FIRST: iter(first), SECOND: iter(second)}
        orders.append([(topic, next(left[topic])) for topic in topics])
    return first, second, orders


@given(interleavings(), st.sampled_from([0, 1, 5, 20]))
def test_the_order_of_arrival_does_not_matter(
    drawn: tuple[list[int], list[int], list[list[Arrival]]], slop: int
) -> None:
    first, second, orders = drawn
    expected = by_definition(first, second, slop)
    for order in orders:
        done = run(order, slop=slop)
        assert pairs(done) == expected
        # Everything of the first topic comes out once, in order.
        assert [d.first for d in done] == first  # type: ignore[attr-defined]


@given(interleavings())
def test_what_is_given_early_is_what_would_be_given_late(
    drawn: tuple[list[int], list[int], list[list[Arrival]]],
) -> None:
    """Before the flush there is nothing that a message still to come could have changed."""
    first, second, (order, *_) = drawn
    for cut in range(len(order) + 1):
        early = run(order[:cut], flush=False)
        assert set(pairs(early)) <= set(by_definition(first, second, SLOP))


def test_nothing_is_paired_twice_when_the_queue_overflows() -> None:
    """With a queue of 2 and a slop wider than many periods decisions are forced; a depth is still used once."""
    for seed in range(200):
        rng = np.random.default_rng(seed)
        topics = rng.integers(0, 2, 60)
        now, arrivals = [0, 0], []
        for topic in topics.tolist():
            now[topic] += int(rng.integers(1, 9))
            arrivals.append((topic, now[topic]))
        done = run(arrivals, slop=30, queue=2)
        used = [second for _, second in pairs(done)]
        assert len(set(used)) == len(used)
        assert [d.first for d in done] == [stamp for topic, stamp in arrivals if topic == FIRST]  # type: ignore[attr-defined]


@pytest.mark.hostile("Stamps: duplicate R")
@pytest.mark.parametrize("topic", [FIRST, SECOND])
def test_a_duplicate_is_refused_and_changes_nothing(topic: int) -> None:
    pairing: Pairing[int, int] = Pairing(SLOP * MS, 10)
    add = (pairing.add_first, pairing.add_second)
    add[topic](START_NS, 1)
    with pytest.raises(DataError, match="expected stamps that ascend") as caught:
        add[topic](START_NS, 2)
    assert caught.value.code == "STAMP_DUPLICATE"
    assert str(START_NS) in str(caught.value)
    add[1 - topic](START_NS + MS, 3)
    expected = Pair(1, 3, 0) if topic == FIRST else Pair(3, 1, 0)
    assert pairing.flush() == [expected]


BACK_ROW = pytest.mark.hostile("Stamps: back by less than 1 s R, by more: reset")


@BACK_ROW
@pytest.mark.parametrize("back_ns", [1, 33 * MS, 1_000_000_000 - 1])
def test_a_late_stamp_is_refused(back_ns: int) -> None:
    pairing: Pairing[int, int] = Pairing(SLOP * MS, 10)
    pairing.add_first(START_NS, 1)
    with pytest.raises(DataError) as caught:
        pairing.add_first(START_NS - back_ns, 2)
    assert caught.value.code == "STAMP_LATE"
    assert pairing.add_first(START_NS + 1, 3) == []


@BACK_ROW
def test_from_a_second_on_it_is_a_new_loop() -> None:
    pairing: Pairing[int, int] = Pairing(SLOP * MS, 10)
    pairing.add_first(START_NS, 1)
    pairing.add_second(START_NS, 2)
    pairing.add_first(START_NS - 1_000_000_000, 3)
    assert pairing.add_second(START_NS - 1_000_000_000, 4) == [Pair(3, 4, 1)]


def recording(seconds: float = 3.0) -> list[Arrival]:
    """Colour at 10 Hz, depth up to 30 ms beside it, a tenth of it missing; as they arrive."""
    rng = np.random.default_rng(0)
    arrivals = []
    for k in range(int(seconds * 10)):
        stamp = START_NS + k * 100 * MS
        arrivals.append((stamp, FIRST, stamp))
        if rng.random() < 0.9:
            other = stamp + int(rng.integers(-30, 31)) * MS
            arrivals.append((other, SECOND, other))
    return [(topic, stamp) for _, topic, stamp in sorted(arrivals)]


@pytest.mark.hostile("System: bag loop three times: the same result each time")
@pytest.mark.parametrize("lag_ms", [0, 300, 1200])
@pytest.mark.parametrize("late", [FIRST, SECOND])
def test_a_bag_in_a_loop_gives_the_same_pairs_each_time(lag_ms: int, late: int) -> None:
    """Also when one topic is late by up to 1.2 s, so that it is still in the last loop when the other starts."""
    once = recording()
    length_ns = 3_100 * MS
    arrivals = [
        (stamp + loop * length_ns + (lag_ms * MS if topic == late else 0), topic, stamp)
        for loop in range(3)
        for topic, stamp in once
    ]
    done = run([(topic, stamp) for _, topic, stamp in sorted(arrivals)], slop=SLOP * MS)
    expected = pairs(run(once, slop=SLOP * MS))
    assert 10 < len(expected) < 30
    for loop in range(3):
        assert pairs(done, loop) == expected
    assert sorted({d.loop for d in done}) == [0, 1, 2]  # type: ignore[attr-defined]
    assert len(done) == 3 * sum(topic == FIRST for topic, _ in once)


@pytest.mark.hostile("Stamps: long forward gap A")
def test_a_long_forward_gap_is_no_new_loop() -> None:
    year_ns = 365 * 24 * 3600 * 10**9
    stamps = [START_NS + shift + k * 33 * MS for shift in (0, year_ns) for k in range(5)]
    arrivals = [(topic, stamp) for stamp in stamps for topic in (FIRST, SECOND)]
    done = run(arrivals, slop=SLOP * MS)
    assert len(pairs(done, loop=0)) == 10
    assert unpaired(done) == []


@pytest.mark.parametrize("stray", [10**12, -(10**10)], ids=["from the future", "from the past"])
@pytest.mark.parametrize("topic", [FIRST, SECOND])
def test_one_stray_stamp_costs_a_few_frames_and_no_more(stray: int, topic: int) -> None:
    arrivals = []
    for k in range(200):
        for t in (FIRST, SECOND):
            arrivals.append((t, START_NS + k * 33 * MS + (stray if (k, t) == (50, topic) else 0)))
    done = run(arrivals, slop=SLOP * MS)
    assert len(pairs(done)) >= 196
    assert pairs(done)[-1] == (START_NS + 199 * 33 * MS,) * 2


def test_a_topic_that_starts_late_joins_the_loop_that_is_on() -> None:
    """Depth comes up when the bag is in its second round."""
    colour = [(FIRST, START_NS + k * 100 * MS) for _ in range(2) for k in range(20)]
    both = [(t, START_NS + k * 100 * MS) for k in range(20, 40) for t in (FIRST, SECOND)]
    assert len(pairs(run(colour + both, slop=SLOP * MS))) >= 19



@pytest.mark.hostile("System: burst of 1,000 frames: memory flat")
@pytest.mark.parametrize("case", ["second silent", "first silent", "both", "never near", "second silent, looping"])
def test_memory_is_bounded(case: str) -> None:
    """Items of 10 kB; a queue of 20 holds 0.4 MB of them, 3,000 of them would be 30 MB."""
    pairing: Pairing[bytes, bytes] = Pairing(SLOP * MS, 20)
    tracemalloc.start()
    try:
        for k in range(3000):
            stamp = START_NS + (k % 100 if "looping" in case else k) * 33 * MS
            if case != "first silent":
                pairing.add_first(stamp, bytes(10_000))
            if case in ("first silent", "both"):
                pairing.add_second(stamp, bytes(10_000))
            if case == "never near":
                pairing.add_second(stamp + 10**9 * 3600, bytes(10_000))
        kept = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    # Both sides of two loops at most.
    assert kept < 4 * 21 * 10_000 + 100_000


def test_with_one_topic_silent_what_overflows_is_told_unpaired_at_once() -> None:
    """The newest may still find a partner; the oldest are given up, in order."""
    done = run([(FIRST, START_NS + k * 33 * MS) for k in range(50)], queue=20, slop=SLOP * MS, flush=False)
    assert unpaired(done) == [START_NS + k * 33 * MS for k in range(30)]


def test_flush_gives_everything_once() -> None:
    pairing: Pairing[int, int] = Pairing(SLOP, 10)
    assert pairing.add_second(12, 12) == pairing.add_first(1, 1) == []
    assert pairing.add_first(90, 90) == [Pair(1, 12, 0)]
    assert pairing.flush() == [Unpaired(90, 0)]
    assert pairing.flush() == []
    pairing = Pairing(SLOP, 10)
    assert pairing.add_second(12, 12) == pairing.add_first(1, 1) == []
    assert pairing.flush() == [Pair(1, 12, 0)]
    assert Pairing(SLOP, 10).flush() == []
