# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Symmetric point-to-plane residuals (Rusinkiewicz 2019) of samples that project into a grid of planes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.kernels.compilation import compiled


@compiled
def projective_icp_residuals(samples, T, planes, camera, step, limits):  # pragma: no cover - compiled
    """For each sample the plane that is seen in its direction, if it is near and both face the same way.

    samples: points (N, 3), normals (N, 3) and deviations (N,) along the line of sight, metres. planes: (h, w, 5) of
    ``depth_planes``, with deviations along the line of sight (h, w). camera: fx, fy, cx, cy. limits: the distance in
    standard deviations, the least of it in metres, and the cosine of the normals. Returns rows (K,) of the samples;
    values (K,): distances along the mean of the two normals; standard deviations (K,) of them; and the Jacobian (K, 6)
    with regard to a translation and a rotation about the moved origin of the source.
    """
    points, normals, sigmas = samples
    grid, grid_sigmas = planes
    fx, fy, cx, cy = camera
    max_sigmas, least, min_cosine = limits
    n = len(points)
    rows, values, deviations = np.empty(n, np.int64), np.empty(n), np.empty(n)
    jacobian = np.empty((n, 6))
    kept = 0
    for k in range(n):
        ax = T[0, 0] * points[k, 0] + T[0, 1] * points[k, 1] + T[0, 2] * points[k, 2]
        ay = T[1, 0] * points[k, 0] + T[1, 1] * points[k, 1] + T[1, 2] * points[k, 2]
        az = T[2, 0] * points[k, 0] + T[2, 1] * points[k, 1] + T[2, 2] * points[k, 2]
        x, y, z = ax + T[0, 3], ay + T[1, 3], az + T[2, 3]
        if z <= 0:
            continue
        column, row = np.floor((fx * x / z + cx + 0.5) / step), np.floor((fy * y / z + cy + 0.5) / step)
        if not (0 <= row < grid.shape[0] and 0 <= column < grid.shape[1]):
            continue
        i, j = int(row), int(column)
        depth = grid[i, j, 0]
        if depth <= 0:
            continue
        nx = T[0, 0] * normals[k, 0] + T[0, 1] * normals[k, 1] + T[0, 2] * normals[k, 2]
        ny = T[1, 0] * normals[k, 0] + T[1, 1] * normals[k, 1] + T[1, 2] * normals[k, 2]
        nz = T[2, 0] * normals[k, 0] + T[2, 1] * normals[k, 1] + T[2, 2] * normals[k, 2]
        tx, ty, tz = grid[i, j, 1], grid[i, j, 2], grid[i, j, 3]
        if nx * tx + ny * ty + nz * tz <= min_cosine:
            continue
        # Each error lies along its own line of sight, and counts by that line's cosine to the normal.
        ray_x, ray_y = (j * step + step // 2 - cx) / fx, (i * step + step // 2 - cy) / fy
        own = np.sqrt(ax * ax + ay * ay + az * az)
        slant = (nx * ax + ny * ay + nz * az) / own * sigmas[k]
        seen = (tx * ray_x + ty * ray_y + tz) / np.sqrt(ray_x * ray_x + ray_y * ray_y + 1.0) * grid_sigmas[i, j]
        deviation = np.sqrt(slant * slant + seen * seen)
        nx, ny, nz = nx + tx, ny + ty, nz + tz
        scale = 1.0 / np.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx * scale, ny * scale, nz * scale
        value = (ray_x * depth - x) * nx + (ray_y * depth - y) * ny + (depth - z) * nz
        if abs(value) > max(max_sigmas * deviation, least):
            continue
        rows[kept], values[kept], deviations[kept] = k, value, deviation
        jacobian[kept, 0], jacobian[kept, 1], jacobian[kept, 2] = nx, ny, nz
        jacobian[kept, 3] = ay * nz - az * ny
        jacobian[kept, 4] = az * nx - ax * nz
        jacobian[kept, 5] = ax * ny - ay * nx
        kept += 1
    return rows[:kept], values[:kept], deviations[:kept], jacobian[:kept]


def projective_icp_residuals_plain(
    samples: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]],
    T_target_source: NDArray[np.float64],
    planes: tuple[NDArray[np.float32], NDArray[np.float32]],
    camera: tuple[float, float, float, float],
    step: int,
    limits: tuple[float, float, float],
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Twin of ``projective_icp_residuals``."""
    points, normals, sigmas = samples
    grid, grid_sigmas = planes
    fx, fy, cx, cy = camera
    R = T_target_source[:3, :3]
    rotated = points.astype(np.float64) @ R.T
    moved = rotated + T_target_source[:3, 3]
    rows = np.flatnonzero(moved[:, 2] > 0)
    u, v = fx * moved[rows, 0] / moved[rows, 2] + cx, fy * moved[rows, 1] / moved[rows, 2] + cy
    i, j = np.floor((v + 0.5) / step), np.floor((u + 0.5) / step)
    inside = (i >= 0) & (i < grid.shape[0]) & (j >= 0) & (j < grid.shape[1])
    rows, i, j = rows[inside], i[inside].astype(int), j[inside].astype(int)
    own, seen = normals[rows].astype(np.float64) @ R.T, grid[i, j, 1:4].astype(np.float64)
    kept = (grid[i, j, 0] > 0) & (np.einsum("ni,ni->n", own, seen) > limits[2])
    rows, i, j, own, seen = rows[kept], i[kept], j[kept], own[kept], seen[kept]
    ray = np.column_stack(((j * step + step // 2 - cx) / fx, (i * step + step // 2 - cy) / fy, np.ones(len(i))))
    slant = np.einsum("ni,ni->n", own, rotated[rows]) / np.linalg.norm(rotated[rows], axis=1) * sigmas[rows]
    across = np.einsum("ni,ni->n", seen, ray) / np.linalg.norm(ray, axis=1) * grid_sigmas[i, j]
    deviation = np.hypot(slant, across)
    mean = own + seen
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    value = np.einsum("ni,ni->n", ray * grid[i, j, :1] - moved[rows], mean)
    near = np.abs(value) <= np.maximum(limits[0] * deviation, limits[1])
    jacobian = np.hstack((mean, np.cross(rotated[rows], mean)))
    return rows[near], value[near], deviation[near], jacobian[near]
