# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pairs against the definition, the largest and then the nearest assignment in order, in any order of arrival."""

import tracemalloc
from functools import cache
from itertools import combinations, takewhile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vigg_ros.registration import DataError
from vigg_ros.registration.options import PairingConfig
from vigg_ros.tracking.pairing import Pairing, SyncedPair, assign

SLOP = 20
FIRST, SECOND = 0, 1
Arrival = tuple[int, int]
"""Topic and stamp."""
Decision = tuple[int, int | None]
"""A first stamp and its partner's."""
MS = 1_000_000
START_NS = 1_772_013_245_123_456_789


def pairing(slop=SLOP, queue=100, *, reuse=False):
    return Pairing(PairingConfig(sync_slop_s=slop / 1e9, queue_size=queue, reuse_depth=reuse))


def run(arrivals, *settings, reuse=False, flush=True):
    """What comes out with this slop and size of the queue; every item is its own stamp."""
    tested = pairing(*settings, reuse=reuse)
    add = (tested.add_first, tested.add_second)
    done = [pair for topic, stamp in arrivals for pair in add[topic](stamp, stamp)]
    return done + (tested.flush() if flush else [])


def decisions(done, loop=None):
    return [(one.first, one.second) for one in done if loop in (None, one.loop)]


def pairs(done):
    return [pair for pair in decisions(done) if pair[1] is not None]


def by_definition(first, second, slop, *, reuse=False):
    """Of all assignments in order: the most pairs, then the least sum of distances, then the least list of pairs."""

    @cache
    def best(i, j):
        """Of the first i and j stamps: minus the number of pairs, the sum, and the pairs."""
        if not i or not j:
            return 0, 0, ()
        options = [best(i - 1, j), best(i, j - 1)]
        gap = abs(first[i - 1] - second[j - 1])
        if gap <= slop:
            count, total, before = best(i - 1, j - 1)
            options.append((count - 1, total + gap, (*before, (first[i - 1], second[j - 1]))))
        return min(options)

    partners = dict(best(len(first), len(second))[2])
    for stamp in first if reuse else ():
        near = [(abs(other - stamp), other) for other in second if abs(other - stamp) <= slop]
        if near:
            partners.setdefault(stamp, min(near)[1])
    return [(stamp, partners.get(stamp)) for stamp in first]


def ascending(highest, size):
    return st.lists(st.integers(0, highest), unique=True, max_size=size).map(sorted)


# So dense that each stamp has several neighbours, or so sparse that there are gaps.
two_topics = st.sampled_from([20, 60, 200]).flatmap(lambda highest: st.tuples(*[ascending(highest, 14)] * 2))
slops = st.sampled_from([0, 1, 5, SLOP])


@given(two_topics, slops)
def test_the_assignment_is_that_of_the_definition(stamps, slop):
    first, second = stamps
    partners = [None if j is None else second[j] for j in assign(first, second, slop)]
    assert list(zip(first, partners, strict=True)) == by_definition(first, second, slop)


@pytest.mark.parametrize(
    ("first", "second", "partners"),
    [
        ([10, 25], [22, 40], [0, 1]),  # as many pairs as possible, although 22 is nearer to 25
        ([10, 25], [22, 60], [None, 0]),
        ([10], [5, 15], [0]),  # of two equally near the earlier
        ([5, 15], [10], [0, None]),
        ([START_NS], [START_NS + SLOP], [0]),
        ([START_NS], [START_NS - SLOP - 1], [None]),
    ],
)
def test_the_definition_by_example(first, second, partners):
    assert assign(first, second, SLOP) == partners


@given(two_topics, slops, st.booleans(), st.data())
def test_the_order_of_arrival_does_not_matter(stamps, slop, reuse, data):
    """Online as offline; and nothing is ever given out that the rest of the recording would contradict."""
    left = [iter(topic) for topic in stamps]
    order = data.draw(st.permutations([FIRST] * len(stamps[0]) + [SECOND] * len(stamps[1])))
    arrivals = [(topic, next(left[topic])) for topic in order]
    expected = by_definition(*stamps, slop, reuse=reuse)
    assert decisions(run(arrivals, slop, reuse=reuse)) == expected
    for count in range(len(arrivals)):
        early = decisions(run(arrivals[:count], slop, reuse=reuse, flush=False))
        assert early == expected[: len(early)]


