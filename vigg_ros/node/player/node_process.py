# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The registrar node as a child process: started, measured from /proc, stopped."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from vigg_ros.registration.errors import ViggError

STOP_S = 10.0
"""So long the node may take to end after SIGINT, before it is killed."""

_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PROBLEM = re.compile(r"WARN|ERROR|FATAL|Traceback|\w+Error\b")
_LOG_STAMP = re.compile(r"\[\d+\.\d+\] ?")
_NUMBER = re.compile(r"\d+| \(\d+ more like this since the last line\)")
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_SHOWN_LINES = 12


class NodeFailed(ViggError):
    """The node ended by itself, or never became ready."""


@dataclass(frozen=True, slots=True)
class Usage:
    """What a process has used so far."""

    at_s: float
    """On the monotonic clock."""
    cpu_s: float
    """Of all its threads together, so more than one second in a second is possible."""
    rss_mb: float
    peak_rss_mb: float


class NodeProcess:
    """A node that runs within ``with``. What it says goes to a file."""

    def __init__(self, command: Sequence[str], log: Path, environment: Mapping[str, str]) -> None:
        self._command = list(command)
        self._environment = dict(environment)
        self._log = log
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> NodeProcess:
        with self._log.open("wb") as log:
            # A session of its own: Ctrl-C in the terminal shall reach this process, which then stops the node.
            self._process = subprocess.Popen(
                self._command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=self._environment,
                start_new_session=True,
            )
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def check(self) -> None:
        """Raises NodeFailed if the node has ended."""
        code = self._running.poll()
        if code is not None:
            said = "\n".join(self.last_lines())
            raise NodeFailed(f"the node ended by itself with exit code {code}; it said:\n{said or '(nothing)'}")

    def usage(self) -> Usage | None:
        """CPU time and memory so far; None where /proc does not say."""
        folder = Path("/proc") / str(self._running.pid)
        try:
            # The name in parentheses may hold spaces; utime and stime are the 12th and 13th field after it.
            times = (folder / "stat").read_text().rpartition(")")[2].split()
            status = dict(line.split(":", 1) for line in (folder / "status").read_text().splitlines() if ":" in line)
            cpu_s = (int(times[11]) + int(times[12])) / _TICKS_PER_S
            rss_mb, peak_rss_mb = (int(status[name].split()[0]) / 1024 for name in ("VmRSS", "VmHWM"))
        except (OSError, KeyError):  # another system, or the node has just ended
            return None
        return Usage(time.monotonic(), cpu_s, rss_mb, peak_rss_mb)

    def stop(self) -> int:
        """End the node by SIGINT, if it still runs; its exit code, negative if a signal ended it."""
        process = self._running
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        try:
            return process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()
            return process.wait()

    def last_lines(self) -> list[str]:
        """The last lines that the node wrote."""
        return self._lines()[-_SHOWN_LINES:]

    def problems(self) -> list[str]:
        """What the node warned of, oldest first; of lines that differ in numbers only, the last."""
        kinds: dict[str, str] = {}
        for line in self._lines():
            if _PROBLEM.search(line):
                text = _LOG_STAMP.sub("", line)
                kinds[_NUMBER.sub("", text)] = text
        return list(kinds.values())[-_SHOWN_LINES:]

    def _lines(self) -> list[str]:
        text = self._log.read_text(encoding="utf-8", errors="replace")
        return [line.rstrip() for line in _COLOUR.sub("", text).splitlines() if line.strip()]

    @property
    def _running(self) -> subprocess.Popen[bytes]:
        assert self._process is not None, "only within 'with'"
        return self._process


def node_command(words: Sequence[str]) -> list[str]:
    """The command that starts the node of this installation with these arguments."""
    return [sys.executable, "-m", "vigg_ros.node", *words]
