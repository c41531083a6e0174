# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Two scans aligned in space: nearest points of their surfaces, and matches in space."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.alignment import (
    BLOCK_VOXELS,
    MIN_NORMAL_COSINE,
    NARROW_VOXELS,
    WIDE_VOXELS,
    Residuals,
    cauchy,
    curvature_of,
    deviation,
    few_rows,
    patch_of,
    turned,
)
from vigg_ros.registration.geometric import Surface
from vigg_ros.registration.kernels.cells import CellIndex
from vigg_ros.registration.kernels.symmetric_icp import symmetric_icp_residuals
from vigg_ros.registration.matches import Matches
from vigg_ros.registration.rigid import transform

SCAN_FLOOR_VOXELS, VISUAL_FLOOR_VOXELS = 0.02, 0.1
"""Standard deviation that a point of a scan, and a visual match of one, has at least."""

RESPONSE_SIGMAS = 0.5
"""The shift by which the response of a scan's surfaces is tried, in standard deviations of their distances: within
what the weights answer to evenly."""

MIN_RESPONSE = 0.05
"""Surfaces that respond less are too rough to say how much they do."""


class IndexedSurface:
    """The surface of a scan, indexed once for both search radii."""

    def __init__(self, surface: Surface, voxel_size_m: float) -> None:
        self.voxel_m = voxel_size_m
        self._sorted: dict[float, tuple[CellIndex, Surface]] = {}
        for radius in (WIDE_VOXELS, NARROW_VOXELS):
            index = CellIndex.build(surface.points, radius * voxel_size_m)
            self._sorted[radius] = index, surface.select(index.order)

    def pairs(
        self, source: Surface, T_target_source: NDArray[np.float64], radius_voxels: float
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Rows of the source (K,), distances (K,) along the mean of the two normals, and their Jacobian (K, 6)."""
        index, target = self._sorted[radius_voxels]
        rows, value, jacobian = symmetric_icp_residuals(
            (source.points, source.normals), T_target_source, (target.points, target.normals), index.lookup(),
            radius_voxels * self.voxel_m, MIN_NORMAL_COSINE,
        )
        return rows, value, jacobian


@dataclass(frozen=True, slots=True)
class ScanAlignment:
    """Two scans: nearest points of their surfaces, and matches in space."""

    target: IndexedSurface
    source: Surface
    matches: Matches

    def surface(self, T_target_source: NDArray[np.float64], *, wide: bool = False, few: bool = False) -> Residuals:
        """Distances between the nearest surfaces along the mean of their normals."""
        source = self.source.select(few_rows(len(self.source), few))
        return self._paired(source, T_target_source, WIDE_VOXELS if wide else NARROW_VOXELS)

    def _paired(self, source: Surface, T_target_source: NDArray[np.float64], radius: float) -> Residuals:
        rows, value, jacobian = self.target.pairs(source, T_target_source, radius)
        floor_m = SCAN_FLOOR_VOXELS * self.target.voxel_m
        sigma_m = deviation(value, floor_m) if len(value) else 1.0
        weight = cauchy(value, sigma_m) / sigma_m**2
        patch = patch_of(source.points[rows], BLOCK_VOXELS * self.target.voxel_m)
        return Residuals(value, jacobian, weight, patch, np.full(len(value), floor_m))

    def visual(self, T_target_source: NDArray[np.float64]) -> Residuals:
        """Three residuals for each visual match, along the target's axes."""
        moved = transform(T_target_source, self.matches.source)
        value = self.matches.target - moved
        floor_m = VISUAL_FLOOR_VOXELS * self.target.voxel_m
        weight, curvature = np.empty(0), 1.0
        if len(value):
            size = np.linalg.norm(value, axis=1) / math.sqrt(3)
            sigma_m = deviation(size, floor_m)
            curvature = curvature_of(size, sigma_m, 3)
            weight = np.repeat(cauchy(size, sigma_m) / sigma_m**2, 3)
        jacobian = turned(moved - T_target_source[:3, 3]).reshape(-1, 6)
        cluster = -1 - np.repeat(np.arange(len(value)), 3)
        return Residuals(value.ravel(), jacobian, weight, cluster, np.full(3 * len(value), floor_m), curvature)

    def response(self, T_target_source: NDArray[np.float64], found: Residuals) -> float:
        """How much of a shift along the normals is seen once the surfaces are paired anew: a share in (0, 1].

        Among noisy points the nearest one hides a part of any shift, so ``found`` claims more information
        than there is. Tried with a shift of RESPONSE_SIGMAS of the distances found, either way.
        """
        if len(found) == 0:
            return 1.0
        shift = RESPONSE_SIGMAS * deviation(found.value, SCAN_FLOOR_VOXELS * self.target.voxel_m)
        pull = []
        for step in (-shift, shift):
            shifted = Surface(self.source.points + np.float32(step) * self.source.normals, self.source.normals)
            paired = self._paired(shifted, T_target_source, NARROW_VOXELS)
            pull.append(float(paired.weight @ paired.value))
        share = (pull[0] - pull[1]) / (2 * shift * float(found.weight.sum()))
        return min(max(share, MIN_RESPONSE), 1.0)

    def lever(self, T_target_source: NDArray[np.float64]) -> None:
        """A scanner's ranges hardly err, but the pixels that see its points do: a pixel gets the nearest point."""
