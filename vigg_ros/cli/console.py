# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What all commands have in common: exit codes, progress, tables, the machine's name."""

from __future__ import annotations

import math
import os
import platform
import signal
import sys
import time
from argparse import ArgumentParser, ArgumentTypeError, RawDescriptionHelpFormatter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime
from enum import IntEnum
from pathlib import Path
from typing import Any

import vigg_ros
from vigg_ros.registration.errors import ViggError


class ExitCode(IntEnum):
    """What a command tells the shell; docs/data.md says when."""

    OK = 0
    FAILED = 1
    USAGE = 2
    UNREADABLE = 3
    PARTLY_READABLE = 4
    NOTHING_PAIRED = 5
    INTERRUPTED = 130


@contextmanager
def interruptible() -> Iterator[None]:
    """SIGINT, SIGTERM and a closed terminal raise KeyboardInterrupt, so that nothing is left running.

    SIGINT does so too where it was inherited as ignored, as by what a script starts with &; under nohup SIGHUP stays
    ignored. For the main thread.
    """
    numbers = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        numbers.append(signal.SIGHUP)
    before = {number: signal.signal(number, signal.default_int_handler) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class UsageError(ViggError):
    """The command was asked for something that cannot be done as asked."""


def add_examples(parser: ArgumentParser, *commands: str) -> None:
    """Commands to begin with, below the help."""
    parser.formatter_class = RawDescriptionHelpFormatter
    parser.epilog = "\n".join(["examples:", *(f"  {command}" for command in commands)])


def output_folder(asked: str | None, default: str) -> Path:
    """A folder for results, not made yet; by default with the time in its name. Raises UsageError where one exists."""
    output = Path(asked or f"{default}_{datetime.now():%Y%m%d_%H%M%S}")
    if output.exists() or output.is_symlink():
        raise UsageError(f"{output} exists already and is not overwritten; give another --output")
    return output


def positive_int(text: str) -> int:
    """For argparse: a whole number from 1 on."""
    value = int(text)
    if value < 1:
        raise ArgumentTypeError(f"{text} is not a positive number")
    return value


def positive_float(text: str) -> float:
    """For argparse: a finite number above 0."""
    value = float(text)
    if not 0 < value < math.inf:  # nor does NaN pass
        raise ArgumentTypeError(f"{text} is not a positive number")
    return value


class Progress:
    """A counting line on stderr, on a terminal only; a context manager."""

    def __init__(self, what: str, total: int) -> None:
        self._what = what
        self._total = total
        self._done = 0
        self._start_s = self._shown_s = time.monotonic()
        self._is_shown = sys.stderr.isatty()

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_shown:
            self._show("\n")

    def step(self) -> None:
        """One more is done."""
        self.show(self._done + 1, self._total)

    def show(self, done: int, total: int) -> None:
        """So many of so many are done."""
        self._done, self._total = done, total
        if self._is_shown and time.monotonic() - self._shown_s > 0.2:
            self._show("")

    def _show(self, end: str) -> None:
        self._shown_s = time.monotonic()
        rate = self._done / max(self._shown_s - self._start_s, 1e-3)
        left_s = (self._total - self._done) / rate if rate > 0 and self._total > self._done else 0
        text = f"\r{self._done}/{self._total} {self._what}, {rate:.1f}/s, {left_s:.0f} s left"
        print(f"{text:<60}", end=end, file=sys.stderr, flush=True)


def say(*lines: str) -> None:
    """What is no result goes to stderr."""
    print(*lines, sep="\n", end="\n" if lines else "", file=sys.stderr, flush=True)


def table(rows: Sequence[Sequence[object]]) -> str:
    """Rows of equal length as aligned text; the first is the heading."""
    cells = [[str(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in cells]
    return "\n".join([lines[0], "-" * len(lines[0]), *lines[1:]] if len(lines) > 1 else lines)


def describe_machine() -> dict[str, Any]:
    """Version and machine, for everything that holds figures."""
    return {
        "version": vigg_ros.__version__,
        "python": platform.python_version(),
        "system": platform.platform(),
        "processor": _processor(),
        "cores": os.cpu_count(),
    }


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.partition(":")[2].strip() for line in file if line.startswith("model name")]
    except OSError:
        names = []
    return names[0] if names else platform.processor() or platform.machine()
