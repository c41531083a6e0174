# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Surface descriptions on a cell index: normals and FPFH.

All arrays are in the sorted order of the index.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vigg_ros.registration.kernels.compilation import compiled

BINS = 11
"""Bins per angle; FPFH has three angles (Rusu 2009)."""

MIN_PATCH = 4
"""Points that make a surface: three always lie on a plane."""


LINE_RATIO = 1e-5
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
    if n1 <= (9.0 * LINE_RATIO * spread * spread) ** 2:
        return 0.0, 0.0, 0.0
    scale = 1.0 / math.sqrt(n1)
    return x1 * scale, y1 * scale, z1 * scale


@compiled
def normals(points, starts, runs, radius):  # pragma: no cover - compiled
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
            if k < MIN_PATCH:
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


def normals_plain(points: NDArray[np.float32], radius: float) -> NDArray[np.float64]:
    """Twin of ``normals``, in any order of points."""
    out = np.zeros((len(points), 3))
    for i, rows in enumerate(cKDTree(points).query_ball_point(points, radius)):
        if len(rows) >= MIN_PATCH:
            values, vectors = np.linalg.eigh(np.cov(points[rows].T.astype(np.float64), bias=True))
            if values[1] - values[0] > LINE_RATIO * (values[2] - values[0]):
                out[i] = vectors[:, 0] * (1 if vectors[:, 0] @ points[i] <= 0 else -1)
    return out


@compiled(fastmath=True)
def _pair_bins(dx, dy, dz, distance, na, nb):  # pragma: no cover - compiled
    """Bins of the three angles of a point pair (Rusu 2009; the flatter normal makes the frame).

    Returns (-1, -1, -1) where the frame is undefined: the normal lies along the line.
    """
    inverse = np.float32(1.0) / distance
    ux, uy, uz = dx * inverse, dy * inverse, dz * inverse
    alpha_a = na[0] * ux + na[1] * uy + na[2] * uz
    alpha_b = nb[0] * ux + nb[1] * uy + nb[2] * uz
    if abs(alpha_a) < abs(alpha_b):
        n1x, n1y, n1z, n2x, n2y, n2z = nb[0], nb[1], nb[2], na[0], na[1], na[2]
        ux, uy, uz = -ux, -uy, -uz
        phi = -alpha_b
    else:
        n1x, n1y, n1z, n2x, n2y, n2z = na[0], na[1], na[2], nb[0], nb[1], nb[2]
        phi = alpha_a
    vx, vy, vz = uy * n1z - uz * n1y, uz * n1x - ux * n1z, ux * n1y - uy * n1x
    norm = math.sqrt(vx * vx + vy * vy + vz * vz)
    if norm < np.float32(1e-6):
        return -1, -1, -1
    inverse = np.float32(1.0) / norm
    vx, vy, vz = vx * inverse, vy * inverse, vz * inverse
    wx, wy, wz = n1y * vz - n1z * vy, n1z * vx - n1x * vz, n1x * vy - n1y * vx
    alpha = vx * n2x + vy * n2y + vz * n2z
    theta = math.atan2(wx * n2x + wy * n2y + wz * n2z, n1x * n2x + n1y * n2y + n1z * n2z)
    a = min(max(int((theta + np.float32(math.pi)) * np.float32(BINS / (2 * math.pi))), 0), BINS - 1)
    b = min(max(int((alpha + np.float32(1)) * np.float32(BINS / 2)), 0), BINS - 1)
    c = min(max(int((phi + np.float32(1)) * np.float32(BINS / 2)), 0), BINS - 1)
    return a, b, c


@compiled
def _count_pairs(points, starts, runs, limit):  # pragma: no cover - compiled
    total = 0
    for cell in range(len(starts) - 1):
        for i in range(starts[cell], starts[cell + 1]):
            for run in range(9):
                for j in range(max(runs[cell, run, 0], i + 1), runs[cell, run, 1]):
                    dx, dy, dz = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
                    total += dx * dx + dy * dy + dz * dz <= limit
    return total


@compiled(fastmath=True)
def fpfh(points, normals, starts, runs, radius):  # pragma: no cover - compiled
    """FPFH (N, 33) float32 of unit length (0 without neighbours), each pair computed once.

    The pair list costs 12 bytes a pair; on a voxel grid a radius of five voxels holds about 80
    neighbours on a surface.
    """
    n = len(points)
    limit = np.float32(radius * radius)
    pairs = _count_pairs(points, starts, runs, limit)
    first, second, weight = np.empty(pairs, np.int32), np.empty(pairs, np.int32), np.empty(pairs, np.float32)
    spfh = np.zeros((n, 3 * BINS), np.float32)
    count = np.zeros(n, np.int32)
    k = 0
    for cell in range(len(starts) - 1):
        for i in range(starts[cell], starts[cell + 1]):
            for run in range(9):
                for j in range(max(runs[cell, run, 0], i + 1), runs[cell, run, 1]):
                    dx, dy, dz = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
                    d2 = dx * dx + dy * dy + dz * dz
                    if d2 > limit or d2 == 0:
                        continue
                    a, b, c = _pair_bins(dx, dy, dz, math.sqrt(d2), normals[i], normals[j])
                    if a >= 0:
                        for point in (i, j):
                            spfh[point, a] += 1
                            spfh[point, BINS + b] += 1
                            spfh[point, 2 * BINS + c] += 1
                    count[i] += 1
                    count[j] += 1
                    first[k], second[k], weight[k] = i, j, np.float32(1.0) / d2
                    k += 1
    for i in range(n):
        if count[i] > 0:
            spfh[i] *= np.float32(100.0) / count[i]
    return _weigh(spfh, first[:k], second[:k], weight[:k])


@compiled(fastmath=True)
def _weigh(spfh, first, second, weight):  # pragma: no cover - compiled
    """Each point's own histogram plus its neighbours', by inverse squared distance, then unit length."""
    n, size = spfh.shape
    total = np.zeros((n, size), np.float32)
    for k in range(len(first)):
        i, j, w = first[k], second[k], weight[k]
        for b in range(size):
            total[i, b] += w * spfh[j, b]
            total[j, b] += w * spfh[i, b]
    for i in range(n):
        for block in range(3):
            mass = np.float32(0)
            for b in range(block * BINS, (block + 1) * BINS):
                mass += total[i, b]
            scale = np.float32(100.0) / mass if mass > 0 else np.float32(0)
            for b in range(block * BINS, (block + 1) * BINS):
                total[i, b] = total[i, b] * scale + spfh[i, b]
        norm = np.float32(0)
        for b in range(size):
            norm += total[i, b] * total[i, b]
        if norm > 0:
            total[i] *= np.float32(1.0) / math.sqrt(norm)
    return total
