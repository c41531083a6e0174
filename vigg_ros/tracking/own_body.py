# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot's own body in a depth camera's view: what stays where it is in the image while the camera moves.

That alone says little: a wall along which the camera moves looks the same for ever. A cell of the image is evidence
only where two views, whose poses are known, show the same depth and brightness there, while one of them looks through
the place where the other one's surface would stand if it belonged to the world.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.geometry import DepthMap
from vigg_ros.registration.rigid import angle_rad, inverse, transform
from vigg_ros.registration.stages import stage
from vigg_ros.sensors.observation import Note

GRID_SHAPE = (60, 80)
"""Rows and columns of cells; 8 pixels a side of 640x480, finer than any body part that matters."""

UNIT_M, UNIT_DEG = 0.1, 10.0
"""What counts as a motion: at it, things nearer than two metres move by a tenth of the view and more."""

VIEW_SPACING = 0.2
"""Motion between views that are looked at: so NEEDED_VIEWS of them span a whole one, and a camera that stands says
nothing."""

NEEDED_VIEWS = 5
"""Agreeing views before a cell is masked: noise and a pose that is off are not at one place five times."""

MAX_SCORE = 2 * NEEDED_VIEWS
"""So a cell whose depth changes again is released after as many views."""

MIN_MOTION, MAX_MOTION = 1.0, 3.0
"""Between two views that are compared: less moves nothing far enough, after more they share little."""

MAX_VIEWS = 30
"""That wait to be compared; twice those of a straight way, as a camera may sway for ever within MAX_MOTION."""

MAX_DEPTH_CHANGE = 0.02
"""Of the mean depth of a cell of the body: three sigma of the mean over a cell, even where depth is good to 5 %."""

MAX_BRIGHTNESS_CHANGE = 20.0
"""Of 255: light on the body changes as it moves through the room; what is seen in its place differs by more."""

SEEN_THROUGH_SHARE, SEEN_THROUGH_M = 0.1, 0.05
"""How far behind a point everything around its place must lie: beyond the error of poses and depth together."""

MIN_CELL_SHARE = 0.5
"""Pixels of a cell with depth, for the cell to say anything."""

MIN_REGION_SHARE, MAX_MASK_SHARE = 0.01, 0.5
"""Of the image: less is no body part, and more no body: then rather the world is what moves with the camera, as where
the pose is that of a moving thing."""


