# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The figures of ``vigg live``: the same table while the node runs and at the end."""

from __future__ import annotations

import math
import os
import shutil
import sys
import time
from collections.abc import Callable

import numpy as np

from vigg_ros.node.player.live_frames import LiveFrames
from vigg_ros.node.player.node_process import Usage
from vigg_ros.report.wording import table_text

REDRAW_S, REPEAT_S = 0.5, 5.0
"""So often the table is drawn on a terminal, and written elsewhere."""


def live_rows(frames: LiveFrames, before: Usage | None, now: Usage | None) -> dict[str, str]:
    """Coverage, latency, errors with their alignment, and what the node used between two moments."""
    sent, answered, duration_s = len(frames.all), frames.answered, frames.duration_s
    unanswered = f"{frames.pending} (lost on the way, without partner, or still waiting)"
    rows = {
        "frames sent": f"{sent} in {duration_s:.1f} s ({_rate(sent, duration_s)})",
        "poses received": f"{len(answered)} ({len(answered) / max(sent, 1):.1%}, {_rate(len(answered), duration_s)})",
        "without a pose": ", ".join(f"{reason}: {count}" for reason, count in frames.failures.most_common()) or "none",
        "without an answer": unanswered if frames.pending else "none",
        "latency": "-",
        "position error": "- (no answered frame has a true pose)",
    }
    if answered:
        median, p95 = np.percentile([1e3 * (frame.received_s - frame.sent_s) for frame in answered], (50, 95))
        rows["latency"] = f"median {median:.0f} ms, p95 {p95:.0f} ms, from publishing to receiving the pose"
    errors_cm = 100 * frames.position_errors_m()
    if errors_cm.size:
        spread = f"median {np.median(errors_cm):.2f} cm, max {errors_cm.max():.2f} cm, over {errors_cm.size} frames"
        rows["position error"] = f"{spread}, aligned at the first pose of each session"
    if before is not None and now is not None:
        cpu_percent = 100 * (now.cpu_s - before.cpu_s) / max(now.at_s - before.at_s, 1e-3)
        rows["node"] = f"CPU {cpu_percent:.0f} % of one core in the mean, memory {now.peak_rss_mb:.0f} MB at most"
    return rows


def advice_on_drops(frames: LiveFrames, rate: float) -> str:
    """One sentence with a rate of playing that this computer can follow; empty if nothing was dropped."""
    sent, dropped = len(frames.all), frames.dropped
    registered = sent - dropped - frames.pending
    if not dropped:
        return ""
    said = f"{dropped} of {sent} frames were dropped because newer ones came"
    if not registered:
        return said
    slower = rate * registered / sent
    digit = 10.0 ** math.floor(math.log10(slower))  # to one digit and downwards: 0.37 to 0.3
    return f"{said}; try --rate {math.floor(slower / digit + 1e-9) * digit:.1g}"


class LiveDisplay:
    """Writes a table to stderr whenever it is time, on a terminal over the former one."""

    def __init__(self, look: Callable[[], dict[str, str]]) -> None:
        self._look = look
        self._is_terminal = sys.stderr.isatty() and os.environ.get("TERM", "") not in ("", "dumb")
        self._due_s = 0.0
        self._erase = ""

    def update(self) -> None:
        """Write, if it is time."""
        if time.monotonic() < self._due_s:
            return
        self._due_s = time.monotonic() + (REDRAW_S if self._is_terminal else REPEAT_S)
        lines = table_text(self._look()).splitlines()
        if self._is_terminal:
            # A line that wrapped would make two, and the next drawing would begin too low.
            columns = shutil.get_terminal_size().columns - 1
            lines = [line[:columns] for line in lines]
        print(self._erase + "\n".join(lines), file=sys.stderr, flush=True)
        self._erase = f"\x1b[{len(lines)}F\x1b[J" if self._is_terminal else "\n"

    def clear(self) -> None:
        """Take back what stands on the terminal."""
        print(self._erase, end="", file=sys.stderr, flush=True)
        self._erase = ""


def _rate(count: int, seconds: float) -> str:
    return f"{(count - 1) / seconds:.1f} Hz" if count > 1 and seconds > 0 else "- Hz"
