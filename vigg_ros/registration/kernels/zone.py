# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The most similar feature within a radius (paper eq. 11)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.kernels.compilation import compiled


@compiled(fastmath=True)
def nearest_in_zone(queries, query_features, points, features, runs, radius):  # pragma: no cover - compiled
    """For each query (M, 3) the sorted target point within radius whose feature is most similar.

    features are of unit length, so similarity is their dot product. Returns the index (M,), -1 for an
    empty zone, and the similarity (M,).
    """
    m = len(queries)
    found = np.full(m, -1, np.int64)
    similarity = np.zeros(m, np.float32)
    limit = np.float32(radius * radius)
    for i in range(m):
        best = np.float32(-2)
        for run in range(9):
            for j in range(runs[i, run, 0], runs[i, run, 1]):
                dx, dy, dz = points[j, 0] - queries[i, 0], points[j, 1] - queries[i, 1], points[j, 2] - queries[i, 2]
                if dx * dx + dy * dy + dz * dz <= limit:
                    dot = np.float32(0)
                    for b in range(query_features.shape[1]):
                        dot += query_features[i, b] * features[j, b]
                    if dot > best:
                        best = dot
                        found[i] = j
                        similarity[i] = dot
    return found, similarity


def nearest_in_zone_plain(
    queries: NDArray[np.float32],
    query_features: NDArray[np.float32],
    points: NDArray[np.float32],
    features: NDArray[np.float32],
    radius: float,
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Twin of ``nearest_in_zone`` by all pairs."""
    distance = np.linalg.norm(queries[:, None] - points[None], axis=2)
    dots = np.where(distance <= radius, query_features @ features.T, -np.inf)
    found = dots.argmax(axis=1)
    best = dots[np.arange(len(queries)), found]
    empty = np.isneginf(best)
    return np.where(empty, -1, found), np.where(empty, 0, best).astype(np.float32)
