# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Two depth images aligned in the image: planes seen in the same direction, and matches by reprojection."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.alignment import (
    BLOCK_VOXELS,
    MAD_TO_SIGMA,
    MIN_NORMAL_COSINE,
    NARROW_VOXELS,
    WIDE_VOXELS,
    Residuals,
    cauchy,
    curvature_of,
    deviation,
    few_rows,
    lever,
    patch_of,
    turned,
)
from vigg_ros.registration.camera import Camera
from vigg_ros.registration.kernels.projective_icp import projective_icp_residuals
from vigg_ros.registration.matches import Matches
from vigg_ros.registration.noise import MIN_SIGMA_M, DepthNoise, DepthPlanes
from vigg_ros.registration.rigid import inverse, transform

BLOCK_WINDOWS = 4.0
"""So many windows of a depth image's planes a patch is wide at least, as neighbouring windows share their pixels."""

SHARED_NOISE = 0.3
"""Of a depth's standard deviation, what is left in the mean of a patch at least: a sensor repeats its errors from one
image to the next, above all its steps of disparity, so that two images may agree better than they are right."""

WIDE_SIGMAS, NARROW_SIGMAS = 12.0, 4.0
"""How far planes may be apart besides, where their depth is noisy."""

PIXEL_SIGMA_SHARE = 1.0 / 640
"""Nominal deviation of a keypoint as a share of the image's width: it is searched in a reduced image."""

PIXEL_FLOOR = 0.1
"""Share of that deviation which it has at least, however well the matches agree."""


@dataclass(frozen=True, slots=True)
class PlaneSamples:
    """Points on a depth image's planes."""

    points: NDArray[np.float32]
    """(N, 3), metres."""
    normals: NDArray[np.float32]
    sigma_m: NDArray[np.float32]
    """(N,) that the depth may be off by, along the line of sight."""


@dataclass(frozen=True, slots=True)
class DepthSurface:
    """The planes of a depth image, and how sure each is."""

    planes: DepthPlanes
    noise: DepthNoise
    sigma_m: NDArray[np.float32]
    """(h, w) along the line of sight."""
    samples: PlaneSamples

    @classmethod
    def of(cls, planes: DepthPlanes, noise: DepthNoise, *, near_m: float, far_m: float) -> DepthSurface:
        """Every second plane each way is a sample: their windows overlap. Beyond the range there is none."""
        depth_m = planes.grid[..., 0].astype(np.float64)
        sigma_m = np.maximum(noise.sigma_m(depth_m), MIN_SIGMA_M).astype(np.float32)
        used = np.zeros(depth_m.shape, bool)
        used[::2, ::2] = (depth_m[::2, ::2] > max(near_m, 0.0)) & (depth_m[::2, ::2] <= far_m)
        points = planes.camera.lift(planes.pixels()[used], depth_m[used]).astype(np.float32)
        samples = PlaneSamples(points, np.ascontiguousarray(planes.grid[used][:, 1:4]), sigma_m[used])
        return cls(planes, noise, sigma_m, samples)


