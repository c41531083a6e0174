# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a sensor saw along its lines of sight: where there is a surface, and where there is none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.camera import Camera


@dataclass(frozen=True, slots=True)
class DepthView:
    """A depth image as evidence of surfaces and of free space."""

    camera: Camera
    depth_m: NDArray[np.float32]
    """(H, W), metres along z, 0 where nothing was measured."""

    def behind(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far each point (N, 3) lies behind the surface seen in its direction, metres along z.

        Negative in front of it, where the sensor looked through; NaN where it saw nothing.
        """
        pixels = self.camera.project(points)
        inside = self.camera.contains(pixels)
        out = np.full(len(points), np.nan)
        column, row = np.rint(pixels[inside]).astype(np.intp).T
        depth_m = self.depth_m[row, column].astype(np.float64)
        out[inside] = np.where(depth_m > 0, points[inside, 2] - depth_m, np.nan)
        return out


@dataclass(frozen=True, slots=True)
class ScanView:
    """A scan as evidence of surfaces and of free space, on a grid of directions around the scanner."""

    nearest_m: NDArray[np.float32]
    """(E, A) shortest range measured in each cell of elevation and azimuth; inf where there is none."""
    farthest_m: NDArray[np.float32]
    """(E, A) longest range; -inf where there is none."""

    @classmethod
    def of(cls, points: NDArray[np.float32]) -> ScanView:
        """The view of the scanner that stands at the origin of these points (N, 3)."""
        cell, distance_m = _directions(points)
        shape = (round(180 / SCAN_CELL_DEG), round(360 / SCAN_CELL_DEG))
        nearest, farthest = np.full(shape, np.inf, np.float32), np.full(shape, -np.inf, np.float32)
        np.minimum.at(nearest, cell, distance_m)
        np.maximum.at(farthest, cell, distance_m)
        return cls(nearest, farthest)

    def behind(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far each point (N, 3) lies behind the surface seen in its direction, metres along the ray.

        0 between the ranges measured in a cell; NaN where nothing was measured, and where a cell holds
        surfaces so far apart that it says nothing.
        """
        cell, distance_m = _directions(points)
        nearest, farthest = self.nearest_m[cell], self.farthest_m[cell]
        out = np.where(distance_m < nearest, distance_m - nearest, np.maximum(distance_m - farthest, 0.0))
        # Where nothing was measured nearest is inf, and so is the allowed spread.
        told = np.isfinite(nearest) & (farthest - nearest < MAX_DEPTH_IN_CELL * nearest)
        return np.where(told, out, np.nan)


SCAN_CELL_DEG = 1.0
"""Cells of a scan's view: no finer than the beams of a 32-beam scanner, so that few cells stay empty."""

MAX_DEPTH_IN_CELL = 0.2
"""A cell whose ranges spread over more than this share shows an edge, not a surface."""


def _directions(
    points: NDArray[np.floating],
) -> tuple[tuple[NDArray[np.intp], NDArray[np.intp]], NDArray[np.floating]]:
    """Cells (rows of elevation, columns of azimuth) and ranges (N,) of points (N, 3)."""
    x, y, z = points.T
    distance_m = np.sqrt(x * x + y * y + z * z)
    scale = 1.0 / np.deg2rad(SCAN_CELL_DEG)
    columns = round(360 / SCAN_CELL_DEG)
    azimuth = ((np.arctan2(y, x) + np.pi) * scale).astype(np.intp) % columns
    elevation = ((np.arctan2(z, np.hypot(x, y)) + np.pi / 2) * scale).astype(np.intp)
    return (np.minimum(elevation, columns // 2 - 1), azimuth), distance_m


View = DepthView | ScanView
