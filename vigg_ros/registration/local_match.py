# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Visual-guided geometric matching (VGM, paper 3.3) and the fit (3.4)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.geometric import Landmarks
from vigg_ros.registration.kernels.cells import CellIndex
from vigg_ros.registration.kernels.zone import nearest_in_zone
from vigg_ros.registration.matches import Matches, concatenate
from vigg_ros.registration.options import LocalMatchConfig
from vigg_ros.registration.rigid import transform, weighted_svd
from vigg_ros.registration.stages import stage

REFIT_ROUNDS = 20
"""Rounds of post-refinement at most (SC2-PCR)."""


@dataclass(frozen=True, slots=True)
class ErrorDistribution:
    """How the errors of the prior matches spread under a motion."""

    inliers: NDArray[np.bool_]
    """(M,) pseudo-inliers: matches within the threshold (eq. 7)."""
    variance_m2: float
    """sigma^2 per axis: the mean squared distance over 3 (eq. 8); inf with fewer than 3 pseudo-inliers."""


def error_distribution(
    prior: Matches, T_target_source: NDArray[np.float64], threshold_m: float
) -> ErrorDistribution:
    """Pseudo-inliers and variance of the prior matches under a motion (eq. 7, 8)."""
    distance = prior.distances(T_target_source)
    inliers = distance < prior.radii_m(threshold_m)
    if np.count_nonzero(inliers) < 3:
        return ErrorDistribution(inliers, math.inf)
    # Distances by noise tell how far points are off, not how far the motion is.
    bounded_m = np.minimum(distance[inliers], threshold_m)
    return ErrorDistribution(inliers, float(np.mean(bounded_m**2)) / 3.0)


def search_zone_m2(variance_m2: float, gamma_squared: float) -> float:
    """epsilon = gamma^2 sigma^2: the squared radius of the search zone (eq. 9, 10)."""
    return gamma_squared * variance_m2


def max_zone_radius_m(threshold_m: float, config: LocalMatchConfig) -> float:
    """The largest radius that eq. 10 can give: pseudo-inliers are nearer than the threshold."""
    if config.fixed_zone_m > 0:
        return config.fixed_zone_m
    return math.sqrt(search_zone_m2(threshold_m**2 / 3.0, config.gamma_squared))


class LocalMatcher:
    """The target's landmarks, indexed once for the largest zone that can occur."""

    def __init__(self, target: Landmarks, max_radius_m: float) -> None:
        self.max_radius_m = max_radius_m
        self._index = CellIndex.build(target.points, max_radius_m)
        self._sorted = target.select(self._index.order)

    def match(self, source: Landmarks, T_target_source: NDArray[np.float64], radius_m: float) -> Matches:
        """For each source landmark the most similar target landmark in its zone (eq. 11); empty zones drop it."""
        moved = transform(T_target_source, source.points).astype(np.float32)
        found, similarity = nearest_in_zone(
            moved, source.features, self._sorted.points, self._sorted.features, self._index.runs_at(moved), radius_m
        )
        rows = np.flatnonzero(found >= 0)
        found = found[rows]
        return Matches(
            self._sorted.points[found].astype(np.float64),
            source.points[rows].astype(np.float64),
            np.clip(similarity[rows], 0.0, 1.0).astype(np.float64),
            self._index.order[found],
            rows,
            np.hypot(self._sorted.sigma_m[found], source.sigma_m[rows]),
        )


@stage("local matches")
def guided_fit(
    matcher: LocalMatcher,
    source: Landmarks,
    prior: Matches,
    T_target_source: NDArray[np.float64],
    threshold_m: float,
    config: LocalMatchConfig,
) -> NDArray[np.float64]:
    """Rounds of local matching and weighted fit (eq. 5-12), then post-refinement; the zone only shrinks.

    Without a prior (fewer than three pseudo-inliers) the motion is returned as it came.
    """
    epsilon_m2 = math.inf
    matches = prior.select(slice(0))
    for _ in range(config.iterations):
        errors = error_distribution(prior, T_target_source, threshold_m)
        epsilon_m2 = min(epsilon_m2, search_zone_m2(errors.variance_m2, config.gamma_squared))
        if not math.isfinite(epsilon_m2):
            return T_target_source
        if config.fixed_zone_m > 0:
            epsilon_m2 = config.fixed_zone_m**2
        local = matcher.match(source, T_target_source, math.sqrt(epsilon_m2))
        matches = concatenate(local, prior.select(errors.inliers))
        fitted, determined = weighted_svd(matches.target, matches.source, matches.similarity)
        if not determined:
            return T_target_source
        T_target_source = fitted
    return refit(matches, T_target_source, math.sqrt(epsilon_m2) / 2) if len(matches) else T_target_source


def refit(matches: Matches, T_target_source: NDArray[np.float64], threshold_m: float) -> NDArray[np.float64]:
    """Re-select inliers and fit them, weight 1 / (1 + (d / threshold)^2), until no more are won (SC2-PCR)."""
    won = 0
    for _ in range(REFIT_ROUNDS):
        distance = matches.distances(T_target_source)
        inliers = distance < threshold_m
        if np.count_nonzero(inliers) <= won:
            break
        won = int(np.count_nonzero(inliers))
        weight = inliers / (1.0 + (distance / max(threshold_m, 1e-12)) ** 2)
        fitted, determined = weighted_svd(matches.target, matches.source, weight)
        if not determined:
            break
        T_target_source = fitted
    return T_target_source
