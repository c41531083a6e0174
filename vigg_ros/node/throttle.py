# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Repeated log lines: the first at once, then one per period with the number of those left out."""

from __future__ import annotations


class Throttle:
    """Says when a line is due, by key. At most ``capacity`` keys are remembered, the latest ones."""

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
