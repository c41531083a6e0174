# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pairs of stamps: mutual nearest, within an inclusive slop, whatever the order in which the topics arrive."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.header import RESTART_STEP_NS

_A = TypeVar("_A")
_B = TypeVar("_B")


@dataclass(frozen=True, slots=True)
class Pair(Generic[_A, _B]):
    """Two messages of the same moment; ``loop`` counts how often their topics have started again."""

    first: _A
    second: _B
    loop: int


@dataclass(frozen=True, slots=True)
class Unpaired(Generic[_A]):
    """A message of the first topic for which there is no partner."""

    first: _A
    loop: int


@dataclass(slots=True)
class _Side:
    """One topic in one loop: ascending stamps, what came with them, and which are settled."""

    stamps: list[int] = field(default_factory=list)
    items: list[object] = field(default_factory=list)
    settled: list[bool] = field(default_factory=list)
    closed: bool = False
    """No message of this loop will follow."""

    def nearest(self, stamp_ns: int) -> int | None:
        """Place of the stamp nearest to the given one; of two equally near the earlier."""
        place = bisect_left(self.stamps, stamp_ns)
        near = [i for i in (place - 1, place) if 0 <= i < len(self.stamps)]
        return min(near, key=lambda i: (abs(self.stamps[i] - stamp_ns), i), default=None)

    def has_seen(self, stamp_ns: int) -> bool:
        """Whether everything up to this stamp has arrived."""
        return self.closed or (bool(self.stamps) and self.stamps[-1] >= stamp_ns)

    def undecided(self) -> int:
        return self.settled.count(False)

    def drop_before(self, place: int) -> None:
        del self.stamps[:place], self.items[:place], self.settled[:place]


class Pairing(Generic[_A, _B]):
    """Pairs messages of two topics as soon as nothing that may still arrive can change the pair.

    Equal stamps pair at once. Otherwise a pair waits until each topic has gone past the other's stamp
    by their distance: the price of giving the same pairs in any order of arrival, online as offline.
    Within one topic stamps must ascend. At most ``queue_size`` messages wait on each side.
    """

    def __init__(self, slop_ns: int, queue_size: int) -> None:
        self._slop_ns = slop_ns
        self._queue_size = queue_size
        self._loops: dict[int, tuple[_Side, _Side]] = {0: (_Side(), _Side())}
        self._loop = [0, 0]
        self._last_ns: list[int | None] = [None, None]
        self._ended_ns: list[int | None] = [None, None]

    def add_first(self, stamp_ns: int, item: _A) -> list[Pair[_A, _B] | Unpaired[_A]]:
        """A message of the first topic. Raises DataError for a duplicate or late stamp."""
        return self._add(0, stamp_ns, item)

    def add_second(self, stamp_ns: int, item: _B) -> list[Pair[_A, _B] | Unpaired[_A]]:
        """A message of the second topic. Raises DataError for a duplicate or late stamp."""
        return self._add(1, stamp_ns, item)

    def flush(self) -> list[Pair[_A, _B] | Unpaired[_A]]:
        """What is left when nothing will follow."""
        return [done for loop in sorted(self._loops) for done in self._close(loop)]

    def _add(self, side: int, stamp_ns: int, item: object) -> list[Pair[_A, _B] | Unpaired[_A]]:
        done: list[Pair[_A, _B] | Unpaired[_A]] = []
        if self._starts_again(side, stamp_ns):
            self._advance(side, self._loop[side] + 1)
            # A topic that is silent, or did not start again, must not hold back every loop of the other.
            self._advance(1 - side, self._loop[side] - 1)
        elif self._is_left_behind(side, stamp_ns):
            self._advance(side, self._loop[1 - side])
        self._last_ns[side] = stamp_ns
        for loop in [loop for loop in sorted(self._loops) if loop < min(self._loop)]:
            done += self._close(loop)
            del self._loops[loop]
        loop = self._loop[side]
        own = self._loops[loop][side]
        own.stamps.append(stamp_ns)
        own.items.append(item)
        own.settled.append(False)
        return done + self._settle(loop)

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
            self._loops[self._loop[side]][side].closed = True
            self._ended_ns[side] = self._last_ns[side]
            self._loop[side] = loop
            self._loops.setdefault(loop, (_Side(), _Side()))

    def _is_left_behind(self, side: int, stamp_ns: int) -> bool:
        """Whether the other topic has started again and this one goes on: after one stray stamp, or a restart.

        The rest of a recording in a loop lies near the end of the other topic's last loop; the stamps of a
        topic that goes on lie near those that the other one has now.
        """
        now_ns, ended_ns = self._last_ns[1 - side], self._ended_ns[1 - side]
        if self._loop[1 - side] <= self._loop[side] or now_ns is None or ended_ns is None:
            return False
        return abs(stamp_ns - now_ns) < abs(stamp_ns - ended_ns)

    def _close(self, loop: int) -> list[Pair[_A, _B] | Unpaired[_A]]:
        for side in self._loops[loop]:
            side.closed = True
        return self._settle(loop)

    def _settle(self, loop: int) -> list[Pair[_A, _B] | Unpaired[_A]]:
        """Everything of the first topic, in order, whose fate is certain."""
        first, second = self._loops[loop]
        done: list[Pair[_A, _B] | Unpaired[_A]] = []
        for i in range(len(first.stamps)):
            if first.settled[i]:
                continue
            overflow = max(first.undecided(), len(second.stamps)) > self._queue_size
            certain, partner = self._partner(first, second, i)
            if not certain and not overflow:
                break
            first.settled[i] = True
            # Decisions that an overflow forces may differ from those before them.
            if partner is None or second.settled[partner]:
                done.append(Unpaired(first.items[i], loop))  # type: ignore[arg-type]
            else:
                second.settled[partner] = True
                done.append(Pair(first.items[i], second.items[partner], loop))  # type: ignore[arg-type]
        self._forget(first, second)
        return done

    def _partner(self, first: _Side, second: _Side, i: int) -> tuple[bool, int | None]:
        """Whether the fate of message i is certain, and its partner in the second topic, if any."""
        stamp_ns = first.stamps[i]
        j = second.nearest(stamp_ns)
        if j is None or abs(second.stamps[j] - stamp_ns) > self._slop_ns:
            return second.has_seen(stamp_ns + self._slop_ns), None
        gap_ns = abs(second.stamps[j] - stamp_ns)
        certain = second.has_seen(stamp_ns + gap_ns) and first.has_seen(second.stamps[j] + gap_ns)
        return certain, j if first.nearest(second.stamps[j]) == i else None

    def _forget(self, first: _Side, second: _Side) -> None:
        """Drop what can no longer be anybody's nearest within the slop, and what overflows the queue."""
        waiting = next((s for s, settled in zip(first.stamps, first.settled, strict=True) if not settled), None)
        edges = [s for s in (waiting, first.stamps[-1] if first.stamps else None) if s is not None]
        if edges:
            second.drop_before(bisect_left(second.stamps, min(edges) - 2 * self._slop_ns))
        kept = bisect_left(first.stamps, min([*edges, *second.stamps[:1]], default=0) - 2 * self._slop_ns)
        settled = first.settled.index(False) if False in first.settled else len(first.settled)
        first.drop_before(min(kept, settled))
        second.drop_before(len(second.stamps) - self._queue_size if len(second.stamps) > self._queue_size else 0)