@given(ascending(5, 4), ascending(5, 4), st.integers(0, 4))
def test_a_pair_is_given_out_once_nothing_that_may_arrive_can_change_it(first, second, slop):
    """Not later: on each topic everything is tried that may still arrive up to stamp 9."""

    def continued(known):
        later = range(max(known, default=-1) + 1, 10)
        return [[*known, *more] for count in range(len(first + second) + 1) for more in combinations(later, count)]

    recordings = [(one, second) for one in continued(first)] + [(first, one) for one in continued(second)]
    outcomes = [by_definition(*recording, slop)[: len(first)] for recording in recordings]
    certain = takewhile(lambda each: len(set(each)) == 1, zip(*outcomes, strict=True))
    arrivals = [(FIRST, stamp) for stamp in first] + [(SECOND, stamp) for stamp in second]
    assert decisions(run(arrivals, slop, flush=False)) == [each[0] for each in certain]


def test_a_chain_waits_for_its_end_or_for_a_full_queue():
    """Each second stamp is within the slop of the firsts on both sides, and nearer to the later one."""
    chain = [arrival for k in range(5) for arrival in ((FIRST, 33 * k), (SECOND, 33 * k + 18))]
    assert run(chain, SLOP, 5, flush=False) == []
    assert pairs(run(chain, SLOP, 5)) == [(33 * k, 33 * k + 18) for k in range(5)]
    # One is given up, and the others need not wait for the nearer ones.
    nearer = [(33 * k, 33 * k - 15) for k in range(1, 5)]
    assert decisions(run([*chain, (FIRST, 165)], SLOP, 5, flush=False)) == [(0, None), *nearer]
    # Where it is the second topic that runs ahead, too.
    assert pairs(run([(FIRST, 0), *((SECOND, 33 * k + 5) for k in range(6))], SLOP, 5, flush=False)) == [(0, 5)]


def test_with_one_topic_silent_the_oldest_of_a_full_queue_are_told_unpaired_at_once():
    done = run([(FIRST, START_NS + k * 33 * MS) for k in range(50)], SLOP * MS, 20, flush=False)
    assert decisions(done) == [(START_NS + k * 33 * MS, None) for k in range(30)]


def test_nothing_is_paired_twice_when_the_queue_overflows():
    """With a queue of 2 and a slop wider than many periods decisions are forced; a depth is still used once."""
    for seed in range(200):
        rng = np.random.default_rng(seed)
        now, arrivals = [0, 0], []
        for topic in rng.integers(0, 2, 60).tolist():
            now[topic] += int(rng.integers(1, 9))
            arrivals.append((topic, now[topic]))
        done = run(arrivals, 30, 2)
        used = [second for _, second in pairs(done)]
        assert len(set(used)) == len(used)
        assert [one.first for one in done] == [stamp for topic, stamp in arrivals if topic == FIRST]


@pytest.mark.hostile("Stamps: duplicate R")
@pytest.mark.parametrize("topic", [FIRST, SECOND])
def test_a_duplicate_is_refused_and_changes_nothing(topic):
    tested = pairing(SLOP * MS)
    add = (tested.add_first, tested.add_second)
    add[topic](START_NS, 1)
    with pytest.raises(DataError, match="expected stamps that ascend") as caught:
        add[topic](START_NS, 2)
    assert caught.value.code == "STAMP_DUPLICATE"
    assert str(START_NS) in str(caught.value)
    add[1 - topic](START_NS + MS, 3)
    assert tested.flush() == [SyncedPair(1, 3, 0) if topic == FIRST else SyncedPair(3, 1, 0)]


BACK_ROW = pytest.mark.hostile("Stamps: back by less than 1 s R, by more: reset")


@BACK_ROW
@pytest.mark.parametrize("back_ns", [1, 1_000_000_000 - 1])
def test_a_late_stamp_is_refused(back_ns):
    tested = pairing(SLOP * MS)
    tested.add_first(START_NS, 1)
    with pytest.raises(DataError) as caught:
        tested.add_first(START_NS - back_ns, 2)
    assert caught.value.code == "STAMP_LATE"
    assert tested.add_first(START_NS + 1, 3) == []


