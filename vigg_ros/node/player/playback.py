# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plays a bag: its messages, in its rhythm, with its stamps or with stamps of now."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Literal

from vigg_ros.bags.reader import BagReader, SerialisedMessage
from vigg_ros.bags.restamping import moved
from vigg_ros.node.player.bag_publishers import Publishers
from vigg_ros.node.player.pacing import Pace, Timeline

_BETWEEN_LOOPS_NS = 100_000_000
"""From the last message of a loop to the first of the next one."""


@dataclass(frozen=True, slots=True)
class Plan:
    """How to play."""

    rate: float = 1.0
    """Speed: 2 is twice as fast as recorded."""
    loops: int = 1
    """How many times; 0: until interrupted."""
    order: Literal["log", "stamp"] = "log"
    """By time of recording, as the messages arrived, or by header stamp, as the sensors looked."""
    now: bool = False
    """Move all stamps by the same amount, so that the first one is that of now."""
    start_s: float = 0.0
    """Leave out so much at the beginning (latched messages excepted)."""
    duration_s: float = float("inf")
    """Play so much of the recording."""


@dataclass(frozen=True, slots=True)
class Sending:
    """A message at the moment before it is handed to DDS."""

    topic: str
    recorded_ns: int | None
    """Its stamp in the bag; None for a type without a header."""
    stamp_ns: int | None
    """Its stamp as published."""
    size_bytes: int
    at_s: float
    """That moment, on the monotonic clock."""


@dataclass(frozen=True, slots=True)
class _Due:
    """A message and when it is due."""

    position_ns: int
    """From the excerpt's start on."""
    time_ns: int
    """The recording's clock then."""
    message: SerialisedMessage


class Playback:
    """One playing of an open bag.

    ``ticks`` are called with the recording's clock, ns, with every message and about 100 times a second while waiting.
    """

    def __init__(
        self,
        reader: BagReader,
        publishers: Publishers,
        plan: Plan,
        *,
        ticks: Sequence[Callable[[int], None]] = (),
    ) -> None:
        self._reader = reader
        self._publishers = publishers
        self._plan = plan
        self._ticks = ticks
        self._latched = reader.latched() | {"/tf_static"}
        self._origin_ns = 0
        self._stamped_until_ns = 0
        self._pace = Pace(plan.rate, tick=self._tick if ticks else None)
        self.loop = 0
        """The present loop, counted from 0."""
        self.position_s = 0.0
        """How much of the recording was played, through all loops."""

    @property
    def late_s(self) -> float:
        """By how much a message came later than its place in the rhythm, at most."""
        return self._pace.late_s

    def run(self, sending: Callable[[Sending], None]) -> None:
        """Publish all messages when they are due; each is announced before, as its answer may come at once."""
        begin_ns = 0
        for loop in range(self._plan.loops) if self._plan.loops else count():
            self.loop = loop
            end_ns = self._play_once(begin_ns, sending)
            if end_ns == begin_ns:
                return  # nothing to play, or all at one time: to repeat that for ever would be no playing
            begin_ns = end_ns + _BETWEEN_LOOPS_NS

    def _play_once(self, begin_ns: int, sending: Callable[[Sending], None]) -> int:
        """The position of the last message."""
        shift_ns: int | None = None
        position_ns = begin_ns
        for due in self._excerpt():
            position_ns, message = begin_ns + due.position_ns, due.message
            self._origin_ns = due.time_ns - position_ns
            self._pace.wait(position_ns)
            recorded_ns = message.stamp_ns
            if self._plan.now:
                if shift_ns is None and recorded_ns and message.topic not in self._latched:
                    shift_ns = max(time.time_ns(), self._stamped_until_ns + _BETWEEN_LOOPS_NS) - recorded_ns
                message = moved(message, shift_ns or 0)
                self._stamped_until_ns = max(self._stamped_until_ns, message.stamp_ns or 0)
            self._tick(position_ns)
            sending(Sending(message.topic, recorded_ns, message.stamp_ns, len(message.data), time.monotonic()))
            self._publishers.publish(message)
            self.position_s = position_ns / 1e9
        return position_ns

    def _excerpt(self) -> Iterator[_Due]:
        """The messages between start and end, and the latched ones before."""
        timeline = Timeline()
        start_ns, length_ns = self._plan.start_s * 1e9, self._plan.duration_s * 1e9
        latest_ns: int | None = None
        for message in self._reader.serialised(self._publishers.names, order=self._plan.order):
            time_ns = message.log_ns
            if self._plan.order == "stamp":
                # A message without a stamp comes with the one before it, as the reader orders them.
                time_ns = latest_ns = message.stamp_ns or latest_ns or time_ns
            position_ns = timeline.advance(time_ns) - int(start_ns)
            if position_ns > length_ns:
                return
            if not self._publishers.plays(message):
                continue
            if position_ns >= 0 or message.topic in self._latched:
                yield _Due(max(0, position_ns), time_ns, message)

    def _tick(self, position_ns: int) -> None:
        for tick in self._ticks:
            tick(self._origin_ns + position_ns)
