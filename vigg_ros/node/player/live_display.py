# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a running node is doing: a table that is redrawn on a terminal, else a line every few seconds."""

from __future__ import annotations

import os
import shutil
import sys
import time
from collections.abc import Callable

import numpy as np

from vigg_ros.node.player.node_process import Usage
from vigg_ros.node.player.scoreboard import Score

REDRAW_S = 0.25
LINE_S = 5.0

COLUMNS = ("time", "state", "poses", "rate", "latency", "dropped", "error", "CPU", "memory")
WIDTHS = (5, 12, 11, 7, 7, 7, 8, 5, 7)
"""In characters; with a space between, not more than a terminal's usual 80. A state's reason is cut off."""


class LiveDisplay:
    """Writes to stderr what ``look`` says, whenever it is time."""

    def __init__(self, look: Callable[[], tuple[Score, Usage | None]], *, start_s: float) -> None:
        self._look = look
        self._start_s = start_s
        self._is_terminal = sys.stderr.isatty() and os.environ.get("TERM", "") not in ("", "dumb")
        self._due_s = 0.0 if self._is_terminal else start_s + LINE_S
        self._drawn = False
        self._before = look()[1]
        self._cpu = "-"

    def update(self) -> None:
        """Draw, if it is time."""
        now_s = time.monotonic()
        if now_s < self._due_s:
            return
        self._due_s = now_s + (REDRAW_S if self._is_terminal else LINE_S)
        score, usage = self._look()
        self._measure_cpu(usage)
        cells = self._cells(score, usage, now_s - self._start_s)
        if self._is_terminal:
            self._redraw(cells)
        else:
            named = [f"{name} {cell}" for name, cell in list(zip(COLUMNS, cells, strict=True))[2:]]
            print(f"{cells[0]}: {cells[1]}; {', '.join(named)}", file=sys.stderr, flush=True)

    def _measure_cpu(self, usage: Usage | None) -> None:
        """CPU since the last measurement that lies a second back."""
        if usage is None:
            return
        if self._before is None:
            self._before = usage
        elif usage.at_s - self._before.at_s >= 1.0:
            self._cpu = f"{cpu_percent(self._before, usage):.0f} %"
            self._before = usage

    def _cells(self, score: Score, usage: Usage | None, elapsed_s: float) -> tuple[str, ...]:
        error = f"{100 * score.errors_m[-1]:.1f} cm" if score.errors_m.size else "-"
        latency = "-" if np.isnan(score.recent_latency_ms) else f"{score.recent_latency_ms:.0f} ms"
        return (
            f"{elapsed_s:.0f} s",
            score.state,
            f"{score.answered} of {score.sent}",
            f"{score.rate_hz:.1f} Hz",
            latency,
            str(score.dropped),
            error,
            self._cpu,
            "-" if usage is None else f"{usage.rss_mb:.0f} MB",
        )

    def _redraw(self, cells: tuple[str, ...]) -> None:
        back = "\x1b[2A\r" if self._drawn else ""
        # A row that wrapped would make two, and the next drawing would begin too low.
        columns = shutil.get_terminal_size().columns - 1
        rows = (" ".join(f"{cell[:width]:<{width}}" for cell, width in zip(row, WIDTHS, strict=True))
                for row in (COLUMNS, cells))
        lines = "".join(f"\x1b[2K{row.rstrip()[:columns]}\n" for row in rows)
        print(back + lines, end="", file=sys.stderr, flush=True)
        self._drawn = True


def cpu_percent(before: Usage, after: Usage) -> float:
    """Mean use between two measurements, in percent of one core; NaN if they are at one time."""
    elapsed_s = after.at_s - before.at_s
    return 100 * (after.cpu_s - before.cpu_s) / elapsed_s if elapsed_s > 0 else float("nan")
