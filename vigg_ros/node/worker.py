# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One thread that works on the newest jobs, so that whoever brings them never waits."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable, Iterable
from typing import Generic, TypeVar

_Job = TypeVar("_Job")
_LOG = logging.getLogger(__name__)


class Worker(Generic[_Job]):
    """Runs one job at a time in a thread of its own. Those brought last wait; earlier ones give way to them.

    A job brought while the thread is idle is its next one at once: it does not wait, and gives way to none.
    ``prepare`` runs first in that thread. What ``work`` raises goes to ``failed`` and does not end the thread.
    """

    def __init__(
        self,
        work: Callable[[_Job], None],
        *,
        failed: Callable[[BaseException], None],
        prepare: Callable[[], None] | None = None,
    ) -> None:
        self._work = work
        self._failed = failed
        self._prepare = prepare
        self._changed = threading.Condition()
        self._waiting: deque[_Job] = deque()
        self._current: _Job | None = None
        self._stopping = False
        self.ready = threading.Event()
        """Set once ``prepare`` has run."""
        # A daemon: a process that must end does not wait for a registration.
        self._thread = threading.Thread(target=self._run, name="registration", daemon=True)

    def start(self) -> None:
        """Begin with ``prepare``; jobs may be offered already."""
        self._thread.start()

    def offer(self, jobs: Iterable[_Job]) -> list[_Job]:
        """Let these jobs, in order, be the next ones; those that waited are returned, to be counted as dropped."""
        with self._changed:
            dropped = list(self._waiting)
            self._waiting = deque(jobs)
            self._advance()
        return dropped

    def withdraw(self) -> list[_Job]:
        """Take back the jobs that wait."""
        return self.offer(())

    @property
    def is_busy(self) -> bool:
        """Whether a job is being worked on."""
        return self._current is not None

    def stop(self, timeout_s: float) -> bool:
        """Begin nothing new and wait for what runs; False if that takes longer."""
        with self._changed:
            self._stopping = True
            self._waiting.clear()
            self._changed.notify_all()
        if self._thread.is_alive():
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        if self._prepare is not None:
            self._guarded(self._prepare)
        self.ready.set()
        while (job := self._next()) is not None:
            try:
                self._guarded(self._work, job)
            finally:
                with self._changed:
                    self._current = None
                    self._advance()

    def _advance(self) -> None:
        """Give the first job that waits to a thread without one; with the lock held."""
        if self._current is None and self._waiting:
            self._current = self._waiting.popleft()
            self._changed.notify_all()

    def _next(self) -> _Job | None:
        with self._changed:
            while self._current is None and not self._stopping:
                self._changed.wait()
            return None if self._stopping else self._current

    def _guarded(self, function: Callable[..., None], *arguments: _Job) -> None:
        try:
            function(*arguments)
        except Exception as error:  # the border of the thread: whatever it is, the next frame gets its turn
            self._report(error)

    def _report(self, error: Exception) -> None:
        try:
            self._failed(error)
        except Exception:  # told where it can still be told; the thread lives on
            _LOG.exception("a failure of the registration thread could not be reported: %r", error)