@dataclass(frozen=True, slots=True)
class DepthAlignment:
    """Two depth images: planes seen in the same direction, and matches in the images."""

    target: DepthSurface
    source: DepthSurface
    matches: Matches
    voxel_m: float
    _cameras: tuple[Camera, Camera] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_cameras", (self.target.planes.camera, self.source.planes.camera))

    def surface(self, T_target_source: NDArray[np.float64], *, wide: bool = False, few: bool = False) -> Residuals:
        """Distances from the source's samples to the target's planes along the mean of their normals.

        A patch counts as one measurement, whose error is what the means of the patches show, and the noise that two
        images of one sensor share besides.
        """
        samples = self.source.samples
        chosen = few_rows(len(samples.points), few)
        limits = (WIDE_SIGMAS, WIDE_VOXELS) if wide else (NARROW_SIGMAS, NARROW_VOXELS)
        points = samples.points[chosen]
        rows, value, sigma_m, jacobian = projective_icp_residuals(
            (points, samples.normals[chosen], samples.sigma_m[chosen]), T_target_source,
            (self.target.planes.grid, self.target.sigma_m), DepthPlanes.intrinsics_of(self._cameras[0]),
            self.target.planes.step_px, (limits[0], limits[1] * self.voxel_m, MIN_NORMAL_COSINE),
        )
        if len(rows) == 0:
            return Residuals(value, jacobian, np.empty(0), rows, sigma_m)
        patch = self._patches(points[rows])
        _, place, counts = np.unique(patch, return_inverse=True, return_counts=True)
        relative = value / sigma_m
        scale = deviation(relative, SHARED_NOISE)
        weight, curvature = cauchy(relative, scale), curvature_of(relative, scale, 1)
        mean = np.bincount(place, weight * relative) / np.bincount(place, weight)
        of_patch = math.hypot(MAD_TO_SIGMA * float(np.median(np.abs(mean))), SHARED_NOISE)
        weight /= counts[place] * (of_patch * sigma_m) ** 2
        return Residuals(value, jacobian, weight, patch, SHARED_NOISE * sigma_m, curvature, shared_floor=True)

    def _patches(self, points: NDArray[np.float32]) -> NDArray[np.int64]:
        """The patch of each point (N, 3): of BLOCK_VOXELS, doubled until it is BLOCK_WINDOWS wide where it is seen."""
        size_m = BLOCK_VOXELS * self.voxel_m
        seen_m = points[:, 2] * (BLOCK_WINDOWS * self.source.planes.window_px / self._cameras[1].fx_px)
        doubled = np.ceil(np.log2(np.maximum(seen_m / size_m, 1.0))).astype(np.int64)
        return np.asarray(patch_of((points / 2.0 ** doubled[:, None]).astype(np.float32), size_m) * 64 + doubled)

    def visual(self, T_target_source: NDArray[np.float64]) -> Residuals:
        """Where each match's point projects in the other image, less where it was seen, pixels, both ways.

        Divided by the error of the keypoint and that of the point's depth, as far as the depth shifts its image.
        """
        if len(self.matches) == 0:
            return Residuals(np.empty(0), np.empty((0, 6)), np.empty(0), np.empty(0, np.int64), np.empty(0))
        R, t = T_target_source[:3, :3], T_target_source[:3, 3]
        there = transform(T_target_source, self.matches.source)
        back = transform(inverse(T_target_source), self.matches.target)
        forward = _reprojection(self._cameras[0], there, self.matches.target, turned(there - t))
        moving = -np.einsum("ji,njk->nik", R, turned(self.matches.target - t))
        backward = _reprojection(self._cameras[1], back, self.matches.source, moving)
        # The points' own errors of depth, in the other camera's frame.
        lines = self.matches.source @ R.T, self.matches.target @ R
        depth_m = self.matches.source[:, 2], self.matches.target[:, 2]
        noises = self.source.noise, self.target.noise
        value, jacobian = [], []
        for (error, slope, of_point), line, z, noise, camera in zip(
            (forward, backward), lines, depth_m, noises, self._cameras, strict=True
        ):
            shift = np.einsum("nij,nj->ni", of_point, line) * (noise.sigma_m(z) / z)[:, None]
            whitened, moved = _whitened(error, slope, shift, PIXEL_SIGMA_SHARE * camera.width_px)
            value.append(whitened)
            jacobian.append(moved)
        both = np.concatenate(value, axis=1)
        size = np.sqrt(np.mean(both**2, axis=1))
        sigma = deviation(size, PIXEL_FLOOR)
        count = len(both)
        # Both ways tell of the same two keypoints; the sizes' scale cost a few degrees of freedom.
        weight = np.repeat(cauchy(size, sigma) / sigma**2 / 2, 4) * max(count - 3, 1) / count
        cluster = -1 - np.repeat(np.arange(count), 4)
        slopes = np.concatenate(jacobian, axis=1).reshape(-1, 6)
        curvature = curvature_of(size, sigma, 2)
        return Residuals(both.ravel(), slopes, weight, cluster, np.full(4 * count, PIXEL_FLOOR), curvature)

    def response(self, T_target_source: NDArray[np.float64], found: Residuals) -> float:
        """A plane is a mean of many pixels and stays where it is; only the weights take some of a shift back."""
        return found.curvature

    def lever(self, T_target_source: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far the motion goes; see ``lever``."""
        return lever(T_target_source, self.source.samples.points)


def _reprojection(
    camera: Camera, seen: NDArray[np.float64], meant: NDArray[np.float64], moving: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Pixels (N, 2) from where points are seen to where they were meant to be, their slope (N, 2, 6) and (N, 2, 3).

    ``moving`` (N, 3, 6) is how a step moves the points seen. A point behind the camera has no error and no slope.
    """
    error = camera.project(meant) - camera.project(seen)
    x, y, z = seen.T
    with np.errstate(divide="ignore", invalid="ignore"):
        of_point = np.zeros((len(seen), 2, 3))
        of_point[:, 0, 0], of_point[:, 0, 2] = camera.fx_px / z, -camera.fx_px * x / z**2
        of_point[:, 1, 1], of_point[:, 1, 2] = camera.fy_px / z, -camera.fy_px * y / z**2
    behind = ~np.isfinite(error).all(axis=1)
    error[behind], of_point[behind] = 0.0, 0.0
    return error, of_point @ moving, of_point


def _whitened(
    error: NDArray[np.float64], slope: NDArray[np.float64], shift: NDArray[np.float64], sigma_px: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Errors (N, 2) and slopes (N, 2, 6) over the root of their covariance sigma^2 I + shift shift^T."""
    length2 = np.einsum("ni,ni->n", shift, shift)
    less = (1.0 - 1.0 / np.sqrt(1.0 + length2 / sigma_px**2)) / np.maximum(length2, 1e-12)
    root = (np.eye(2) - less[:, None, None] * shift[:, :, None] * shift[:, None, :]) / sigma_px
    return np.einsum("nij,nj->ni", root, error), root @ slope
