# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What became of the frames so far."""

from __future__ import annotations

from collections import Counter

from vigg_ros.node.answer import Answer, Fate
from vigg_ros.node.rates import Latencies, Rate


class Tally:
    """Counts of answers by state and reason, rates, and latencies."""

    def __init__(self) -> None:
        self.states: Counter[str] = Counter()
        self.reasons: Counter[str] = Counter()
        self.latencies = Latencies()
        self.rate = Rate()
        """Of poses."""
        self.last: Answer | None = None
        """The last answer that came from a registration or a refusal."""
        self.last_pose_s: float | None = None
        self.frames_lost = 0
        """In a row."""

    def add(self, answer: Answer, now_s: float) -> None:
        """Count an answer."""
        self.states[answer.state] += 1
        if answer.reason:
            self.reasons[answer.reason] += 1
        if answer.registered is not None:
            self.latencies.add(answer.timings_ms)
        if answer.registered is not None or answer.state == Fate.REFUSED.value:
            self.last = answer
        if answer.has_pose:
            self.rate.count(now_s)
            self.last_pose_s = now_s
            self.frames_lost = 0
        elif answer.registered is not None:
            self.frames_lost += 1

    @property
    def received(self) -> int:
        """All leading messages."""
        return sum(self.states.values())

    @property
    def dropped(self) -> int:
        """Frames that gave way to newer ones."""
        return self.states[Fate.DROPPED.value]
