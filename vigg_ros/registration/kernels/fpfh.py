# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fast point feature histograms (Rusu 2009) of points in the sorted order of a cell index."""

from __future__ import annotations

import math

import numpy as np

from vigg_ros.registration.kernels.compilation import compiled

BINS_PER_ANGLE = 11
"""FPFH has three angles."""


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
    a = min(max(int((theta + np.float32(math.pi)) * np.float32(BINS_PER_ANGLE / (2 * math.pi))), 0), BINS_PER_ANGLE - 1)
    b = min(max(int((alpha + np.float32(1)) * np.float32(BINS_PER_ANGLE / 2)), 0), BINS_PER_ANGLE - 1)
    c = min(max(int((phi + np.float32(1)) * np.float32(BINS_PER_ANGLE / 2)), 0), BINS_PER_ANGLE - 1)
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
    spfh = np.zeros((n, 3 * BINS_PER_ANGLE), np.float32)
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
                            spfh[point, BINS_PER_ANGLE + b] += 1
                            spfh[point, 2 * BINS_PER_ANGLE + c] += 1
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
            for b in range(block * BINS_PER_ANGLE, (block + 1) * BINS_PER_ANGLE):
                mass += total[i, b]
            scale = np.float32(100.0) / mass if mass > 0 else np.float32(0)
            for b in range(block * BINS_PER_ANGLE, (block + 1) * BINS_PER_ANGLE):
                total[i, b] = total[i, b] * scale + spfh[i, b]
        norm = np.float32(0)
        for b in range(size):
            norm += total[i, b] * total[i, b]
        if norm > 0:
            total[i] *= np.float32(1.0) / math.sqrt(norm)
    return total
