# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How likely an agreement is by chance: the number of false alarms of the a-contrario method.

Desolneux, Moisan and Morel (2000); for motions Moisan and Stival (2004). If n matches were wrong, each would agree with
a motion with some probability p all the same. The number of motions, among all that were tried, with which k or more of
n are expected to agree by chance is the number of false alarms, NFA = tests * P(at least k of n). It needs no threshold
on shares: p is measured in the two frames themselves, with pairings that are wrong by construction, so it knows how far
the matches spread, how they crowd, and how wide the radius is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.matches import Matches

MINIMAL = 3
"""Matches that fix a motion, and so agree with it whatever they are."""

WRONG_PAIRINGS = 24
"""Times that all matches are paired wrongly to measure chance: some thousand pairings tell 1e-3 from 1e-2."""


def cell_weights(points: NDArray[np.floating], cell_m: float) -> NDArray[np.float64]:
    """How much each of N points or pairs of points (N, D) counts: one over the number of those in its cell.

    Neighbours agree together, right or wrong, and count as one trial; the sum is the number of independent ones.
    """
    if len(points) == 0:
        return np.empty(0)
    cells = np.floor(points / cell_m).astype(np.int64)
    cells -= cells.min(axis=0)
    key = np.zeros(len(cells), np.int64)
    for column in cells.T:  # numbers of cells; at 10^18 cells some would share one, which hides evidence and adds none
        key = key * (int(column.max()) + 1) + column
    _, place, counts = np.unique(key, return_inverse=True, return_counts=True)
    return np.asarray(1.0 / counts[place.reshape(-1)])


def log10_tail(agreeing: NDArray[np.float64] | float, trials: float, chance: float) -> NDArray[np.float64]:
    """log10 of a bound on P(at least k of n), n trials of probability p: Hoeffding (1963), exp(-n KL(k / n, p)).

    0 where no more agree than chance lets expect. The bound is never below the binomial tail, and is defined for any
    real k and n.
    """
    share = np.clip(np.asarray(agreeing, np.float64) / max(trials, 1e-9), 0.0, 1.0)
    shares, chances = np.stack((share, 1 - share), axis=-1), np.array((chance, 1 - chance))
    return np.where(share > chance, log10_type_probability(shares, trials, chances), 0.0)


def log10_type_probability(
    shares: NDArray[np.float64], trials: float, chances: NDArray[np.float64]
) -> NDArray[np.float64]:
    """log10 exp(-n KL(shares, chances)), of shares (..., C) of C outcomes: Sanov's exponent of such shares or rarer."""
    with np.errstate(divide="ignore", invalid="ignore"):
        terms = np.where(shares > 0, shares * np.log(shares / chances), 0.0)
    return np.asarray(-trials * terms.sum(axis=-1) / math.log(10))


def log10_joint(tails: Sequence[float]) -> float:
    """log10 P that the product of so many independent probabilities is as small as this one by chance (Fisher 1932)."""
    exponent = -math.log(10) * sum(tails)
    series = sum(exponent**i / math.factorial(i) for i in range(len(tails)))
    return min(sum(tails) + math.log10(series), 0.0)


def log10_triples(trials: float) -> float:
    """log10 of the motions that three of n matches fix: all of them were tried, as the cliques are the best of them."""
    return math.log10(max(math.comb(round(trials), MINIMAL), 1))


def wrong_pairings(matches: Matches, times: int = WRONG_PAIRINGS) -> Matches:
    """Each source point against the target points of other matches: what agrees among these agrees by chance."""
    count = len(matches)
    shifts = np.unique(np.linspace(1, max(count - 1, 1), times).astype(np.int64))[: max(count - 1, 0)]
    source = np.tile(np.arange(count), len(shifts))
    target = (source + np.repeat(shifts, count)) % max(count, 1)
    return Matches(
        matches.target[target], matches.source[source], matches.similarity[source],
        matches.target_row[target], matches.source_row[source], matches.sigma_m[source],
    )
