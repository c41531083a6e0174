# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How often: a limit by stamps, and rates and latencies of the recent past."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import numpy as np

from vigg_ros.sensors.header import NS_PER_S

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
