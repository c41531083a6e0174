# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Views of rendered worlds, drawn at random, and how much of the surface two of them share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from vigg_ros.bench.worlds import LidarModel, Scene, render_depth, render_lidar
from vigg_ros.bench.worlds.canvas import Rng
from vigg_ros.bench.worlds.poses import Pose, Position, flat, look_at
from vigg_ros.registration import Camera
from vigg_ros.registration.geometry import DepthMap
from vigg_ros.registration.rigid import inverse, transform

COARSE_CAMERA = Camera(width_px=64, height_px=48, fx_px=52.5, fy_px=52.5, cx_px=31.5, cy_px=23.5)
"""A coarse view, to measure overlaps with."""
COARSE_LIDAR = LidarModel(beams=32, columns=128)
SAME_SURFACE_M = 1.0
"""Points of two scans nearer than this, about the spacing of beams at 30 m, are of the same surface."""

Bounds = tuple[float, float]

T_BASE_LIDAR: Pose = flat((0.1, 0.0, 1.9), 2.0)
"""Where the car carries its LiDAR."""


@dataclass(frozen=True, slots=True, eq=False)
class SampledView:
    """Where a sensor stands, and what it measures there coarsely: depth (H, W) or points (N, 3) in the world."""

    T_world_body: Pose
    measured: NDArray[np.floating]


Viewpoint = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Where a camera is, and what it looks at."""


def room_viewpoint(rng: Rng) -> Viewpoint:
    """From the emptier half of the room to the furniture."""
    return rng.uniform((-1.6, -1.2, 1.1), (0.2, 1.2, 1.7)), rng.uniform((1.0, -1.6, 0.3), (2.4, 1.6, 1.4))


def hall_viewpoint(rng: Rng) -> Viewpoint:
    """Along the hall of columns, in either direction."""
    eye = rng.uniform((-15, -0.6, 1.2), (15, 0.6, 1.7))
    return eye, eye + (rng.choice((-3, 3)), rng.uniform(-2, 2), rng.uniform(-1.2, 0.0))


def workshop_viewpoint(rng: Rng) -> Viewpoint:
    """Over tables and cartons to the far walls."""
    return rng.uniform((-6.0, -3.0, 1.1), (-0.5, 3.0, 1.7)), rng.uniform((2.5, -4.0, 0.4), (6.5, 4.0, 1.4))


def shelf_viewpoint(rng: Rng) -> Viewpoint:
    """40 to 60 cm from the boards' front edges."""
    eye = rng.uniform((-0.6, -0.8, 0.5), (-0.4, 0.8, 1.4))
    return eye, eye * (0, 1, 1) + rng.uniform((0.1, -0.15, -0.15), (0.2, 0.15, 0.1))


def counter_viewpoint(rng: Rng) -> Viewpoint:
    """From before the counter to what stands on it and to its doors."""
    eye = rng.uniform((-1.9, -1.3, 1.2), (-1.1, 1.3, 1.6))
    return eye, eye * (0, 1, 0) + rng.uniform((0.1, -0.5, 0.6), (0.3, 0.5, 1.15))


def walk(rng: Rng, turn_deg: Position = (20, 55, 15), shift_m: Position = (1.0, 0.25, 0.7)) -> Pose:
    """T_first_second of some steps: turned and shifted up to so much about and along the camera's axes."""
    T = np.eye(4)
    size = rng.uniform(0.1, 1.0)
    turned_deg = size * rng.uniform(-np.asarray(turn_deg), turn_deg)
    T[:3, :3] = Rotation.from_rotvec(turned_deg, degrees=True).as_matrix()
    T[:3, 3] = size * rng.uniform(-np.asarray(shift_m), shift_m)
    return T


def nudge(rng: Rng, turn_deg: Bounds = (0.0, 3.0), shift_m: Bounds = (0.01, 0.05)) -> Pose:
    """T_first_second of a small motion in any direction, of an angle and a length within these bounds."""
    axis, direction = (vector / np.linalg.norm(vector) for vector in rng.standard_normal((2, 3)))
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(rng.uniform(*turn_deg) * axis, degrees=True).as_matrix()
    T[:3, 3] = rng.uniform(*shift_m) * direction
    return T


