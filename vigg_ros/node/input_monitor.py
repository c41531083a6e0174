# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What one input topic has brought: counts, ages, refusals, and stamps that never arrived."""

from __future__ import annotations

from collections import Counter, deque

import numpy as np

from vigg_ros.node.rates import Rate
from vigg_ros.sensors.header import NS_PER_S

PERIODS = 100
"""Steps between stamps from which the usual one is taken."""

IRREGULAR = 0.2
"""Where steps are this far from multiples of the period in the mean, the topic has none, and nothing is missing."""


class StampGaps:
    """Counts the stamps that a regular topic should have brought and did not."""

    def __init__(self) -> None:
        self._steps_ns: deque[int] = deque(maxlen=PERIODS)
        self._last_ns: int | None = None

    def add(self, stamp_ns: int) -> None:
        """The stamp of a message that arrived."""
        if self._last_ns is not None and 0 < stamp_ns - self._last_ns < NS_PER_S:
            self._steps_ns.append(stamp_ns - self._last_ns)
        self._last_ns = stamp_ns

    def recent(self) -> tuple[int, int]:
        """Missing and expected stamps of the last PERIODS steps; (0, 0) before ten are known, or without a period.

        The shortest tenth of the steps tells the sensor's period: where most stamps are missing, the median
        step is a multiple of it.
        """
        if len(self._steps_ns) < 10:
            return 0, 0
        steps = np.array(self._steps_ns)
        period = np.percentile(steps, 10)
        expected = np.maximum(np.rint(steps / period), 1)
        if np.abs(steps / period - expected).mean() > IRREGULAR:
            return 0, 0
        return int((expected - 1).sum()), int(expected.sum())


class InputMonitor:
    """One input topic."""

    def __init__(self) -> None:
        self.received = 0
        self.refused: Counter[str] = Counter()
        self.last_refusal = ""
        """Code and message; empty if the last message was good."""
        self.last_arrival_s: float | None = None
        self.stamps_ns: deque[int] = deque(maxlen=10)
        """Of the last good messages; few, so that an offset is that of now, also after a clock was set."""
        self.gaps = StampGaps()
        self.rate = Rate()

    def arrive(self, now_s: float) -> None:
        """A message arrived, good or not."""
        self.received += 1
        self.last_arrival_s = now_s
        self.rate.count(now_s)

    def accept(self, stamp_ns: int) -> None:
        """It could be used."""
        self.last_refusal = ""
        self.stamps_ns.append(stamp_ns)
        self.gaps.add(stamp_ns)

    def refuse(self, code: str, message: str) -> None:
        """It could not be used."""
        self.refused[code] += 1
        self.last_refusal = f"{message} ({code})"

    def restart(self) -> None:
        """Forget stamps, as before a recording; counts go on."""
        self.stamps_ns.clear()
        self.gaps = StampGaps()

    def age_s(self, now_s: float) -> float | None:
        """Seconds since the last message; None before the first."""
        return None if self.last_arrival_s is None else now_s - self.last_arrival_s


def offset_s(leader: InputMonitor, follower: InputMonitor) -> float | None:
    """Median distance from the leader's last stamps to the follower's nearest ones; None while one has none."""
    if not leader.stamps_ns or not follower.stamps_ns:
        return None
    theirs = np.sort(np.array(follower.stamps_ns))
    distances = [theirs[np.argmin(np.abs(theirs - stamp))] - stamp for stamp in leader.stamps_ns]
    return float(np.median(distances)) / NS_PER_S
