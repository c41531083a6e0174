# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far a measured point may be off along its line of sight, and the planes that a depth image shows.

Structured light and stereo measure disparity, so their error grows with the square of the distance; a scanner times
its pulse, so its error hardly grows but for the width of the beam.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.geometry import DepthMap
from vigg_ros.registration.kernels.depth_planes import depth_planes
from vigg_ros.registration.options import NoiseConfig
from vigg_ros.registration.stages import stage

COLUMNS = 160
"""Planes along the width of an image: 4 pixels apart at 640, less than a matching window of the depth cameras."""

WINDOW_STEPS = 1.5
"""Half the side of a plane's window in such steps: 13 pixels at 640, over several steps of disparity on a wall."""

FLAT_QUANTILE = 0.35
"""Of the deviations from planes at a distance: furniture is not flat, but a third of what is seen is."""

MIN_PLANE_SHARE = 0.3
"""Places with depth that show a plane: 0.7 to 0.96 of a Kinect's, a quarter where 35 % of the pixels are missing."""

BINS, MIN_PER_BIN = 8, 40
"""Distances at which the noise is looked at, and planes that each must show."""

MIN_SIGMA_M = 0.001
"""Depth images count in millimetres; no sensor is better."""


@dataclass(frozen=True, slots=True)
class DepthNoise:
    """Standard deviation along the line of sight: the root of constant^2 + (per_m r)^2 + (per_m2 r^2)^2."""

    constant_m: float
    per_m: float
    per_m2: float

    def sigma_m(self, distance_m: NDArray[np.floating]) -> NDArray[np.float64]:
        """At distances of any shape, metres (depth for a depth image, range for a scan)."""
        r = np.asarray(distance_m, np.float64)
        return np.asarray(np.sqrt(self.constant_m**2 + (self.per_m * r) ** 2 + (self.per_m2 * r * r) ** 2))

    def reach_m(self, sigma_m: float) -> float:
        """The distance up to which the standard deviation stays below this; inf where it always does, 0 if never."""
        rest = sigma_m**2 - self.constant_m**2
        if rest <= 0:
            return 0.0
        a, b = self.per_m2**2, self.per_m**2
        if a == 0:
            return math.sqrt(rest / b) if b > 0 else math.inf
        return math.sqrt((math.sqrt(b * b + 4 * a * rest) - b) / (2 * a))


NO_NOISE = DepthNoise(0.0, 0.0, 0.0)

MODELS = {
    "none": NO_NOISE,
    "structured_light": DepthNoise(0.0015, 0.0, 0.00145),
    "stereo": DepthNoise(0.001, 0.0, 0.0052),
    "time_of_flight": DepthNoise(0.003, 0.002, 0.0),
    "lidar": DepthNoise(0.02, 0.0024, 0.0),
}
"""Kinect: Khoshelham and Elberink 2012, near Nguyen 2012. Stereo: 0.1 px / (382 px * 50 mm), a D435 at 640 columns by
Intel's white paper on tuning, and about 2 % at 4 m. Time of flight: the random error of an Azure Kinect by its
data sheet, 17 mm at most. LiDAR: 2 cm by the data sheets of Velodyne and Ouster, and a beam of 2 to 3 mrad."""


@dataclass(frozen=True, slots=True)
class DepthPlanes:
    """Planes fitted to the windows of a depth image, on a grid of pixels; see ``kernels.depth_planes``."""

    camera: Camera
    step_px: int
    window_px: int
    """Side of the window of each."""
    grid: NDArray[np.float32]
    """(h, w, 5): depth (m, 0 where there is no plane), normal towards the camera, deviation of the inverse depth."""
    is_dense: bool
    """Whether most places that have depth show a plane. Depth that is registered to a larger image without filling its
    holes does not."""

    @classmethod
    def of(cls, depth: DepthMap) -> DepthPlanes:
        """About COLUMNS planes along the width."""
        step = max(round(depth.camera.width_px / COLUMNS), 1)
        half = max(math.ceil(WINDOW_STEPS * step), 2)
        grid = depth_planes(depth.depth_m, cls.intrinsics_of(depth.camera), step, half, 2 if half > 4 else 1)
        centres = depth.depth_m[step // 2 :: step, step // 2 :: step][: grid.shape[0], : grid.shape[1]]
        is_dense = np.count_nonzero(grid[..., 0]) > MIN_PLANE_SHARE * np.count_nonzero(centres)
        return cls(depth.camera, step, 2 * half + 1, grid, bool(is_dense))

    @staticmethod
    def intrinsics_of(camera: Camera) -> tuple[float, float, float, float]:
        """fx, fy, cx, cy, as the kernels want them."""
        return camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px

    def pixels(self) -> NDArray[np.float64]:
        """(h, w, 2) as (u, v): the middle of each plane's window."""
        rows, columns = (np.arange(n) * self.step_px + self.step_px // 2 for n in self.grid.shape[:2])
        return np.stack(np.meshgrid(columns, rows), axis=-1).astype(np.float64)


@stage("noise")
def noise_of(
    planes: DepthPlanes | None, config: NoiseConfig, *, near_m: float = 0.0, far_m: float = math.inf
) -> DepthNoise:
    """The noise of a frame's points: that of the model that is named, or what the planes of a depth image show.

    Without planes it is a scan's.
    """
    if config.model != "auto":
        model = MODELS[config.model]
    elif planes is None:
        model = MODELS["lidar"]
    else:
        model = estimate_noise(planes, near_m=near_m, far_m=far_m) or MODELS["structured_light"]
    return DepthNoise(
        config.sigma_m or model.constant_m, config.sigma_per_m or model.per_m, config.sigma_per_m2 or model.per_m2
    )


def estimate_noise(planes: DepthPlanes, *, near_m: float = 0.0, far_m: float = math.inf) -> DepthNoise | None:
    """From the deviations of the depth from planes, over distance; None where too few planes are seen.

    At each of BINS distances a quantile stands for the flat parts; a constant and a part that grows with the square
    are fitted to them by non-negative least squares of the relative error.
    """
    seen_m = planes.grid[..., 0]
    shown = planes.grid[(seen_m > near_m) & (seen_m <= far_m)]  # what is clipped beyond the range has no noise
    if len(shown) < 2 * MIN_PER_BIN:
        return None
    shown = shown[np.argsort(shown[:, 0], kind="stable")].astype(np.float64)
    bins = np.array_split(shown, min(BINS, len(shown) // MIN_PER_BIN))
    depth_m = np.array([np.median(part[:, 0]) for part in bins])
    sigma_m = np.array([np.quantile(part[:, 4], FLAT_QUANTILE) for part in bins]) * depth_m**2
    sigma_m = np.maximum(sigma_m, MIN_SIGMA_M)
    terms, _ = nnls(np.column_stack((np.ones(len(bins)), depth_m**4)) / sigma_m[:, None] ** 2, np.ones(len(bins)))
    constant_m, per_m2 = np.sqrt(terms)
    return DepthNoise(max(float(constant_m), MIN_SIGMA_M), 0.0, float(per_m2))
