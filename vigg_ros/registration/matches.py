# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Matched points, wherever they come from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.rigid import transform


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

    def __len__(self) -> int:
        return len(self.target)

    def select(self, rows: NDArray[Any] | slice) -> Matches:
        """Some of the matches, by mask, index or slice."""
        return Matches(
            self.target[rows], self.source[rows], self.similarity[rows], self.target_row[rows], self.source_row[rows]
        )

    def distances(self, T_target_source: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far each target point lies from its moved source point (M,), metres."""
        return np.asarray(np.linalg.norm(transform(T_target_source, self.source) - self.target, axis=1))


def concatenate(first: Matches, second: Matches) -> Matches:
    """Both sets of matches, e.g. C' = C_vis + C_geo; rows then refer to different tables."""
    return Matches(
        np.concatenate((first.target, second.target)),
        np.concatenate((first.source, second.source)),
        np.concatenate((first.similarity, second.similarity)),
        np.concatenate((first.target_row, second.target_row)),
        np.concatenate((first.source_row, second.source_row)),
    )


def no_matches() -> Matches:
    """None at all."""
    points, rows = np.empty((0, 3)), np.empty(0, np.int64)
    return Matches(points, points, np.empty(0), rows, rows)
