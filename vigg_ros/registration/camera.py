# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The pinhole camera: project and lift. Distorted images are rectified before they get here."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import DataError


@dataclass(frozen=True, slots=True)
class Camera:
    """Intrinsics of a rectified image, in the optical frame of REP-103 (x right, y down, z forward).

    Pixel coordinates have their origin at the centre of the top-left pixel (OpenCV's convention).
    """

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float

    def __post_init__(self) -> None:
        sizes = (self.width_px, self.height_px)
        numbers = (self.fx_px, self.fy_px, self.cx_px, self.cy_px)
        if min(sizes) < 1 or not all(map(math.isfinite, numbers)) or min(self.fx_px, self.fy_px) <= 0:
            raise DataError(
                "BAD_INTRINSICS", found=f"size {sizes}, fx fy cx cy {numbers}",
                expected="a size of at least 1x1 and finite intrinsics with positive focal lengths",
                remedy="calibrate the camera, or publish the calibration it has",
            )

    @property
    def matrix(self) -> NDArray[np.float64]:
        """K, shape (3, 3), pixels."""
        return np.array([[self.fx_px, 0, self.cx_px], [0, self.fy_px, self.cy_px], [0, 0, 1.0]])

    def project(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """Pixels (N, 2) as (u, v) of points (N, 3) in the optical frame; NaN where z <= 0."""
        z = np.asarray(points[:, 2], dtype=np.float64)
        inverse_z = np.divide(1.0, z, out=np.full_like(z, np.nan), where=z > 0)
        u = self.fx_px * points[:, 0] * inverse_z + self.cx_px
        v = self.fy_px * points[:, 1] * inverse_z + self.cy_px
        return np.column_stack((u, v))

    def lift(self, pixels: NDArray[np.floating], depth_m: NDArray[np.floating]) -> NDArray[np.float64]:
        """Points (N, 3) in the optical frame from pixels (N, 2) and their depths along z (N,)."""
        x = (pixels[:, 0] - self.cx_px) / self.fx_px * depth_m
        y = (pixels[:, 1] - self.cy_px) / self.fy_px * depth_m
        return np.column_stack((x, y, depth_m)).astype(np.float64, copy=False)

    def contains(self, pixels: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Which pixels (N, 2) lie inside the image, by nearest pixel centre; NaN does not."""
        u, v = pixels[:, 0], pixels[:, 1]
        return (u >= -0.5) & (u < self.width_px - 0.5) & (v >= -0.5) & (v < self.height_px - 0.5)
