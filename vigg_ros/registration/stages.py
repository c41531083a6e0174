# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which stage takes how long, measured from outside the algorithm.

A stage is marked by a decorator; nothing is measured unless somebody records.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import ParamSpec, TypeVar

_P = ParamSpec("_P")
_R = TypeVar("_R")
_record: ContextVar[dict[str, float] | None] = ContextVar("stage_record", default=None)


@contextmanager
def record_stages() -> Iterator[dict[str, float]]:
    """Collect milliseconds per stage, in order of first use, of what runs inside the block."""
    timings_ms: dict[str, float] = {}
    token = _record.set(timings_ms)
    try:
        yield timings_ms
    finally:
        _record.reset(token)


def stage(name: str) -> Callable[[Callable[_P, _R]], Callable[_P, _R]]:
    """Mark a function as a stage. Stages do not nest: an inner one would be counted twice."""

    def mark(function: Callable[_P, _R]) -> Callable[_P, _R]:
        @functools.wraps(function)
        def timed(*args: _P.args, **kwargs: _P.kwargs) -> _R:
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
