# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Puts recorded messages in the order of their header stamps, in bounded memory.

A recorder writes messages as they arrive, and its clock may step; what counts is when the sensors
looked. A first reading collects the stamps alone. From them follows the order and how far each message
is from its place. Nearly all are near: the second reading holds them back for a moment. The few that
are far (or all, in a shuffled bag) are first put aside in a temporary file.
"""

from __future__ import annotations

import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import IO

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.storage import Channel, RawMessage
from vigg_ros.registration.errors import BagError
from vigg_ros.sensors.header import RESTART_STEP_NS

NEAR_MESSAGES = 32
"""A message at most this many places from its place in line waits in memory, others in a file.
At most twice as many are held at a time: about 100 MB of RGB-D images."""

_LOOP_REPEATS = 4
"""So many repeated stamps in a row make a loop; fewer are duplicated messages."""

_MEMORY_BYTES = 2**26
"""Messages put aside take this much memory before they go to the disk."""

_BAG_CHANGED = "the bag changed while it was read; wait until it is complete and read it again"

Reading = Callable[[], Iterator[RawMessage]]
"""Starts one reading of the same messages in the same recorded order."""


@dataclass(frozen=True, slots=True)
class StampEntry:
    """One recorded message without its content."""

    topic: str
    log_ns: int
    stamp_ns: int | None
    """None for a type without a header."""


def in_stamp_order(entries: Sequence[StampEntry], reading: Reading) -> Iterator[RawMessage]:
    """The messages of a reading, described by its entries, in the order of ``stamp_order``.

    Raises BagError when the bag changes between the readings or the temporary file cannot be written.
    """
    order = stamp_order(entries)
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    is_far = np.abs(place - np.arange(len(order))) > NEAR_MESSAGES
    with tempfile.SpooledTemporaryFile(max_size=_MEMORY_BYTES) as file:
        put_aside = _SpillFile(file)
        if is_far.any():
            put_aside.fill(is_far, reading())
        yield from _held_back(order, is_far, reading(), put_aside)


def stamp_order(entries: Sequence[StampEntry]) -> NDArray[np.intp]:
    """Indices (N,) of the entries in the order of their stamps, loop by loop; stable for equal stamps.

    A message without a stamp stays behind the stamped one that was recorded before it. A bag that was
    recorded from a looping playback holds the same stamps several times: each loop is sorted on its own.
    """
    stamps = np.empty(len(entries), dtype=np.int64)
    latest = -(2**62)
    for index, entry in enumerate(entries):
        latest = latest if entry.stamp_ns is None else entry.stamp_ns
        stamps[index] = latest
    return np.lexsort((stamps, loop_numbers(entries)))


def loop_numbers(entries: Sequence[StampEntry]) -> NDArray[np.intp]:
    """Which loop (N,) of a playback each entry belongs to, in recorded order; 0 for a bag without loops.

    A new loop begins where a topic, RESTART_STEP_NS or more back, shows several stamps in a row that the
    present loop has shown already. A single one is a duplicate, and new stamps are disorder.
    """
    loops = np.zeros(len(entries), dtype=np.intp)
    topics: defaultdict[str, _TopicStamps] = defaultdict(_TopicStamps)
    for index, entry in enumerate(entries):
        if entry.stamp_ns is None or not topics[entry.topic].add(index, entry.stamp_ns):
            continue
        # Other topics may have begun the loop a little earlier than the one that shows it first.
        start = min(stamps.repeated[0] for stamps in topics.values() if stamps.repeated)
        loops[start:] += 1
        topics.clear()
        for past, other in enumerate(entries[start : index + 1], start):
            if other.stamp_ns is not None:
                topics[other.topic].add(past, other.stamp_ns)
    return loops


@dataclass(slots=True)
class _TopicStamps:
    """The stamps that one topic has shown in the present loop."""

    seen: set[int] = field(default_factory=set)
    newest: int = -(2**62)
    latest: int = -(2**62)
    repeated: list[int] = field(default_factory=list)
    """Indices of the entries of a possible new loop so far."""

    def add(self, index: int, stamp_ns: int) -> bool:
        """Take the next stamp; True if it makes clear that a new loop has begun."""
        is_repeat = stamp_ns in self.seen and self.newest - stamp_ns >= RESTART_STEP_NS
        if not is_repeat or stamp_ns <= self.latest:
            self.repeated.clear()
        if is_repeat:
            self.repeated.append(index)
        self.seen.add(stamp_ns)
        self.newest = max(self.newest, stamp_ns)
        self.latest = stamp_ns
        return len(self.repeated) >= _LOOP_REPEATS


def _held_back(
    order: NDArray[np.intp], is_far: NDArray[np.bool_], arriving: Iterator[RawMessage], put_aside: _SpillFile
) -> Iterator[RawMessage]:
    """The messages by order: near ones are taken as they arrive and held until it is their turn."""
    held: dict[int, RawMessage] = {}
    numbered = enumerate(arriving)
    for index in order.tolist():
        while index not in held and not is_far[index]:
            arrived, raw = next(numbered, (-1, None))
            if raw is None or arrived >= len(is_far):
                raise BagError(_BAG_CHANGED)
            if not is_far[arrived]:
                held[arrived] = raw
        yield put_aside.take(index) if is_far[index] else held.pop(index)


class _SpillFile:
    """Messages far from their place in line, in a temporary file."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._found: dict[int, tuple[Channel, int, int, int]] = {}

    def fill(self, is_far: NDArray[np.bool_], arriving: Iterator[RawMessage]) -> None:
        """Store the far messages of one reading; raises BagError when there is no room for them."""
        for raw, far, index in zip(arriving, is_far, range(len(is_far)), strict=False):
            if far:
                try:
                    self._found[index] = raw.channel, raw.log_ns, self._file.tell(), len(raw.data)
                    self._file.write(raw.data)
                except OSError as error:
                    where = tempfile.gettempdir()
                    raise BagError(f"messages cannot be put aside in {where}: {error}") from error

    def take(self, index: int) -> RawMessage:
        """The message that was recorded at this index."""
        if index not in self._found:
            raise BagError(_BAG_CHANGED)
        channel, log_ns, position, size = self._found.pop(index)
        self._file.seek(position)
        return RawMessage(channel, log_ns, self._file.read(size))
