# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Normals of points in the sorted order of a cell index."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vigg_ros.registration.kernels.compilation import compiled

MIN_NORMAL_POINTS = 4
"""Points that make a surface: three always lie on a plane."""

COLLINEAR_VARIANCE_RATIO = 1e-5
"""Variance across a patch over that along it up to which it is a line, whose normal is rounding: 1 to 300."""


@compiled
def _smallest_eigenvector(xx, xy, xz, yy, yz, zz):  # pragma: no cover - compiled
    """Unit eigenvector of the smallest eigenvalue of a symmetric matrix, by the trigonometric solution."""
    mean = (xx + yy + zz) / 3.0
    a, b, c = xx - mean, yy - mean, zz - mean
    spread = math.sqrt((a * a + b * b + c * c + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0)
    if spread <= 1e-12 * mean or spread == 0.0:
        return 0.0, 0.0, 0.0
    determinant = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)
    cosine = min(max(0.5 * determinant / (spread * spread * spread), -1.0), 1.0)
    smallest = 2.0 * spread * math.cos(math.acos(cosine) / 3.0 + 2.0 * math.pi / 3.0)
    a, b, c = a - smallest, b - smallest, c - smallest
    # The eigenvector is normal to the rows; take the best conditioned of the three cross products.
    x1, y1, z1 = xy * yz - xz * b, xz * xy - a * yz, a * b - xy * xy
    x2, y2, z2 = xy * c - xz * yz, xz * xz - a * c, a * yz - xy * xz
    x3, y3, z3 = b * c - yz * yz, yz * xz - xy * c, xy * yz - b * xz
    n1, n2, n3 = x1 * x1 + y1 * y1 + z1 * z1, x2 * x2 + y2 * y2 + z2 * z2, x3 * x3 + y3 * y3 + z3 * z3
    if n2 > n1 and n2 >= n3:
        x1, y1, z1, n1 = x2, y2, z2, n2
    elif n3 > n1:
        x1, y1, z1, n1 = x3, y3, z3, n3
    # A line of variance 3 spread has a cross product of 3 spread times the variance across it.
    if n1 <= (9.0 * COLLINEAR_VARIANCE_RATIO * spread * spread) ** 2:
        return 0.0, 0.0, 0.0
    scale = 1.0 / math.sqrt(n1)
    return x1 * scale, y1 * scale, z1 * scale


@compiled
def surface_normals(points, starts, runs, radius):  # pragma: no cover - compiled
    """Unit normals (N, 3) float32 from the neighbours within radius, turned towards the origin.

    Zero where there are fewer than four points, or where they lie on a line: no surface is known there.
    """
    limit = np.float32(radius * radius)
    out = np.zeros((len(points), 3), np.float32)
    for cell in range(len(starts) - 1):
        for i in range(starts[cell], starts[cell + 1]):
            px, py, pz = points[i, 0], points[i, 1], points[i, 2]
            sx = sy = sz = np.float32(0)
            xx = xy = xz = yy = yz = zz = np.float32(0)
            k = 0
            for run in range(9):
                for j in range(runs[cell, run, 0], runs[cell, run, 1]):
                    # Differences to the point itself keep float32 precise far from the origin.
                    dx, dy, dz = points[j, 0] - px, points[j, 1] - py, points[j, 2] - pz
                    if dx * dx + dy * dy + dz * dz <= limit:
                        k += 1
                        sx, sy, sz = sx + dx, sy + dy, sz + dz
                        xx, xy, xz = xx + dx * dx, xy + dx * dy, xz + dx * dz
                        yy, yz, zz = yy + dy * dy, yz + dy * dz, zz + dz * dz
            if k < MIN_NORMAL_POINTS:
                continue
            m = 1.0 / k
            nx, ny, nz = _smallest_eigenvector(
                xx - sx * sx * m,
                xy - sx * sy * m,
                xz - sx * sz * m,
                yy - sy * sy * m,
                yz - sy * sz * m,
                zz - sz * sz * m,
            )
            side = 1.0 if nx * px + ny * py + nz * pz <= 0 else -1.0
            out[i, 0], out[i, 1], out[i, 2] = side * nx, side * ny, side * nz
    return out


def surface_normals_plain(points: NDArray[np.float32], radius: float) -> NDArray[np.float64]:
    """Twin of ``surface_normals``, in any order of points."""
    out = np.zeros((len(points), 3))
    for i, rows in enumerate(cKDTree(points).query_ball_point(points, radius)):
        if len(rows) >= MIN_NORMAL_POINTS:
            values, vectors = np.linalg.eigh(np.cov(points[rows].T.astype(np.float64), bias=True))
            if values[1] - values[0] > COLLINEAR_VARIANCE_RATIO * (values[2] - values[0]):
                out[i] = vectors[:, 0] * (1 if vectors[:, 0] @ points[i] <= 0 else -1)
    return out
