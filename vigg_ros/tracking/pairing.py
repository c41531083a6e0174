# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pairs of messages of two topics by their stamps: as many as possible, then as near as possible."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from typing import Any, Generic, TypeVar

from vigg_ros.registration.errors import DataError
from vigg_ros.registration.options import PairingConfig
from vigg_ros.sensors.header import NS_PER_S, RESTART_STEP_NS

END_NS = 1 << 63  # later than every stamp

_A = TypeVar("_A")
_B = TypeVar("_B")


@dataclass(frozen=True, slots=True)
class SyncedPair(Generic[_A, _B]):
    """A message with its partner, or None; ``loop`` counts how often their topics have started again."""

    first: _A
    second: _B | None
    loop: int


def assign(first_ns: Sequence[int], second_ns: Sequence[int], slop_ns: int) -> list[int | None]:
    """For each first stamp the index of its partner among the second ones, or None.

    The largest one-to-one assignment that keeps the order, with partners at most the slop apart (inclusive).
    Of the largest it is the one with the least sum of distances; of those the first in lexicographic order of
    the pairs. Both sequences ascend.
    """
    # Row i of the dynamic programme holds, for each count j of second stamps from `start` on, the best assignment
    # of the first i and those j: its number of pairs, minus its sum of distances, and its pairs as a linked list.
    row: list[tuple[int, int, Any]] = [(0, 0, None)]
    start = 0
    for i, stamp_ns in enumerate(first_ns):
        low, high = bisect_left(second_ns, stamp_ns - slop_ns), bisect_right(second_ns, stamp_ns + slop_ns)
        # Beyond its end a row goes on with its last value.
        above = [row[min(j - start, len(row) - 1)] for j in range(low, high + 1)]
        row, start = above[:1], low
        for j in range(low, high):
            count, nearness, pairs = above[j - low]
            paired = (count + 1, nearness - abs(second_ns[j] - stamp_ns), (pairs, i, j))
            # max() takes the first of equals: that is the tie-break.
            row.append(max(above[j - low + 1], row[-1], paired, key=lambda best: best[:2]))
    partners: list[int | None] = [None] * len(first_ns)
    pairs = row[-1][2]
    while pairs is not None:
        pairs, i, j = pairs
        partners[i] = j
    return partners


@dataclass(slots=True)
class _Queue(Generic[_A]):
    """Messages of one topic in one loop that may still be paired; stamps ascend."""

    stamps: list[int] = field(default_factory=list)
    items: list[_A] = field(default_factory=list)
    passed_ns: int = -END_NS
    """All that is still to arrive has a later stamp."""

    def append(self, stamp_ns: int, item: _A) -> None:
        self.stamps.append(stamp_ns)
        self.items.append(item)
        self.passed_ns = stamp_ns

    def drop(self, count: int) -> None:
        del self.stamps[:count], self.items[:count]

    def most_to_come(self, others_ns: Sequence[int]) -> list[int]:
        """Of the stamps that may still arrive, those that compete most for the others: equal ones, or the soonest."""
        soonest = range(self.passed_ns + 1, self.passed_ns + 1 + len(others_ns))
        return sorted({*soonest, *others_ns[bisect_right(others_ns, self.passed_ns) :]})


class _Loop(Generic[_A, _B]):
    """What is not decided yet between the two topics in one loop."""

    def __init__(self, number: int, config: PairingConfig) -> None:
        self._number = number
        self._slop_ns = round(config.sync_slop_s * NS_PER_S)
        self._queue_size = config.queue_size
        self.queues: tuple[_Queue[_A], _Queue[_B]] = (_Queue(), _Queue())
        self._used: deque[tuple[int, _B]] = deque(maxlen=config.queue_size if config.reuse_depth else 0)

    def close(self) -> list[SyncedPair[_A, _B]]:
        """What is left when nothing will follow in this loop."""
        for queue in self.queues:
            queue.passed_ns = END_NS
        return self.settle()

    def settle(self) -> list[SyncedPair[_A, _B]]:
        """Everything of the first topic, in order, that is certain, or that a full queue forces."""
        first, second = self.queues
        pairs = self._decide(self._certain_partners())
        while max(len(first.stamps), len(second.stamps)) > self._queue_size:
            if first.stamps:
                pairs += self._decide([self._mutual_nearest()])
                pairs += self._decide(self._certain_partners())
            else:
                second.drop(1)
        return pairs

    def _certain_partners(self) -> list[int | None]:
        """Partners of the oldest messages of the first topic, as far as nothing that may arrive can change them.

        A message that arrives moves partners one way only: on the first topic towards earlier ones, on the second
        towards later ones. What the two extremes agree on therefore holds for all that lies between them.
        """
        first, second = self.queues
        if not first.stamps or second.passed_ns < first.stamps[0]:
            return []  # an equal stamp may come
        earliest = assign([*first.stamps, *first.most_to_come(second.stamps)], second.stamps, self._slop_ns)
        latest = assign(first.stamps, [*second.stamps, *second.most_to_come(first.stamps)], self._slop_ns)
        agreed = takewhile(lambda both: both[0] == both[1], zip(earliest, latest, strict=False))
        return [partner for partner, _ in agreed]

    def _mutual_nearest(self) -> int | None:
        """Partner of the oldest message of the first topic, which has to be decided before it is certain.

        Where each message could have either neighbour, giving one up for the nearer pairs ends the wait of the rest.
        """
        first_ns, second_ns = (queue.stamps for queue in self.queues)
        nearest = assign(first_ns[:1], second_ns, self._slop_ns)[0]
        mutual = nearest is not None and assign(first_ns[:2], [second_ns[nearest]], self._slop_ns)[0] == 0
        return nearest if mutual else None

    def _decide(self, partners: Sequence[int | None]) -> list[SyncedPair[_A, _B]]:
        """Decide on the oldest messages of the first topic; drop what no message of it to come can be paired with."""
        first, second = self.queues
        pairs = [self._pair(i, partner) for i, partner in enumerate(partners)]
        taken = 1 + max((partner for partner in partners if partner is not None), default=-1)
        self._used.extend(zip(second.stamps[:taken], second.items[:taken], strict=True))
        first.drop(len(partners))
        second.drop(taken)
        oldest_ns = first.stamps[0] if first.stamps else first.passed_ns
        second.drop(bisect_left(second.stamps, oldest_ns - self._slop_ns))
        return pairs

    def _pair(self, i: int, partner: int | None) -> SyncedPair[_A, _B]:
        first, second = self.queues
        items = second.items
        if partner is None and self._used.maxlen:
            known = [*self._used, *zip(second.stamps, items, strict=True)]
            partner = assign(first.stamps[i : i + 1], [stamp_ns for stamp_ns, _ in known], self._slop_ns)[0]
            items = [item for _, item in known]
        return SyncedPair(first.items[i], None if partner is None else items[partner], self._number)