@dataclass(frozen=True, slots=True)
class Handling:
    """How a hand holds a camera in some kind of place."""

    viewpoint: Callable[[Rng], Viewpoint] = room_viewpoint
    motion: Callable[[Rng], Pose] = walk
    """T_first_second between the frames of a pair."""
    nearest_m: float = 0.5
    """A view is free if next to nothing is nearer than this."""


class HandheldSampler:
    """Draws views of a camera in a hand."""

    def __init__(self, scene: Scene, handling: Handling = Handling()) -> None:
        self._scene, self._handling = scene, handling

    def draw(self, rng: Rng) -> SampledView:
        """A view that nothing stands right in front of."""
        while True:
            eye, target = self._handling.viewpoint(rng)
            view = self._view(look_at(eye, target, rng.uniform(-8, 8)))
            if self._is_free(view):
                return view

    def draw_near(self, first: SampledView, rng: Rng) -> SampledView:
        """A view after a motion of the hand."""
        return self._view(first.T_world_body @ self._handling.motion(rng))

    def overlap(self, first: SampledView, second: SampledView) -> float:
        """Mean share of each view's surface that the other sees too; 0 if the second is no free view."""
        if not self._is_free(second):
            return 0.0
        T_first_second = inverse(first.T_world_body) @ second.T_world_body
        forth = _seen_share(first.measured, second.measured, T_first_second)
        back = _seen_share(second.measured, first.measured, inverse(T_first_second))
        return (forth + back) / 2

    def _view(self, T_world_camera: Pose) -> SampledView:
        return SampledView(T_world_camera, render_depth(self._scene, COARSE_CAMERA, T_world_camera))

    def _is_free(self, view: SampledView) -> bool:
        """Whether the camera stands in the room, with nothing before its lens."""
        return bool(np.mean(view.measured > self._handling.nearest_m) > 0.97)


class VehicleSampler:
    """Draws places of a car along the main street."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene

    def draw(self, rng: Rng) -> SampledView:
        """Somewhere on the right lane."""
        return self._view(flat((rng.uniform(-30, 10), rng.uniform(-1.2, 0), 0), rng.uniform(-5, 5)))

    def draw_near(self, first: SampledView, rng: Rng) -> SampledView:
        """Up to 25 m further on, turned by up to 20 deg."""
        ahead_m = first.T_world_body[0, 3] + rng.uniform(1, 25)
        return self._view(flat((ahead_m, rng.uniform(-1.2, 0), 0), rng.uniform(-20, 20)))

    def overlap(self, first: SampledView, second: SampledView) -> float:
        """Mean share of each scan's points that have one of the other nearby."""
        clouds = (first.measured, second.measured)
        near = [cKDTree(a).query(b, distance_upper_bound=SAME_SURFACE_M)[0] for a, b in (clouds, clouds[::-1])]
        return float(np.mean([np.mean(np.isfinite(distance)) for distance in near]))

    def _view(self, T_world_base: Pose) -> SampledView:
        T_world_lidar = T_world_base @ T_BASE_LIDAR
        points, _ = render_lidar(self._scene, T_world_lidar, COARSE_LIDAR)
        return SampledView(T_world_base, transform(T_world_lidar, points))


def _seen_share(
    viewer_m: NDArray[np.floating], other_m: NDArray[np.floating], T_viewer_other: NDArray[np.float64]
) -> float:
    """The share of the other's depth pixels whose surface the viewer sees too."""
    row, column = np.nonzero(other_m)
    pixels = np.column_stack((column, row)).astype(np.float64)
    points = COARSE_CAMERA.lift(pixels, other_m[row, column].astype(np.float64))
    behind_m = DepthMap(COARSE_CAMERA, viewer_m.astype(np.float32)).behind(transform(T_viewer_other, points))
    # Coarse pixels see slanting surfaces at depths that differ by some percent.
    with np.errstate(invalid="ignore"):
        return float(np.mean(np.abs(behind_m) < 0.03 + 0.03 * other_m[row, column]))
