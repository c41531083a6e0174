# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a motion leaves between two frames, to be made small: distances of surfaces, and of visual matches.

Two scans meet in space, by nearest points; two depth images in the image, by projection, each error as large as its
sensor makes it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.geometric import Surface
from vigg_ros.registration.kernels.cells import CellIndex
from vigg_ros.registration.kernels.projective_icp import projective_icp_residuals
from vigg_ros.registration.kernels.symmetric_icp import symmetric_icp_residuals
from vigg_ros.registration.matches import Matches
from vigg_ros.registration.noise import MIN_SIGMA_M, DepthNoise, DepthPlanes
from vigg_ros.registration.rigid import angle_rad, inverse, transform

WIDE_VOXELS, NARROW_VOXELS = 4.0, 2.0
"""How far surfaces may be apart in the first rounds, which may start a few voxels off, and in the others."""

MIN_NORMAL_COSINE = 0.5
"""Surfaces that face apart by more than 60 deg are not the same surface."""

MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""

BLOCK_VOXELS = 8.0
"""Errors of depth are alike on patches of about this size; patches, not points, count as independent."""

SCAN_FLOOR_VOXELS, VISUAL_FLOOR_VOXELS = 0.02, 0.1
"""Standard deviation that a point of a scan, and a visual match of one, has at least."""

RESPONSE_SIGMAS = 0.5
"""The shift by which the response of a scan's surfaces is tried, in standard deviations of their distances: within
what the weights answer to evenly."""

MIN_RESPONSE = 0.05
"""Surfaces that respond less are too rough to say how much they do."""

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
class Residuals:
    """N scalar residuals: e = value - jacobian @ step."""

    value: NDArray[np.float64]
    jacobian: NDArray[np.float64]
    """(N, 6) for a translation and a rotation about the moved origin of the source."""
    weight: NDArray[np.float64]
    """(N,) over the variance, less for outliers."""
    cluster: NDArray[np.int64]
    """(N,) the patch or match that each belongs to: what errs together."""
    floor: NDArray[np.float64]
    """(N,) standard deviation that stays, however well they agree."""
    curvature: float = 1.0
    """The derivative of the weighted residuals as a share of what the weights claim: outliers answer less."""
    shared_floor: bool = False
    """Whether that is an error of a whole patch rather than of each point."""

    def __len__(self) -> int:
        return len(self.value)

    @property
    def information(self) -> NDArray[np.float64]:
        """(6, 6)"""
        return np.asarray((self.jacobian * self.weight[:, None]).T @ self.jacobian)

    @property
    def gradient(self) -> NDArray[np.float64]:
        """(6,) that the step of least squares solves ``information`` for."""
        return np.asarray(self.jacobian.T @ (self.weight * self.value))

    def scaled(self, share: float) -> Residuals:
        """The same with this share of its weight."""
        return replace(self, weight=share * self.weight)


