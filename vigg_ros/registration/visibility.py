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
class Agreement:
    """Shares of one cloud's points, by what the other sensor saw in their place."""

    overlap: float
    """On a surface that the other sensor saw too."""
    in_front: float
    """Where the other sensor looked through: free-space conflict."""
    hidden: float
    """Behind a surface that the other sensor saw."""

    @property
    def consistency(self) -> float:
        """Of the points that the other sensor should have seen, the share that it did see there."""
        seen = self.overlap + self.in_front + self.hidden
        return self.overlap / seen if seen > 0 else 0.0

    @property
    def balance(self) -> float:
        """Shares that speak for a motion minus those that speak against it, in [-1, 1]."""
        return self.overlap - self.in_front - self.hidden


def agreement(behind_m: NDArray[np.float64], tolerance_m: NDArray[np.float64]) -> Agreement:
    """Count the points (N,) by their place relative to the seen surface; NaN counts for nothing."""
    if len(behind_m) == 0:
        return Agreement(0.0, 0.0, 0.0)
    with np.errstate(invalid="ignore"):
        shares = [np.mean(m) for m in (np.abs(behind_m) <= tolerance_m, behind_m < -tolerance_m, behind_m > tolerance_m)]
    return Agreement(*map(float, shares))
