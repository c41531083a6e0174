# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Matched points, wherever they come from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.rigid import transform

CLOSE_SHARE = 0.05
"""A threshold t of 10 cm for rooms, in which matches lie 2 m away and more, as a share of the distance."""

NOISE_SIGMAS = 3.0
"""Standard deviations by which a measured distance may be off."""

FAR_THRESHOLDS = 3.0
"""Beyond so many thresholds a distance says nothing about what is one place and what another."""


@dataclass(frozen=True, slots=True)
class Matches:
    """M matched points, target beside source, metres, each in its own frame."""

    target: NDArray[np.float64]
    """(M, 3)"""
    source: NDArray[np.float64]
    """(M, 3)"""
    similarity: NDArray[np.float64]
    """(M,) in [0, 1]: cosine similarity of the features, the weight in the fit (paper eq. 12)."""
    target_row: NDArray[np.int64]
    """(M,) row of the keypoint or landmark in its frame's features."""
    source_row: NDArray[np.int64]
    sigma_m: NDArray[np.float64]
    """(M,) standard deviation of the distance between the two, as far as their sensors' noise makes it."""

    def __len__(self) -> int:
        return len(self.target)

    def select(self, rows: NDArray[Any] | slice) -> Matches:
        """Some of the matches, by mask, index or slice."""
        return Matches(
            self.target[rows], self.source[rows], self.similarity[rows], self.target_row[rows], self.source_row[rows],
            self.sigma_m[rows],
        )

    def distances(self, T_target_source: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far each target point lies from its moved source point (M,), metres."""
        return np.asarray(np.linalg.norm(transform(T_target_source, self.source) - self.target, axis=1))

    def radii_m(self, threshold_m: float) -> NDArray[np.float64]:
        """How far apart the two points of each match may lie and still agree (M,), metres.

        The threshold t, or CLOSE_SHARE of the distance where that is less: 10 cm tell nothing about a shelf half a
        metre away. To it comes the noise, up to FAR_THRESHOLDS in all. Without noise it is t, as in the paper.
        """
        if not self.sigma_m.any():
            return np.full(len(self), threshold_m)
        distance_m = np.minimum(np.linalg.norm(self.target, axis=1), np.linalg.norm(self.source, axis=1))
        close_m = np.minimum(threshold_m, CLOSE_SHARE * distance_m)
        return np.asarray(np.minimum(np.hypot(close_m, NOISE_SIGMAS * self.sigma_m), FAR_THRESHOLDS * threshold_m))

    def agree(self, T_target_source: NDArray[np.float64], threshold_m: float) -> NDArray[np.bool_]:
        """Which matches (M,) lie within their radius under a motion."""
        return np.asarray(self.distances(T_target_source) < self.radii_m(threshold_m))


def concatenate(first: Matches, second: Matches) -> Matches:
    """Both sets of matches, e.g. C' = C_vis + C_geo; rows then refer to different tables."""
    return Matches(
        np.concatenate((first.target, second.target)),
        np.concatenate((first.source, second.source)),
        np.concatenate((first.similarity, second.similarity)),
        np.concatenate((first.target_row, second.target_row)),
        np.concatenate((first.source_row, second.source_row)),
        np.concatenate((first.sigma_m, second.sigma_m)),
    )


def no_matches() -> Matches:
    """None at all."""
    points, rows = np.empty((0, 3)), np.empty(0, np.int64)
    return Matches(points, points, np.empty(0), rows, rows, np.empty(0))