class Pairing(Generic[_A, _B]):
    """Pairs messages of two topics as ``assign`` would pair the whole recording, whatever the order of arrival.

    A pair is given out as soon as nothing that may still arrive can change it. Within one topic stamps must
    ascend. At most ``queue_size`` messages wait on each side; what overflows is decided by mutual nearest stamps.
    """

    def __init__(self, config: PairingConfig) -> None:
        self._config = config
        self._loops: dict[int, _Loop[_A, _B]] = {0: _Loop(0, config)}
        self._loop = [0, 0]
        self._last_ns: list[int | None] = [None, None]
        self._ended_ns: list[int | None] = [None, None]

    def add_first(self, stamp_ns: int, item: _A) -> list[SyncedPair[_A, _B]]:
        """A message of the first topic. Raises DataError for a duplicate or late stamp."""
        return self._add(0, stamp_ns, item)

    def add_second(self, stamp_ns: int, item: _B) -> list[SyncedPair[_A, _B]]:
        """A message of the second topic. Raises DataError for a duplicate or late stamp."""
        return self._add(1, stamp_ns, item)

    def flush(self) -> list[SyncedPair[_A, _B]]:
        """What is left when nothing will follow."""
        return [pair for _, loop in sorted(self._loops.items()) for pair in loop.close()]

    def _add(self, side: int, stamp_ns: int, item: Any) -> list[SyncedPair[_A, _B]]:
        if self._starts_again(side, stamp_ns):
            self._advance(side, self._loop[side] + 1)
            # A topic that is silent, or did not start again, must not hold back every loop of the other.
            self._advance(1 - side, self._loop[side] - 1)
        elif self._is_left_behind(side, stamp_ns):
            self._advance(side, self._loop[1 - side])
        self._last_ns[side] = stamp_ns
        ended = sorted(number for number in self._loops if number < min(self._loop))
        pairs = [pair for number in ended for pair in self._loops.pop(number).close()]
        loop = self._loops[self._loop[side]]
        loop.queues[side].append(stamp_ns, item)
        return pairs + loop.settle()

    def _starts_again(self, side: int, stamp_ns: int) -> bool:
        last_ns = self._last_ns[side]
        if last_ns is None or stamp_ns > last_ns:
            return False
        if last_ns - stamp_ns >= RESTART_STEP_NS:
            return True
        code = "STAMP_DUPLICATE" if stamp_ns == last_ns else "STAMP_LATE"
        raise DataError(
            code,
            found=f"stamp {stamp_ns} ns after {last_ns} ns",
            expected="stamps that ascend within a topic",
            remedy="look for a second publisher on the topic, or a clock that is being adjusted",
        )

    def _advance(self, side: int, loop: int) -> None:
        if loop > self._loop[side]:
            self._loops[self._loop[side]].queues[side].passed_ns = END_NS
            self._ended_ns[side] = self._last_ns[side]
            self._loop[side] = loop
            self._loops.setdefault(loop, _Loop(loop, self._config))

    def _is_left_behind(self, side: int, stamp_ns: int) -> bool:
        """Whether the other topic has started again and this one goes on: after one stray stamp, or a restart.

        The rest of a recording in a loop lies near the end of the other topic's last loop; the stamps of a
        topic that goes on lie near those that the other one has now.
        """
        now_ns, ended_ns = self._last_ns[1 - side], self._ended_ns[1 - side]
        if self._loop[1 - side] <= self._loop[side] or now_ns is None or ended_ns is None:
            return False
        return abs(stamp_ns - now_ns) < abs(stamp_ns - ended_ns)
