# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One point per occupied voxel: the mean of its points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.kernels.compilation import compiled

HALF_RANGE_VOXELS = 2**20
"""Voxels on each side of the origin, per axis; three axes fit one int64 key."""


@compiled
def _slot_of(key, slot_key, slot_place):  # pragma: no cover - compiled
    """Where the key is, or the free slot where it belongs: open addressing, a slot without a place is free."""
    # A multiplicative hash (Knuth); only the highest bits of the product hold something of all three axes.
    slot = ((key * np.int64(-7046029254386353131)) >> 40) & (len(slot_key) - 1)
    while slot_place[slot] >= 0 and slot_key[slot] != key:
        slot = (slot + 1) & (len(slot_key) - 1)
    return slot


@compiled
def _accumulate(points, begin, grid, slots, sums, voxels):  # pragma: no cover - compiled
    """Add points from ``begin`` on to the sums (K, 4) of their voxels: x, y, z and their number.

    ``grid`` is 1 / voxel size, and the squares of the ranges. Returns where it stopped for want of room, and the
    number of voxels.
    """
    inverse, low, high = grid
    limit = np.float64(HALF_RANGE_VOXELS)
    slot_key, slot_place = slots
    last_key, place = np.int64(-1), np.int64(0)
    for i in range(begin, len(points)):
        x, y, z = np.float64(points[i, 0]), np.float64(points[i, 1]), np.float64(points[i, 2])
        squared = x * x + y * y + z * z
        cx, cy, cz = np.floor(x * inverse), np.floor(y * inverse), np.floor(z * inverse)
        inside = -limit <= cx < limit and -limit <= cy < limit and -limit <= cz < limit
        if not (low <= squared <= high and inside):
            continue
        key = (np.int64(cx) + HALF_RANGE_VOXELS) * (2 * HALF_RANGE_VOXELS) + np.int64(cy) + HALF_RANGE_VOXELS
        key = key * (2 * HALF_RANGE_VOXELS) + np.int64(cz) + HALF_RANGE_VOXELS
        if key != last_key:  # neighbours in an image or a scan mostly share a voxel
            slot = _slot_of(key, slot_key, slot_place)
            if slot_place[slot] < 0:
                if voxels == len(sums):
                    return i, voxels
                slot_key[slot], slot_place[slot] = key, voxels
                voxels += 1
            place, last_key = np.int64(slot_place[slot]), key
        sums[place, 0] += x
        sums[place, 1] += y
        sums[place, 2] += z
        sums[place, 3] += 1
    return len(points), voxels


@compiled
def voxel_means(points, voxel_size, nearest, farthest):  # pragma: no cover - compiled
    """Means (V, 3) float32 of points (N, 3) float32, by voxels of a grid that holds the origin as a corner.

    In order of each voxel's first point. Points nearer to the origin than ``nearest``, beyond ``farthest``, or beyond
    HALF_RANGE_VOXELS voxels along an axis are left out.
    """
    grid = (1.0 / voxel_size, nearest * nearest, farthest * farthest)
    room = 1 << 14
    sums = np.zeros((room, 4))
    slots = (np.empty(2 * room, np.int64), np.full(2 * room, -1, np.int32))
    done, voxels = _accumulate(points, 0, grid, slots, sums, 0)
    while done < len(points):
        room *= 4
        more_sums = np.zeros((room, 4))
        more_sums[:voxels] = sums
        more_slots = (np.empty(2 * room, np.int64), np.full(2 * room, -1, np.int32))
        for old in range(len(slots[0])):
            if slots[1][old] >= 0:
                slot = _slot_of(slots[0][old], more_slots[0], more_slots[1])
                more_slots[0][slot], more_slots[1][slot] = slots[0][old], slots[1][old]
        sums, slots = more_sums, more_slots
        done, voxels = _accumulate(points, done, grid, slots, sums, voxels)
    means = np.empty((voxels, 3), np.float32)
    for place in range(voxels):
        for axis in range(3):
            means[place, axis] = sums[place, axis] / sums[place, 3]
    return means


def voxel_means_plain(
    points: NDArray[np.float32], voxel_size: float, nearest: float, farthest: float
) -> NDArray[np.float32]:
    """Twin of ``voxel_means``, in order of the voxels' coordinates."""
    exact = points.astype(np.float64)
    squared = np.einsum("ni,ni->n", exact, exact)
    inside = (np.abs(exact) < HALF_RANGE_VOXELS * voxel_size).all(axis=1)
    exact = exact[(squared >= nearest**2) & (squared <= farthest**2) & inside]
    voxels = np.floor(exact * (1.0 / voxel_size)).astype(np.int64)
    _, place, counts = np.unique(voxels, axis=0, return_inverse=True, return_counts=True)
    sums = np.zeros((len(counts), 3))
    np.add.at(sums, place.ravel(), exact)
    return (sums / counts[:, None]).astype(np.float32)
