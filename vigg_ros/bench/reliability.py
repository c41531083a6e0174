# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far answers can be relied on: wrong ones per thousand, and whether errors are as their covariance says."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import beta, chi2

from vigg_ros.bench.pair_results import Limits, PairResult, nulled
from vigg_ros.registration import BagError

DOF = 6
CONFIDENCE = 0.95
TOTAL = "all"

LEGEND = (
    "recall %: right answers, of all pairs",
    "wrong/1000: wrong answers per 1,000 answers, and the bounds of that share with 95 % confidence (Clopper-Pearson)",
    "NEES: mean of e' C^-1 e over the right answers, e the error of the motion, C the covariance claimed; 6 is right,",
    "  more is overconfident; where C holds, the mean of so many answers is within NEES if right in 95 % of all runs",
    "inside %: right answers whose NEES is below 12.59, as 95 % are where C holds (chi-square, 6 degrees of freedom)",
)
"""What the columns are."""


@dataclass(frozen=True, slots=True)
class Reliability:
    """One method on one group of pairs; NaN where there is nothing to tell from."""

    method: str
    group: str
    pairs: int
    answered: int
    right: int
    wrong: int
    wrong_per_1000: float
    wrong_per_1000_low: float
    wrong_per_1000_high: float
    nees_answers: int
    """Right answers that came with a covariance: wrong ones are counted by themselves, and would drown the mean."""
    nees: float
    nees_low: float
    nees_high: float
    nees_inside: float
    """Share below the bound, percent."""

    def cells(self) -> dict[str, object]:
        """For a table."""
        return {
            "method": self.method,
            "group": self.group,
            "pairs": self.pairs,
            "answered": self.answered,
            "recall %": f"{100 * self.right / self.pairs:.1f}",
            "wrong": self.wrong,
            "wrong/1000": _span(self.wrong_per_1000, self.wrong_per_1000_low, self.wrong_per_1000_high),
            "NEES": _digits(self.nees),
            "NEES if right": f"{_digits(self.nees_low)} to {_digits(self.nees_high)}",
            "inside %": _digits(self.nees_inside),
        }

    def as_dict(self) -> dict[str, Any]:
        """For JSON; null where nothing is known."""
        return nulled(asdict(self))


def nees(
    T_truth: NDArray[np.float64], T_estimate: NDArray[np.float64], covariance: NDArray[np.float64]
) -> float:
    """Normalised estimation error squared (Bar-Shalom et al. 2001, 5.4): e^T covariance^-1 e.

    e (6,) takes the estimate to the truth as Registration.covariance (6, 6) means it: t + dt and exp(dr) R.
    """
    turned = Rotation.from_matrix(T_truth[:3, :3] @ T_estimate[:3, :3].T).as_rotvec()
    error = np.concatenate((T_truth[:3, 3] - T_estimate[:3, 3], turned))
    return float(error @ np.linalg.solve(covariance, error))


def share_bounds(count: int, trials: int) -> tuple[float, float]:
    """Clopper and Pearson's (1934) two-sided bounds of a probability, of which so many trials in all came true."""
    tail = (1 - CONFIDENCE) / 2
    low = 0.0 if count == 0 else float(beta.ppf(tail, count, trials - count + 1))
    high = 1.0 if count == trials else float(beta.ppf(1 - tail, count + 1, trials - count))
    return low, high


def mean_nees_bounds(count: int) -> tuple[float, float]:
    """Between which the mean of so many NEES lies where the covariance holds: their sum is chi-square with 6 n."""
    tails = np.array(((1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2))
    low, high = chi2.ppf(tails, DOF * count) / count if count else (math.nan, math.nan)
    return float(low), float(high)


def reliability(method: str, group: str, judged: Sequence[tuple[PairResult, Limits]]) -> Reliability:
    """Of results, at least one, each with the limits that it is judged by."""
    answered = sum(result.is_answered for result, _ in judged)
    wrong = sum(result.is_wrong(limits) for result, limits in judged)
    right = [result for result, limits in judged if result.is_right(limits)]
    squares = np.array([result.nees for result in right if math.isfinite(result.nees)])
    low, high = share_bounds(wrong, answered)
    return Reliability(
        method, group, len(judged), answered, len(right), wrong,
        1000 * wrong / answered if answered else math.nan, 1000 * low, 1000 * high,
        len(squares), float(squares.mean()) if len(squares) else math.nan, *mean_nees_bounds(len(squares)),
        100 * float(np.mean(squares < chi2.ppf(CONFIDENCE, DOF))) if len(squares) else math.nan,
    )  # fmt: skip


def reliabilities(judged: Sequence[tuple[PairResult, Limits]]) -> list[Reliability]:
    """Of each method: its groups in the order they first come in, and all together where there are several."""
    found = []
    for method in dict.fromkeys(result.method for result, _ in judged):
        own = [(result, limits) for result, limits in judged if result.method == method]
        groups = list(dict.fromkeys(result.group for result, _ in own))
        found += [reliability(method, name, [one for one in own if one[0].group == name]) for name in groups]
        if len(groups) > 1:
            found.append(reliability(method, TOTAL, own))
    return found


def write_reliabilities(rows: Sequence[Reliability], path: Path) -> None:
    """A .csv with a row for each. Raises BagError."""
    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(rows[0].as_dict()), lineterminator="\n")
            writer.writeheader()
            writer.writerows(row.as_dict() for row in rows)
    except OSError as error:
        raise BagError(f"{path} cannot be written: {error}") from error


def _span(value: float, low: float, high: float) -> str:
    return f"{_digits(value)} ({_digits(low)} to {_digits(high)})"


def _digits(value: float) -> str:
    if not math.isfinite(value):
        return "-"
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}"
