# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where a frame's points come from, a depth image or a projected scan, and what it saw along its lines of sight."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.kernels.lifting import lift_depth
from vigg_ros.registration.rigid import transform

PIXEL_RADIUS = 5.0
"""How far from a pixel its point may project; docs/method.md, keypoints."""

HIDDEN_RATIO, HIDDEN_MARGIN_M = 1.15, 0.3
"""A point this much deeper than a neighbour in the image is hidden by it."""

SCAN_CELL_DEG = 1.0
"""Cells of a scan's view: no finer than the beams of a 32-beam scanner, so that few cells stay empty."""

MAX_DEPTH_IN_CELL = 0.2
"""A cell whose ranges spread over more than this share shows an edge, not a surface."""


@dataclass(frozen=True, slots=True)
class DepthMap:
    """A depth image aligned to the camera's image; points are in the optical frame."""

    camera: Camera
    depth_m: NDArray[np.float32]
    """(H, W), metres along z, 0 where there is none."""

    def points(self) -> NDArray[np.float32]:
        """All points (N, 3)."""
        camera = self.camera
        intrinsics = (np.float32(value) for value in (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px))
        return np.asarray(lift_depth(self.depth_m, *intrinsics))

    def points_at(self, pixels: NDArray[np.floating]) -> NDArray[np.float64]:
        """Points (K, 3) seen by the pixels (K, 2); NaN where a pixel sees none."""
        depth_m = self._depth_at(pixels)
        return self.camera.lift(pixels, np.where(depth_m > 0, depth_m, np.nan))

    @property
    def T_camera_points(self) -> NDArray[np.float64]:
        """(4, 4): the points are in the camera's frame."""
        return np.eye(4)

    def view(self) -> DepthMap:
        """The lines of sight: the depth image itself is evidence of surfaces and of free space."""
        return self

    def behind(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far each point (N, 3) lies behind the surface seen in its direction, metres along z.

        Negative in front of it, where the sensor looked through; NaN where it saw nothing.
        """
        pixels = self.camera.project(points)
        inside = self.camera.contains(pixels)
        out = np.full(len(points), np.nan)
        depth_m = self._depth_at(pixels[inside])
        out[inside] = np.where(depth_m > 0, points[inside, 2] - depth_m, np.nan)
        return out

    def masked(self, ignore: NDArray[np.bool_]) -> DepthMap:
        """Without depth where ``ignore`` (H, W) holds."""
        return DepthMap(self.camera, np.where(ignore, np.float32(0), self.depth_m))

    def _depth_at(self, pixels: NDArray[np.floating]) -> NDArray[np.float64]:
        column, row = np.rint(pixels).astype(np.intp).T
        return np.asarray(self.depth_m[row, column], np.float64)


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


@dataclass(frozen=True, slots=True)
class ProjectedScan:
    """A point cloud and the camera that sees a part of it; points stay in their own frame."""

    camera: Camera
    cloud: NDArray[np.float32]
    """(N, 3), metres, all finite."""
    T_camera_points: NDArray[np.float64]
    """(4, 4): p_camera = T_camera_points @ p_points."""
    times_s: NDArray[np.float64] | None = None
    """(N,) when each point was measured, from the stamp on, if known."""
    ignore: NDArray[np.bool_] | None = None
    """(H, W) pixels that see no point, if any."""

    def points(self) -> NDArray[np.float32]:
        """All points (N, 3), those outside the image too."""
        return self.cloud

    def points_at(self, pixels: NDArray[np.floating]) -> NDArray[np.float64]:
        """For each pixel (K, 2) the nearest projected point within PIXEL_RADIUS that nothing hides; else NaN."""
        rows, projected = self.visible()
        out = np.full((len(pixels), 3), np.nan)
        if len(rows) and len(pixels):
            distance, nearest = cKDTree(projected).query(pixels, distance_upper_bound=PIXEL_RADIUS)
            found = np.isfinite(distance) & ~self._ignored(pixels)
            out[found] = self.cloud[rows[nearest[found]]]
        return out

    def visible(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Rows (M,) and pixels (M, 2) of the points that the camera sees: in front, inside, not hidden."""
        in_camera = transform(self.T_camera_points, self.cloud)
        pixels = self.camera.project(in_camera)
        rows = np.flatnonzero(self.camera.contains(pixels))
        pixels, depth_m = pixels[rows], in_camera[rows, 2]
        seen = ~_hidden(pixels, depth_m, self.camera)
        return rows[seen], pixels[seen]

    def masked(self, ignore: NDArray[np.bool_]) -> ProjectedScan:
        """Without the points that the camera sees where ``ignore`` (H, W) holds; those it does not see remain."""
        scan = replace(self, ignore=ignore if self.ignore is None else self.ignore | ignore)
        rows, pixels = self.visible()
        kept = np.ones(len(self.cloud), bool)
        kept[rows[scan._ignored(pixels)]] = False
        return replace(scan, cloud=self.cloud[kept], times_s=None if self.times_s is None else self.times_s[kept])

    def _ignored(self, pixels: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Which pixels (K, 2) inside the image see no point whatever is there."""
        if self.ignore is None:
            return np.zeros(len(pixels), bool)
        column, row = np.rint(pixels).astype(np.intp).T
        return np.asarray(self.ignore[row, column])

    def view(self) -> ScanView:
        """The lines of sight of the scanner, which stands at the origin of the points' frame."""
        return ScanView.of(self.cloud)


def _hidden(pixels: NDArray[np.float64], depth_m: NDArray[np.float64], camera: Camera) -> NDArray[np.bool_]:
    """Which points (M,) lie behind a nearer surface: in their own cell of the image, or on both sides of it.

    The scanner looks past objects that hide the background from the camera. A nearer point on one side
    only is an edge, or the ground running away, and hides nothing.
    """
    column, row = (pixels / PIXEL_RADIUS + 1).astype(np.intp).T
    shape = (int(camera.height_px / PIXEL_RADIUS) + 3, int(camera.width_px / PIXEL_RADIUS) + 3)
    nearest = np.full(shape, np.inf)
    np.minimum.at(nearest, (row, column), depth_m)
    both_sides = np.maximum(nearest[row, column - 1], nearest[row, column + 1])
    front = np.minimum(nearest[row, column], both_sides)
    return np.asarray(depth_m > HIDDEN_RATIO * front + HIDDEN_MARGIN_M)


View = DepthMap | ScanView
