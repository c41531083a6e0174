# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How often: limits to frames and log lines, and counts, rates and latencies of the recent past."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable

import numpy as np

from vigg_ros.sensors.header import NS_PER_S
from vigg_ros.tracking.frame_result import FrameResult, State

JITTER = 0.1
"""Stamps of a regular camera vary; a frame may come this share of the period early."""


class RateLimit:
    """Lets so many frames pass per second of their stamps in the mean; speed of arrival plays no part."""

    def __init__(self, max_rate_hz: float = 0.0) -> None:
        self.max_rate_hz = max_rate_hz
        self._session: int | None = None
        self._place_ns = 0.0
        """Where the last frame that passed stands in the regular grid; the rate may change after it."""

    def allows(self, stamp_ns: int, session: int) -> bool:
        """Whether this frame is to be registered; the first one of a session always is."""
        if self.max_rate_hz <= 0:
            return True
        period_ns = NS_PER_S / self.max_rate_hz
        due_ns = self._place_ns + period_ns
        if session == self._session and stamp_ns < due_ns - JITTER * period_ns:
            return False
        on_time = session == self._session and stamp_ns < due_ns + period_ns
        self._place_ns = due_ns if on_time else float(stamp_ns)
        self._session = session
        return True


class Throttle:
    """Says when a log line is due, by key: the first at once, then one per period with the number of those left out.

    At most ``capacity`` keys are remembered, the latest ones.
    """

    def __init__(self, period_s: float, capacity: int = 256) -> None:
        self._period_s = period_s
        self._capacity = capacity
        self._said: dict[str, tuple[float, int]] = {}

    def due(self, key: str, now_s: float) -> int | None:
        """How many lines of this key were left out since the last one; None if this one is left out too."""
        last_s, held = self._said.pop(key, (float("-inf"), 0))
        is_due = now_s - last_s >= self._period_s
        self._said[key] = (now_s, 0) if is_due else (last_s, held + 1)
        if len(self._said) > self._capacity:
            del self._said[next(iter(self._said))]
        return held if is_due else None


class Rate:
    """Events per second over the last few seconds."""

    def __init__(self, window_s: float = 5.0, capacity: int = 1000) -> None:
        self._window_s = window_s
        self._times_s: deque[float] = deque(maxlen=capacity)

    def count(self, now_s: float) -> None:
        """Something happened."""
        self._times_s.append(now_s)

    def hz(self, now_s: float) -> float:
        """Mean rate within the window; 0 where nothing happened in it."""
        recent = [time_s for time_s in self._times_s if now_s - time_s <= self._window_s]
        if len(recent) < 2:
            return len(recent) / self._window_s
        return (len(recent) - 1) / max(now_s - recent[0], 1e-9)


class Latencies:
    """Milliseconds per stage of the last answers."""

    def __init__(self, capacity: int = 100) -> None:
        self._rows: deque[dict[str, float]] = deque(maxlen=capacity)

    def add(self, timings_ms: dict[str, float]) -> None:
        """The stages of one answer."""
        self._rows.append(timings_ms)

    def summary(self) -> dict[str, tuple[float, float]]:
        """Median and 95th percentile by stage, in order of first use."""
        names = dict.fromkeys(name for row in self._rows for name in row)
        return {name: _spread(row[name] for row in self._rows if name in row) for name in names}


def _spread(values: Iterable[float]) -> tuple[float, float]:
    median, p95 = np.percentile(list(values), (50, 95)).tolist()
    return median, p95


class FrameStatistics:
    """What became of the frames so far: counts by state and reason, rates, and latencies."""

    def __init__(self) -> None:
        self.states: Counter[str] = Counter()
        self.reasons: Counter[str] = Counter()
        self.latencies = Latencies()
        self.rate = Rate()
        """Of poses."""
        self.last: FrameResult | None = None
        """The last result that came from a registration or a refusal."""
        self.last_pose_s: float | None = None
        self.frames_lost = 0
        """In a row."""

    def add(self, result: FrameResult, now_s: float) -> None:
        """Count a result."""
        self.states[result.state.value] += 1
        if result.reason:
            self.reasons[result.reason] += 1
        if result.state.was_registered:
            self.latencies.add(result.timings_ms)
        if result.state.was_registered or result.state is State.REFUSED:
            self.last = result.kept()
        if result.has_pose:
            self.rate.count(now_s)
            self.last_pose_s = now_s
            self.frames_lost = 0
        elif result.state is State.LOST:
            self.frames_lost += 1

    @property
    def received(self) -> int:
        """All leading messages."""
        return sum(self.states.values())

    @property
    def dropped(self) -> int:
        """Frames that gave way to newer ones."""
        return self.states[State.DROPPED.value]
