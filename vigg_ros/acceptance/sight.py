# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What one frame saw in the place of another one's surfaces: the same surface, free space, or something before it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.config import Config
from vigg_ros.registration.features import Features
from vigg_ros.registration.matches import CLOSE_SHARE
from vigg_ros.registration.rigid import inverse, transform

TOLERANCE_VOXELS, TOLERANCE_SIGMAS = 2.0, 3.0
"""How far apart surfaces may lie and still coincide: the grid, and the noise of both frames where they are seen."""

MIN_INCIDENCE = 0.2
"""Cosine between line of sight and normal below which a distance along the ray says little."""


@dataclass(frozen=True, slots=True)
class Sight:
    """N patches of one frame, seen from the other."""

    row: NDArray[np.int64]
    points: NDArray[np.float64]
    """(N, 3) in the viewer's frame."""
    behind_m: NDArray[np.float64]
    """(N,) behind the surface that the viewer saw there; NaN where it saw nothing."""
    tolerance_m: NDArray[np.float64]

    def kinds(self) -> NDArray[np.bool_]:
        """(3, N): coinciding, in free space, and hidden."""
        with np.errstate(invalid="ignore"):
            return np.array((
                np.abs(self.behind_m) <= self.tolerance_m,
                self.behind_m < -self.tolerance_m,
                self.behind_m > self.tolerance_m,
            ))


def sights(
    target: Features, source: Features, T_target_source: NDArray[np.float64], config: Config
) -> tuple[Sight, Sight]:
    """The source's patches seen from the target, and the target's from the source."""
    return _see(target, source, T_target_source, config), _see(source, target, inverse(T_target_source), config)


def _see(viewer: Features, other: Features, T_viewer_other: NDArray[np.float64], config: Config) -> Sight:
    """Look at the other frame's patches with the viewer's lines of sight, where these meet them squarely.

    Ground seen at a flat angle would agree with any motion along it: with none at all, above all.
    """
    points = transform(T_viewer_other, other.patches.points)
    normals = other.patches.normals @ T_viewer_other[:3, :3].T
    distance_m = np.linalg.norm(points, axis=1)
    towards = -np.einsum("ni,ni->n", points, normals)
    squarely = np.abs(towards) > MIN_INCIDENCE * distance_m
    own_m = np.linalg.norm(other.patches.points, axis=1)
    sigma_m = np.hypot(viewer.noise.sigma_m(distance_m), other.noise.sigma_m(own_m))
    grid_m = TOLERANCE_VOXELS * config.geometric.voxel_size_m
    if sigma_m.any():  # the paper's method knows no noise
        grid_m = np.minimum(grid_m, CLOSE_SHARE * distance_m)
    tolerance_m = (grid_m + TOLERANCE_SIGMAS * sigma_m)[squarely]
    behind_m = viewer.view.behind(points[squarely])
    # A surface that turns its back cannot be the one that was seen in its place.
    behind_m[(towards[squarely] < 0) & (np.abs(behind_m) <= tolerance_m)] = -np.inf
    return Sight(np.flatnonzero(squarely), points[squarely], behind_m, tolerance_m)