@BACK_ROW
def test_from_a_second_on_it_is_a_new_loop():
    again = START_NS - 1_000_000_000
    done = run([(FIRST, START_NS), (SECOND, START_NS), (FIRST, again), (SECOND, again)], SLOP * MS, flush=False)
    assert done == [SyncedPair(START_NS, START_NS, 0), SyncedPair(again, again, 1)]
    # In the loop that the first topic has left nothing nearer can come.
    done = run([(FIRST, START_NS), (FIRST, again), (SECOND, START_NS + MS)], SLOP * MS, flush=False)
    assert done == [SyncedPair(START_NS, START_NS + MS, 0)]


def recording():
    """3 s of colour at 10 Hz, depth up to 30 ms beside it, a tenth of it missing; as they arrive."""
    rng = np.random.default_rng(0)
    arrivals = []
    for stamp in range(START_NS, START_NS + 3000 * MS, 100 * MS):
        arrivals.append((stamp, FIRST))
        if rng.random() < 0.9:
            arrivals.append((stamp + int(rng.integers(-30, 31)) * MS, SECOND))
    return [(topic, stamp) for stamp, topic in sorted(arrivals)]


@pytest.mark.hostile("System: bag loop three times: the same result each time")
@pytest.mark.parametrize("lag_ms", [0, 300, 1200])
@pytest.mark.parametrize("late", [FIRST, SECOND])
def test_a_bag_in_a_loop_gives_the_same_pairs_each_time(lag_ms, late):
    """Also when one topic is late by up to 1.2 s, so that it is still in the last loop when the other starts."""
    once = recording()
    arrivals = [
        (stamp + (3100 * loop + (lag_ms if topic == late else 0)) * MS, topic, stamp)
        for loop in range(3)
        for topic, stamp in once
    ]
    done = run([(topic, stamp) for _, topic, stamp in sorted(arrivals)], SLOP * MS)
    expected = run(once, SLOP * MS)
    assert 10 < len(pairs(expected)) < 30
    for loop in range(3):
        assert decisions(done, loop) == decisions(expected)
    assert len(done) == 3 * len(expected)


@pytest.mark.hostile("Stamps: long forward gap A")
def test_a_long_forward_gap_is_no_new_loop():
    year_ns = 365 * 24 * 3600 * 10**9
    stamps = [START_NS + shift + k * 33 * MS for shift in (0, year_ns) for k in range(5)]
    done = run([(topic, stamp) for stamp in stamps for topic in (FIRST, SECOND)], SLOP * MS)
    assert done == [SyncedPair(stamp, stamp, 0) for stamp in stamps]


@pytest.mark.parametrize("stray", [10**12, -(10**10)], ids=["from the future", "from the past"])
@pytest.mark.parametrize("topic", [FIRST, SECOND])
def test_one_stray_stamp_costs_a_few_frames_and_no_more(stray, topic):
    arrivals = [(t, START_NS + k * 33 * MS) for k in range(200) for t in (FIRST, SECOND)]
    arrivals[100 + topic] = (topic, arrivals[100][1] + stray)
    done = run(arrivals, SLOP * MS)
    assert len(pairs(done)) >= 196
    assert pairs(done)[-1] == (START_NS + 199 * 33 * MS,) * 2


def test_a_topic_that_starts_late_joins_the_loop_that_is_on():
    """Depth comes up when the bag is in its second round."""
    colour = [(FIRST, START_NS + k * 100 * MS) for _ in range(2) for k in range(20)]
    both = [(t, START_NS + k * 100 * MS) for k in range(20, 40) for t in (FIRST, SECOND)]
    assert len(pairs(run(colour + both, SLOP * MS))) >= 19


@pytest.mark.hostile("System: burst of 1,000 frames: memory flat")
@pytest.mark.parametrize("case", ["second silent", "first silent", "both", "never near", "second silent, looping"])
def test_memory_is_bounded(case):
    """Items of 10 kB; a queue of 20 holds 0.4 MB of them, 1,000 of them would be 10 MB."""
    tested = Pairing(PairingConfig(queue_size=20, reuse_depth=True))
    tracemalloc.start()
    try:
        for k in range(1000):
            stamp = START_NS + (k % 100 if "looping" in case else k) * 33 * MS
            if case != "first silent":
                tested.add_first(stamp, bytes(10_000))
            if case in ("first silent", "both"):
                tested.add_second(stamp, bytes(10_000))
            if case == "never near":
                tested.add_second(stamp + 10**9 * 3600, bytes(10_000))
        kept = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    # Both sides of two loops at most.
    assert kept < 4 * 21 * 10_000 + 100_000
