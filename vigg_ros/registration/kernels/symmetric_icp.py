# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Correspondences of two surfaces under a motion, with their symmetric point-to-plane residuals (Rusinkiewicz 2019)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.kernels.compilation import compiled


@compiled
def _nearest_neighbour(x, y, z, points, index, radius):  # pragma: no cover - compiled
    """The sorted point nearest to a place within the radius, -1 if there is none; see ``CellIndex.lookup``."""
    origin, cell_size, shape, keys, starts, known, steps = index
    cx = np.floor((x - origin[0]) / cell_size) + 1
    cy = np.floor((y - origin[1]) / cell_size) + 1
    cz = np.floor((z - origin[2]) / cell_size) + 1
    # Also keeps NaN and what int64 cannot hold from becoming a key.
    if not (0 <= cx < shape[0] and 0 <= cy < shape[1] and 0 <= cz < shape[2]):
        return -1
    key = (np.int64(cx) * shape[1] + np.int64(cy)) * shape[2] + np.int64(cz)
    place = np.searchsorted(keys, key)
    occupied = place < len(keys) and keys[place] == key
    best, found = np.float32(radius * radius), -1
    # How far the columns of cells on either side are; those beyond the nearest point so far are skipped.
    west, south = (x - origin[0]) - (cx - 1) * cell_size, (y - origin[1]) - (cy - 1) * cell_size
    aside_x, aside_y = (west, 0.0, cell_size - west), (south, 0.0, cell_size - south)
    fx, fy, fz = np.float32(x), np.float32(y), np.float32(z)
    for k in (4, 1, 3, 5, 7, 0, 2, 6, 8):  # the point's own column first
        if aside_x[k // 3] ** 2 + aside_y[k % 3] ** 2 > best:
            continue
        if occupied:
            begin, end = known[place, k, 0], known[place, k, 1]
        else:
            begin = starts[np.searchsorted(keys, key + steps[k] - 1)]
            end = starts[np.searchsorted(keys, key + steps[k] + 1, side="right")]
        for j in range(begin, end):
            dx, dy, dz = points[j, 0] - fx, points[j, 1] - fy, points[j, 2] - fz
            distance = dx * dx + dy * dy + dz * dz
            if distance <= best:
                best, found = distance, j
    return found


@compiled
def _rotated(R, vector):  # pragma: no cover - compiled
    return (
        R[0, 0] * vector[0] + R[0, 1] * vector[1] + R[0, 2] * vector[2],
        R[1, 0] * vector[0] + R[1, 1] * vector[1] + R[1, 2] * vector[2],
        R[2, 0] * vector[0] + R[2, 1] * vector[1] + R[2, 2] * vector[2],
    )


@compiled
def symmetric_icp_residuals(source, T, target, index, radius, min_cosine):  # pragma: no cover - compiled
    """For each source point the nearest target point within the radius, if both face the same way.

    ``source`` and ``target`` are points (N, 3) and normals (N, 3); the target is sorted by the cells of ``index`` (see
    ``CellIndex.lookup``), whose size is at least the radius. Returns rows (K,) of the source, values (K,):
    distances along the mean of the two normals, and their Jacobian (K, 6) with regard to a translation and a
    rotation about the moved origin of the source.
    """
    points, normals = source
    target_points, target_normals = target
    n = len(points)
    rows, values, jacobian = np.empty(n, np.int64), np.empty(n, np.float64), np.empty((n, 6), np.float64)
    kept = 0
    for i in range(n):
        ax, ay, az = _rotated(T, points[i])  # relative to the moved origin
        px, py, pz = ax + T[0, 3], ay + T[1, 3], az + T[2, 3]
        j = _nearest_neighbour(px, py, pz, target_points, index, radius)
        if j < 0:
            continue
        nx, ny, nz = _rotated(T, normals[i])
        tx, ty, tz = target_normals[j, 0], target_normals[j, 1], target_normals[j, 2]
        if nx * tx + ny * ty + nz * tz <= min_cosine:
            continue
        nx, ny, nz = nx + tx, ny + ty, nz + tz
        scale = 1.0 / np.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx * scale, ny * scale, nz * scale
        x, y, z = target_points[j]
        rows[kept], values[kept] = i, (x - px) * nx + (y - py) * ny + (z - pz) * nz
        jacobian[kept, 0], jacobian[kept, 1], jacobian[kept, 2] = nx, ny, nz
        jacobian[kept, 3] = ay * nz - az * ny
        jacobian[kept, 4] = az * nx - ax * nz
        jacobian[kept, 5] = ax * ny - ay * nx
        kept += 1
    return rows[:kept], values[:kept], jacobian[:kept]


def symmetric_icp_residuals_plain(
    source: tuple[NDArray[np.float32], NDArray[np.float32]],
    T_target_source: NDArray[np.float64],
    target: tuple[NDArray[np.float32], NDArray[np.float32]],
    *,
    radius: float,
    min_cosine: float,
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Twin of ``symmetric_icp_residuals`` by all pairs; the target is in any order."""
    points, normals = source
    rotated = points @ T_target_source[:3, :3].T
    moved = rotated + T_target_source[:3, 3]
    distance = np.linalg.norm(moved[:, None] - target[0][None], axis=2)
    nearest = distance.argmin(axis=1)
    source_normals = normals @ T_target_source[:3, :3].T
    near = distance[np.arange(len(points)), nearest] <= radius
    facing = np.einsum("ni,ni->n", target[1][nearest], source_normals) > min_cosine
    rows = np.flatnonzero(near & facing)
    mean = source_normals[rows] + target[1][nearest[rows]]
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    values = np.einsum("ni,ni->n", target[0][nearest[rows]] - moved[rows], mean)
    return rows, values, np.hstack((mean, np.cross(rotated[rows], mean)))