class FrameAlignment(Protocol):
    """Two frames and their visual matches, to be aligned."""

    def surface(self, T_target_source: NDArray[np.float64], *, wide: bool = False, few: bool = False) -> Residuals:
        """Distances of the surfaces along their normals."""

    def visual(self, T_target_source: NDArray[np.float64]) -> Residuals:
        """Of the visual matches."""

    def response(self, T_target_source: NDArray[np.float64], found: Residuals) -> float:
        """How much of a shift along the normals is seen once the surfaces are paired anew: a share in (0, 1]."""

    def lever(self, T_target_source: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """(6,) how far the motion goes: metres for the translation, radians for the rotation.

        None where images cannot contradict the surfaces.
        """


def patch_of(points: NDArray[np.float32], size_m: float) -> NDArray[np.int64]:
    """The number of the patch of this size that each point (N, 3) lies on; not negative."""
    cells = np.floor(points / size_m).astype(np.int64)
    if len(cells) == 0:
        return np.empty(0, np.int64)
    cells -= cells.min(axis=0)
    return np.asarray(np.ravel_multi_index(tuple(cells.T), tuple(cells.max(axis=0) + 1)), np.int64)


def _deviation(value: NDArray[np.float64], floor: float) -> float:
    """Standard deviation of values (N,), N >= 1, by their median absolute deviation, and never below the floor."""
    return MAD_TO_SIGMA * float(np.median(np.abs(value))) + floor


def _cauchy(size: NDArray[np.float64], sigma: float) -> NDArray[np.float64]:
    """Weights in (0, 1] of sizes (N,), of the Cauchy distribution's scale."""
    return np.asarray(1.0 / (1.0 + (size / sigma) ** 2))


def _curvature(size: NDArray[np.float64], sigma: float, dimensions: int) -> float:
    """Mean derivative of residuals under Cauchy weights over their mean weight, for residuals of some dimensions.

    w + (dw/du) u / d with w = 1 / (1 + u^2): weights that fall as a residual grows take back a part of what it says.
    """
    weight = _cauchy(size, sigma)
    return float(np.mean(weight - 2.0 / dimensions * (1.0 - weight) * weight) / np.mean(weight))


def _turned(arms: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3, 6): how a step (translation, rotation about the origin of these arms (N, 3)) moves each of their ends."""
    x, y, z = arms.T
    jacobian = np.zeros((len(arms), 3, 6))
    jacobian[:, :, :3] = np.eye(3)
    jacobian[:, 0, 4], jacobian[:, 0, 5] = z, -y
    jacobian[:, 1, 3], jacobian[:, 1, 5] = -z, x
    jacobian[:, 2, 3], jacobian[:, 2, 4] = y, -x
    return jacobian


def lever(T_target_source: NDArray[np.float64], points: NDArray[np.floating]) -> NDArray[np.float64]:
    """(6,) how far a motion goes: what it shifts a scene of such points (N, 3) by, metres, and turns it, radians."""
    turned = angle_rad(T_target_source[:3, :3])
    distance_m = float(np.median(np.linalg.norm(points, axis=1))) if len(points) else 0.0
    shifted = math.hypot(float(np.linalg.norm(T_target_source[:3, 3])), turned * distance_m)
    return np.repeat((shifted, turned), 3)


def few_rows(count: int, few: bool) -> NDArray[np.int64]:
    """The first rounds use every 4th point, but not fewer than 500: they need not be precise."""
    return np.arange(0, count, 4 if few and count > 2000 else 1)


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
        sigma_m = _deviation(value, floor_m) if len(value) else 1.0
        weight = _cauchy(value, sigma_m) / sigma_m**2
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
            sigma_m = _deviation(size, floor_m)
            curvature = _curvature(size, sigma_m, 3)
            weight = np.repeat(_cauchy(size, sigma_m) / sigma_m**2, 3)
        jacobian = _turned(moved - T_target_source[:3, 3]).reshape(-1, 6)
        cluster = -1 - np.repeat(np.arange(len(value)), 3)
        return Residuals(value.ravel(), jacobian, weight, cluster, np.full(3 * len(value), floor_m), curvature)

    def response(self, T_target_source: NDArray[np.float64], found: Residuals) -> float:
        """How much of a shift along the normals is seen once the surfaces are paired anew: a share in (0, 1].

        Among noisy points the nearest one hides a part of any shift, so ``found`` claims more information
        than there is. Tried with a shift of RESPONSE_SIGMAS of the distances found, either way.
        """
        if len(found) == 0:
            return 1.0
        shift = RESPONSE_SIGMAS * _deviation(found.value, SCAN_FLOOR_VOXELS * self.target.voxel_m)
        pull = []
        for step in (-shift, shift):
            shifted = Surface(self.source.points + np.float32(step) * self.source.normals, self.source.normals)
            paired = self._paired(shifted, T_target_source, NARROW_VOXELS)
            pull.append(float(paired.weight @ paired.value))
        share = (pull[0] - pull[1]) / (2 * shift * float(found.weight.sum()))
        return min(max(share, MIN_RESPONSE), 1.0)

    def lever(self, T_target_source: NDArray[np.float64]) -> None:
        """A scanner's ranges hardly err, but the pixels that see its points do: a pixel gets the nearest point."""


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
        patch = patch_of(points[rows], BLOCK_VOXELS * self.voxel_m)
        _, place, counts = np.unique(patch, return_inverse=True, return_counts=True)
        relative = value / sigma_m
        scale = _deviation(relative, SHARED_NOISE)
        weight, curvature = _cauchy(relative, scale), _curvature(relative, scale, 1)
        mean = np.bincount(place, weight * relative) / np.bincount(place, weight)
        of_patch = math.hypot(MAD_TO_SIGMA * float(np.median(np.abs(mean))), SHARED_NOISE)
        weight /= counts[place] * (of_patch * sigma_m) ** 2
        return Residuals(value, jacobian, weight, patch, SHARED_NOISE * sigma_m, curvature, shared_floor=True)

    def visual(self, T_target_source: NDArray[np.float64]) -> Residuals:
        """Where each match's point projects in the other image, less where it was seen, pixels, both ways.

        Divided by the error of the keypoint and that of the point's depth, as far as the depth shifts its image.
        """
        if len(self.matches) == 0:
            return Residuals(np.empty(0), np.empty((0, 6)), np.empty(0), np.empty(0, np.int64), np.empty(0))
        R, t = T_target_source[:3, :3], T_target_source[:3, 3]
        there = transform(T_target_source, self.matches.source)
        back = transform(inverse(T_target_source), self.matches.target)
        forward = _reprojection(self._cameras[0], there, self.matches.target, _turned(there - t))
        turned = -np.einsum("ji,njk->nik", R, _turned(self.matches.target - t))
        backward = _reprojection(self._cameras[1], back, self.matches.source, turned)
        # The points' own errors of depth, in the other camera's frame.
        lines = self.matches.source @ R.T, self.matches.target @ R
        depth_m = self.matches.source[:, 2], self.matches.target[:, 2]
        noises = self.source.noise, self.target.noise
        value, jacobian = [], []
        for (error, slope, of_point), line, z, noise in zip((forward, backward), lines, depth_m, noises, strict=True):
            shift = np.einsum("nij,nj->ni", of_point, line) * (noise.sigma_m(z) / z)[:, None]
            whitened, moved = _whitened(error, slope, shift, PIXEL_SIGMA_SHARE * self._cameras[0].width_px)
            value.append(whitened)
            jacobian.append(moved)
        both = np.concatenate(value, axis=1)
        size = np.sqrt(np.mean(both**2, axis=1))
        sigma = _deviation(size, PIXEL_FLOOR)
        count = len(both)
        # Both ways tell of the same two keypoints; the sizes' scale cost a few degrees of freedom.
        weight = np.repeat(_cauchy(size, sigma) / sigma**2 / 2, 4) * max(count - 3, 1) / count
        cluster = -1 - np.repeat(np.arange(count), 4)
        slopes = np.concatenate(jacobian, axis=1).reshape(-1, 6)
        curvature = _curvature(size, sigma, 2)
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
