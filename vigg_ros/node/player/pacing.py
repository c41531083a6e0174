# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When a recorded message is due: the recording's own rhythm, faster or slower."""

from __future__ import annotations

import time
from collections.abc import Callable

JUMP_NS = 1_000_000_000
"""A step back in time of this much begins anew, as in tracking; less is disorder between topics."""

TICK_S = 0.01
"""While waiting, so often somebody can be told the time: /clock at 100 Hz."""


class Timeline:
    """Times of recording as a position from the first message on, in ns; it never goes back."""

    def __init__(self) -> None:
        self._zero_ns: int | None = None
        self._latest_ns = 0
        self.position_ns = 0

    def advance(self, time_ns: int) -> int:
        """The position of a message recorded at this time. After a jump back it continues where it was."""
        if self._zero_ns is None:
            self._zero_ns = self._latest_ns = time_ns
        if self._latest_ns - time_ns >= JUMP_NS:
            self._zero_ns = time_ns - self.position_ns
            self._latest_ns = time_ns
        self._latest_ns = max(self._latest_ns, time_ns)
        self.position_ns = max(self.position_ns, time_ns - self._zero_ns)
        return self.position_ns


class Pace:
    """Waits until positions are due, at ``rate`` times the recorded speed, and remembers by how much it was late."""

    def __init__(self, rate: float, *, tick: Callable[[int], None] | None = None) -> None:
        self._rate = rate
        self._tick = tick
        self._start_ns: int | None = None
        self.late_s = 0.0
        """The largest delay so far, seconds."""

    def wait(self, position_ns: int) -> None:
        """Return when this position is due; the first one is due at once. Ticks get the present position."""
        if self._start_ns is None:
            self._start_ns = time.monotonic_ns() - self._scaled(position_ns)
        due_ns = self._start_ns + self._scaled(position_ns)
        while (left_ns := due_ns - time.monotonic_ns()) > 0:
            if self._tick is not None:
                self._tick(position_ns - int(left_ns * self._rate))
            time.sleep(min(left_ns / 1e9, TICK_S))
        self.late_s = max(self.late_s, -left_ns / 1e9)

    def _scaled(self, position_ns: int) -> int:
        return int(position_ns / self._rate)
