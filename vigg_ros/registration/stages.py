# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which stage takes how long, and when to give up, decided from outside the algorithm.

A stage is marked by a decorator; nothing is measured or limited unless somebody asks for it.
"""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import ParamSpec, TypeVar

_P = ParamSpec("_P")
_R = TypeVar("_R")
_record: ContextVar[dict[str, float] | None] = ContextVar("stage_record", default=None)
_limit: ContextVar[tuple[float, float]] = ContextVar("stage_limit", default=(math.inf, math.inf))


class OutOfTime(Exception):
    """The time budget is used up."""


@contextmanager
def record_stages() -> Iterator[dict[str, float]]:
    """Collect milliseconds per stage, in order of first use, of what runs inside the block.

    Stages that run side by side are counted in full each, so that their sum may exceed the time on the clock.
    """
    timings_ms: dict[str, float] = {}
    token = _record.set(timings_ms)
    try:
        yield timings_ms
    finally:
        _record.reset(token)


@contextmanager
def time_limit(budget_s: float) -> Iterator[None]:
    """Let no stage begin inside the block once the budget is used up: OutOfTime is raised instead.

    0 is no limit. Inside another limit the earlier end holds.
    """
    ends = (time.monotonic() + budget_s, budget_s) if budget_s > 0 else (math.inf, math.inf)
    token = _limit.set(min(ends, _limit.get()))
    try:
        yield
    finally:
        _limit.reset(token)


def stage(name: str) -> Callable[[Callable[_P, _R]], Callable[_P, _R]]:
    """Mark a function as a stage. Stages do not nest: an inner one would be counted twice."""

    def mark(function: Callable[_P, _R]) -> Callable[_P, _R]:
        """The function as a stage of this name."""

        @functools.wraps(function)
        def timed(*args: _P.args, **kwargs: _P.kwargs) -> _R:
            """The function, within the time that is left, and measured if somebody records."""
            end, budget_s = _limit.get()
            if time.monotonic() > end:
                raise OutOfTime(f"the time budget of {budget_s:g} s was used up before {name}")
            timings_ms = _record.get()
            if timings_ms is None:
                return function(*args, **kwargs)
            start = time.perf_counter()
            try:
                return function(*args, **kwargs)
            finally:
                timings_ms[name] = timings_ms.get(name, 0.0) + 1e3 * (time.perf_counter() - start)

        return timed

    return mark
