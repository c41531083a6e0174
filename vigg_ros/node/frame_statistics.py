# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What became of the frames so far."""

from __future__ import annotations

from collections import Counter

from vigg_ros.node.rates import Latencies, Rate
from vigg_ros.tracking.frame_result import FrameResult, State


class FrameStatistics:
    """Counts of results by state and reason, rates, and latencies."""

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