@dataclass(frozen=True, slots=True)
class GridView:
    """A frame on the grid, and where it was taken; arrays are (rows, columns)."""

    T_odom_camera: NDArray[np.float64]
    depth_m: NDArray[np.float32]
    """Mean; NaN where too few pixels have depth."""
    nearest_m: NDArray[np.float32]
    """Shortest depth of a cell and its eight neighbours; NaN where one of them is unknown."""
    brightness: NDArray[np.float32]

    @classmethod
    def of(cls, frame: Frame, geometry: DepthMap, T_odom_camera: NDArray[np.float64]) -> GridView:
        """What the frame shows."""
        shape = _grid_shape(geometry.camera)
        step = max(1, geometry.camera.height_px // (4 * shape[0]))  # 4 x 4 samples of a cell are enough
        depth_m = np.ascontiguousarray(geometry.depth_m[::step, ::step])
        known = depth_m > 0
        share = _cell_means(known.astype(np.float32), shape)
        is_known = share >= MIN_CELL_SHARE
        with np.errstate(invalid="ignore", divide="ignore"):
            mean_m = np.where(is_known, _cell_means(depth_m, shape) / share, np.float32(np.nan))
        around = np.ones((3, 3), np.uint8)
        nearest_m = cv2.erode(_cell_minima(np.where(known, depth_m, np.float32(np.inf)), shape), around)
        nearest_m[cv2.erode(is_known.astype(np.uint8), around) == 0] = np.nan
        brightness = _cell_means(frame.image, shape).astype(np.float32)
        return cls(T_odom_camera, mean_m, nearest_m, brightness if brightness.ndim == 2 else brightness.mean(axis=2))


class OwnBody:
    """Watches tracked frames of a depth camera, and masks what moves with it. Scans are left alone."""

    def __init__(self) -> None:
        self._camera: Camera | None = None
        self._views: deque[GridView] = deque(maxlen=MAX_VIEWS)
        self._scores, self._fixed = np.zeros(0, np.int64), np.zeros(0, bool)
        self.mask: NDArray[np.bool_] | None = None
        """(H, W) of the image, True where the body is; None while none was found."""

    def forget_views(self) -> None:
        """The poses to come have nothing to do with those before; what was found holds on."""
        self._views.clear()

    @stage("own body")
    def watch(self, frame: Frame, T_odom_camera: NDArray[np.float64]) -> None:
        """Take a tracked frame, as it was measured, into account."""
        if not isinstance(frame.geometry, DepthMap):
            return
        if frame.camera != self._camera:
            self._begin(frame.camera)
        if self._views and _motion(self._views[-1].T_odom_camera, T_odom_camera) < VIEW_SPACING:
            return
        view = GridView.of(frame, frame.geometry, T_odom_camera)
        while self._views and _motion(self._views[0].T_odom_camera, T_odom_camera) > MAX_MOTION:
            self._views.popleft()
        if self._views and _motion(self._views[0].T_odom_camera, T_odom_camera) >= MIN_MOTION:
            self._compare(self._views[0], view, frame.camera)
        self._views.append(view)

    def _begin(self, camera: Camera) -> None:
        self._camera = camera
        self._views.clear()
        shape = _grid_shape(camera)
        self._scores, self._fixed = np.zeros(shape, np.int64), np.zeros(shape, bool)
        self.mask = None

    def _compare(self, before: GridView, now: GridView, camera: Camera) -> None:
        """Let two views speak for and against each cell."""
        is_known = np.isfinite(now.depth_m) & np.isfinite(before.depth_m)
        is_near = np.abs(now.depth_m - before.depth_m) < MAX_DEPTH_CHANGE * now.depth_m
        is_same = is_near & (np.abs(now.brightness - before.brightness) < MAX_BRIGHTNESS_CHANGE)
        is_fixed = np.zeros_like(is_same)
        for one, other in ((before, now), (now, before)):
            is_fixed[is_same] |= _is_seen_through(one, other, is_same, camera)
        if is_fixed.sum() > (is_known & ~is_same).sum():
            return  # more stands still in the image than moves: the camera did not move, and the poses are wrong
        self._scores = np.clip(self._scores + is_fixed - (is_known & ~is_near), 0, MAX_SCORE)
        self._fixed = (self._scores >= NEEDED_VIEWS) | (self._fixed & (self._scores > 0))
        self.mask = _as_mask(self._fixed, camera)


def _is_seen_through(one: GridView, other: GridView, cells: NDArray[np.bool_], camera: Camera) -> NDArray[np.bool_]:
    """For each of the cells (rows, columns) that are chosen, N in all: whether one view has a surface there in whose
    place the other view shows only what lies far behind. (N,)"""
    shape = cells.shape
    scale = np.array((camera.width_px / shape[1], camera.height_px / shape[0]))
    row, column = np.nonzero(cells)
    points = camera.lift((np.column_stack((column, row)) + 0.5) * scale - 0.5, one.depth_m[cells].astype(np.float64))
    points = transform(inverse(other.T_odom_camera) @ one.T_odom_camera, points)
    pixels = camera.project(points)
    inside = np.flatnonzero(camera.contains(pixels))
    column, row = np.minimum(((pixels[inside] + 0.5) / scale).astype(np.intp), (shape[1] - 1, shape[0] - 1)).T
    out = np.zeros(len(points), bool)
    out[inside] = other.nearest_m[row, column] > (1 + SEEN_THROUGH_SHARE) * points[inside, 2] + SEEN_THROUGH_M
    return out


def _as_mask(fixed: NDArray[np.bool_], camera: Camera) -> NDArray[np.bool_] | None:
    """Connected regions of some size, with a margin, as pixels; None where there are none, or far too many."""
    around = np.ones((3, 3), np.uint8)
    closed = cv2.morphologyEx(fixed.astype(np.uint8), cv2.MORPH_CLOSE, around)
    _, labels, statistics, _ = cv2.connectedComponentsWithStats(closed, connectivity=4)
    is_large = statistics[:, cv2.CC_STAT_AREA] >= MIN_REGION_SHARE * fixed.size
    is_large[0] = False  # the background
    cells = cv2.dilate(is_large[labels].astype(np.uint8), around)
    if not 0 < cells.mean() <= MAX_MASK_SHARE:
        return None
    return np.asarray(cv2.resize(cells, (camera.width_px, camera.height_px), interpolation=cv2.INTER_NEAREST) > 0)


def _motion(T_odom_one: NDArray[np.float64], T_odom_other: NDArray[np.float64]) -> float:
    """How far two poses are apart, in units of UNIT_M or UNIT_DEG, whichever is more."""
    T = inverse(T_odom_one) @ T_odom_other
    return max(float(np.linalg.norm(T[:3, 3])) / UNIT_M, float(np.rad2deg(angle_rad(T[:3, :3]))) / UNIT_DEG)


def _grid_shape(camera: Camera) -> tuple[int, int]:
    """GRID_SHAPE, or as many cells as there are pixels."""
    return min(camera.height_px, GRID_SHAPE[0]), min(camera.width_px, GRID_SHAPE[1])


def _cell_means(values: NDArray[Any], shape: tuple[int, int]) -> NDArray[Any]:
    return np.asarray(cv2.resize(values, shape[::-1], interpolation=cv2.INTER_AREA))


def _cell_minima(values: NDArray[np.float32], shape: tuple[int, int]) -> NDArray[np.float32]:
    """Of each cell, and the row and column after it where cells have no whole number of pixels."""
    window = [-(-pixels // cells) for pixels, cells in zip(values.shape, shape, strict=True)]
    minima = cv2.erode(values, np.ones(window, np.uint8), anchor=(0, 0))
    return np.asarray(cv2.resize(minima, shape[::-1], interpolation=cv2.INTER_NEAREST))


def body_note(mask: NDArray[np.bool_]) -> Note:
    """What a recording says once of the body that was found; mask (H, W)."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    return Note(
        "OWN_BODY",
        f"a part of the image that moves with the camera (columns {columns[0]} to {columns[-1]}, rows {rows[0]} to "
        f"{rows[-1]})",
        "left out from here on as the robot's own body, with what else is found of it",
        "give it by input.mask_image or input.mask_boxes, which hold from the first frame on, or set input.own_body "
        "to off if it is none",
    )
