# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Results in rows of figures: accuracy, recall, coverage, wrong answers, time."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vigg_ros.bench.pair_results import Limits, PairResult, nulled


@dataclass(frozen=True, slots=True)
class Summary:
    """One method on one group of pairs. Medians over all pairs, failures included; shares in percent."""

    method: str
    group: str
    pairs: int
    rotation_deg: float
    """Median RE; inf where most pairs have no answer."""
    translation_m: float
    """Median TE."""
    recall: float
    """RR: answers within the limits of recall."""
    answered: float
    """Coverage."""
    wrong: int
    """Answers beyond the limits of recall."""
    accuracy_deg: tuple[float, ...]
    """Shares within each limit of rotation."""
    accuracy_m: tuple[float, ...]
    ms: float
    """Median time of a pair, both frames' features included; NaN where none was measured."""
    ms_p95: float
    stages_ms: Mapping[str, float]
    """Median time of each stage over the pairs, 0 where a pair did without it."""

    def cells(self) -> dict[str, object]:
        """For a table, in the units of the paper."""
        return {
            "method": self.method,
            "group": self.group,
            "pairs": self.pairs,
            "RE deg": figure(self.rotation_deg),
            "TE cm": figure(100 * self.translation_m),
            "RR %": f"{self.recall:.1f}",
            "answered %": f"{self.answered:.1f}",
            "wrong": self.wrong,
            "Acc deg": "/".join(f"{share:.0f}" for share in self.accuracy_deg),
            "Acc m": "/".join(f"{share:.0f}" for share in self.accuracy_m),
            "ms": figure(self.ms, whole=True),
            "ms p95": figure(self.ms_p95, whole=True),
        }

    def as_dict(self) -> dict[str, Any]:
        """For summary.json; null where nothing is known."""
        return nulled({name: getattr(self, name) for name in self.__slots__})


def figure(value: float, *, whole: bool = False) -> str:
    """A number for a table; a dash for what is not known."""
    if not math.isfinite(value):
        return "-"
    return f"{value:.0f}" if whole else f"{value:#.3g}".rstrip(".")


def summarise(results: Sequence[PairResult], limits: Limits) -> Summary:
    """The summary of results of one method and group, at least one."""
    rotation = np.array([result.rotation_error_deg for result in results])
    translation = np.array([result.translation_error_m for result in results])
    times = [result.total_ms for result in results if result.timings_ms]
    return Summary(
        method=results[0].method,
        group=results[0].group,
        pairs=len(results),
        rotation_deg=_median(rotation),
        translation_m=_median(translation),
        recall=_percent(result.is_right(limits) for result in results),
        answered=_percent(result.is_answered for result in results),
        wrong=sum(result.is_wrong(limits) for result in results),
        accuracy_deg=tuple(_percent(rotation < limit) for limit in limits.accuracy_deg),
        accuracy_m=tuple(_percent(translation < limit) for limit in limits.accuracy_m),
        ms=float(np.median(times)) if times else math.nan,
        ms_p95=float(np.percentile(times, 95)) if times else math.nan,
        stages_ms=_stages(results),
    )


def summarise_all(results: Iterable[PairResult], limits: Limits) -> list[Summary]:
    """A summary for each group and method, in the order they first come in; groups first."""
    parts: dict[tuple[str, str], list[PairResult]] = defaultdict(list)
    for result in results:
        parts[result.group, result.method].append(result)
    groups = list(dict.fromkeys(group for group, _ in parts))
    return [summarise(rows, limits) for group in groups for (of_group, _), rows in parts.items() if of_group == group]


def reasons(results: Iterable[PairResult]) -> dict[str, Counter[str]]:
    """Of each method, why pairs have no answer, and how many."""
    found: dict[str, Counter[str]] = {}
    for result in results:
        if not result.is_answered:
            found.setdefault(result.method, Counter())[result.reason] += 1
    return found


def _median(values: np.ndarray) -> float:
    """inf where the middle of an even number lies between an error and no answer."""
    with np.errstate(invalid="ignore"):
        median = float(np.median(values))
    return math.inf if math.isnan(median) else median


def _percent(flags: Iterable[bool]) -> float:
    return 100.0 * float(np.mean(list(flags)))


def _stages(results: Sequence[PairResult]) -> dict[str, float]:
    measured = [result.timings_ms for result in results if result.timings_ms]
    names = dict.fromkeys(name for timings in measured for name in timings)
    return {name: round(float(np.median([timings.get(name, 0.0) for timings in measured])), 2) for name in names}
