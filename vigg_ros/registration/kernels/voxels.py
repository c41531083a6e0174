# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One point per occupied voxel: the mean of its points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.kernels.compilation import compiled

HALF_RANGE = 2**20
"""Voxels on each side of the origin, per axis; three axes fit one int64 key."""


@compiled
def voxel_means(points, voxel_size):  # pragma: no cover - compiled
    """Means (V, 3) float32 of points (N, 3) float32, by voxels of a grid that holds the origin as a corner.

    In order of each voxel's first point. Points beyond HALF_RANGE voxels are the caller's to remove.
    """
    n = len(points)
    capacity = 1024
    while capacity < 2 * n:
        capacity *= 2
    # Open addressing; the slot holds a voxel's place in the sums, -1 where free.
    slot_key, slot_place = np.empty(capacity, np.int64), np.full(capacity, -1, np.int32)
    sums, counts = np.zeros((n, 3), np.float64), np.zeros(n, np.int32)
    inverse = 1.0 / voxel_size
    voxels = 0
    for i in range(n):
        key = np.int64(0)
        for axis in range(3):
            key = key * (2 * HALF_RANGE) + np.int64(np.floor(points[i, axis] * inverse)) + HALF_RANGE
        # A multiplicative hash (Knuth): the high bits of the product spread neighbouring keys.
        slot = ((key * np.int64(-7046029254386353131)) >> 20) & (capacity - 1)
        while slot_place[slot] >= 0 and slot_key[slot] != key:
            slot = (slot + 1) & (capacity - 1)
        if slot_place[slot] < 0:
            slot_key[slot], slot_place[slot] = key, voxels
            voxels += 1
        place = slot_place[slot]
        counts[place] += 1
        for axis in range(3):
            sums[place, axis] += points[i, axis]
    means = np.empty((voxels, 3), np.float32)
    for place in range(voxels):
        for axis in range(3):
            means[place, axis] = sums[place, axis] / counts[place]
    return means


def voxel_means_plain(points: NDArray[np.float32], voxel_size: float) -> NDArray[np.float32]:
    """Twin of ``voxel_means``, in order of the voxels' coordinates."""
    voxels = np.floor(points.astype(np.float64) / voxel_size).astype(np.int64)
    _, place, counts = np.unique(voxels, axis=0, return_inverse=True, return_counts=True)
    sums = np.zeros((len(counts), 3))
    np.add.at(sums, place.ravel(), points)
    return (sums / counts[:, None]).astype(np.float32)
