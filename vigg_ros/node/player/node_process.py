# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The registrar node as a child process: started, measured from /proc, stopped."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from vigg_ros.registration.errors import ViggError

STOP_S = 10.0
"""So long the node may take to end after SIGINT, before it is killed."""

_PEAK_RSS = re.compile(r"VmHWM:\s+(\d+) kB")
_WARNING = re.compile(r"WARN|ERROR|FATAL|Traceback|\w+Error\b")
_COLOUR_OR_TIME = re.compile(r"\x1b\[[0-9;]*m|\[\d+\.\d+\] ?")
_NUMBER = re.compile(r"\d+| \(\d+ more like this since the last line\)")
_SHOWN_LINES = 12


class NodeFailed(ViggError):
    """The node ended by itself, or never became ready."""


class Usage(NamedTuple):
    """What a process has used up to a moment of the monotonic clock; CPU time is that of all threads together."""

    at_s: float
    cpu_s: float
    peak_rss_mb: float


class NodeProcess:
    """Runs a command until ``stop`` or the end of ``with``. What it says goes to a file."""

    def __init__(self, command: Sequence[str], log: Path, environment: Mapping[str, str]) -> None:
        self._log = log
        with log.open("wb") as file:
            # A session of its own: Ctrl-C in the terminal shall reach this process, which then stops the node.
            self._process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=file, stderr=file, env=environment, start_new_session=True
            )

    def __enter__(self) -> NodeProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def check(self) -> None:
        """Raises NodeFailed if the node has ended."""
        code = self._process.poll()
        if code is not None:
            said = "\n".join(self._lines()[-_SHOWN_LINES:]) or "(nothing)"
            raise NodeFailed(f"the node ended by itself with exit code {code}; it said:\n{said}")

    def usage(self) -> Usage | None:
        """So far; None where the system has no /proc, and when the process has just ended."""
        folder = Path("/proc") / str(self._process.pid)
        try:
            # The name in parentheses may hold spaces; utime and stime are the 12th and 13th field after it.
            times = (folder / "stat").read_text().rpartition(")")[2].split()
            peak = _PEAK_RSS.search((folder / "status").read_text())
        except OSError:
            return None
        cpu_s = (int(times[11]) + int(times[12])) / os.sysconf("SC_CLK_TCK")
        return Usage(time.monotonic(), cpu_s, int(peak[1]) / 1024) if peak else None

    def stop(self) -> int:
        """End the node by SIGINT, if it still runs; its exit code, negative if a signal ended it."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        try:
            return self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()

    def warnings(self) -> list[str]:
        """What the node warned of, oldest first; of lines that differ in numbers only, the last."""
        found = {_NUMBER.sub("", line): line for line in self._lines() if _WARNING.search(line)}
        return list(found.values())[-_SHOWN_LINES:]

    def _lines(self) -> list[str]:
        text = _COLOUR_OR_TIME.sub("", self._log.read_text(encoding="utf-8", errors="replace"))
        return [line.rstrip() for line in text.splitlines() if line.strip()]
