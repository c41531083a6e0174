# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What stands between a camera and the scene, and does not stay with the scene: a robot's own body, people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

from vigg_ros.bench.view_sampling import COARSE_CAMERA, SampledView
from vigg_ros.bench.worlds import Light, Scene, render_depth
from vigg_ros.bench.worlds.canvas import Rng, Size, vivid
from vigg_ros.bench.worlds.patterns import label, mottled, poster
from vigg_ros.bench.worlds.poses import Pose, flat
from vigg_ros.bench.worlds.surfaces import Cylinder, Pattern, Rectangle, Sphere, TexturedSurface
from vigg_ros.bench.worlds.texture import Texture

MAX_PLACINGS = 40
"""Places tried before another pair of views is drawn."""

_PLAIN = Texture.of(np.full((8, 8, 3), 128, np.uint8), 1.0)


class Foreground(Protocol):
    """Some things, and how they stand in the two frames of a pair."""

    def place(self, scene: Scene, views: Sequence[SampledView], rng: Rng) -> list[list[Pose]] | None:
        """T_world_thing of each thing in each view; None where no place is found."""

    def shapes(self, T_world_things: Sequence[Pose], rng: Rng) -> list[TexturedSurface]:
        """The things at their places; the same generator state makes the same things."""


@dataclass(frozen=True, slots=True)
class Board:
    """A board held before the lens, as a gripper or a load is, at half a metre."""

    shift_m: float = 0.0
    """How far it is from one frame to the other, seen from the camera."""
    coverage: tuple[float, float] = (0.25, 0.35)
    """Share of the view that it hides, in each frame."""
    size_m: Size = (0.5, 0.38)

    def place(self, scene: Scene, views: Sequence[SampledView], rng: Rng) -> list[list[Pose]] | None:
        for _ in range(MAX_PLACINGS):
            T_camera_board = self._held(rng)
            shifted = T_camera_board.copy()
            direction = rng.standard_normal(3) * (1.0, 1.0, 0.3)
            shifted[:3, 3] += self.shift_m * direction / np.linalg.norm(direction)
            placed = [[view.T_world_body @ T] for view, T in zip(views, (T_camera_board, shifted), strict=True)]
            if all(self._is_seen(view, things) for view, things in zip(views, placed, strict=True)):
                return placed
        return None

    def shapes(self, T_world_things: Sequence[Pose], rng: Rng) -> list[TexturedSurface]:
        paint = poster(rng, self.size_m, shapes=40, texel_m=0.002)
        return [Rectangle(T_world_board, self.size_m, paint) for T_world_board in T_world_things]

    def _held(self, rng: Rng) -> Pose:
        """T_camera_board: at the lower edge of the view or at a side, its front to the camera, a little askew."""
        lower = rng.random() < 0.5
        column, row = (rng.uniform(0.25, 0.75), 1.0) if lower else (rng.choice((0.0, 1.0)), rng.uniform(0.4, 0.8))
        pixel = np.multiply((column, row), (COARSE_CAMERA.width_px, COARSE_CAMERA.height_px)) + rng.uniform(-8, 8, 2)
        T_camera_board = np.diag((1.0, -1.0, -1.0, 1.0))
        askew_deg = rng.uniform((-20, -20, -15), (20, 20, 15))
        T_camera_board[:3, :3] @= Rotation.from_euler("xyz", askew_deg, degrees=True).as_matrix()
        T_camera_board[:3, 3] = COARSE_CAMERA.lift(pixel[None], rng.uniform(0.48, 0.62, 1))[0]
        return T_camera_board

    def _is_seen(self, view: SampledView, things: Sequence[Pose]) -> bool:
        """Whether it hides its share of the view and nothing hides it."""
        hidden, seen = _coverage(view, [Rectangle(T, self.size_m, _PLAIN) for T in things])
        return self.coverage[0] < seen < self.coverage[1] and hidden < 0.01


@dataclass(frozen=True, slots=True)
class People:
    """Two or three people, each somewhere else in the other frame."""

    coverage: tuple[float, float] = (0.1, 0.3)
    """Share of the view that they hide together, in each frame."""
    step_m: float = 0.3
    """So far at least each has gone."""

    def place(self, scene: Scene, views: Sequence[SampledView], rng: Rng) -> list[list[Pose]] | None:
        count, placed = int(rng.integers(2, 4)), []
        for view in views:
            found = self._standing(scene, view, count, rng)
            if found is None:
                return None
            placed.append(found)
        gone_m = [np.linalg.norm(first[:3, 3] - second[:3, 3]) for first, second in zip(*placed, strict=True)]
        return placed if min(gone_m) > self.step_m else None

    def shapes(self, T_world_things: Sequence[Pose], rng: Rng) -> list[TexturedSurface]:
        people: list[TexturedSurface] = []
        for T_world_person in T_world_things:
            shirt = partial(label, rng) if rng.random() < 0.5 else _cloth(rng, contrast=25)
            people += _person(T_world_person, shirt, _cloth(rng, contrast=15), _skin(rng))
        return people

    def _standing(self, scene: Scene, view: SampledView, count: int, rng: Rng) -> list[Pose] | None:
        for _ in range(MAX_PLACINGS):
            T_world_people = [_on_floor(view.T_world_body, rng) for _ in range(count)]
            apart_m = pdist([T[:2, 3] for T in T_world_people])
            if min(apart_m) < 0.6 or not all(_is_free_floor(scene, T[:2, 3]) for T in T_world_people):
                continue
            people = [part for T in T_world_people for part in _person(T, _plain, _plain, _plain)]
            hidden, seen = _coverage(view, people)
            if self.coverage[0] < seen < self.coverage[1] and hidden < 0.1:
                return T_world_people
        return None


def _on_floor(T_world_camera: Pose, rng: Rng) -> Pose:
    """Somewhere before the camera, facing anywhere."""
    forward = T_world_camera[:2, 2] / np.linalg.norm(T_world_camera[:2, 2])
    ahead_m, aside = rng.uniform(0.9, 2.8), rng.uniform(-0.6, 0.6)
    x, y = T_world_camera[:2, 3] + ahead_m * (forward + aside * np.array((-forward[1], forward[0])))
    return flat((x, y, 0.0), rng.uniform(0, 360))


def _is_free_floor(scene: Scene, place: np.ndarray) -> bool:
    """Whether nothing but floor and rugs is met from above within 25 cm of a place (2,)."""
    angle = np.arange(8) * np.pi / 4
    around = 0.25 * np.vstack(((0.0, 0.0), np.column_stack((np.cos(angle), np.sin(angle)))))
    origins = np.column_stack((place + around, np.full(len(around), 2.2)))
    down = np.tile((0.0, 0.0, -1.0), (len(around), 1))
    ranges_m = np.min([surface.ranges(origins, down) for surface in scene.surfaces], axis=0)
    return bool((np.abs(ranges_m - 2.2) < 0.05).all())


def _coverage(view: SampledView, surfaces: Sequence[TexturedSurface]) -> tuple[float, float]:
    """Shares of the view where these surfaces are behind the scene, and where they are seen."""
    depth_m = render_depth(Scene(tuple(surfaces), Light((0.0, 0.0, 9.0))), COARSE_CAMERA, view.T_world_body)
    behind = (view.measured > 0) & (depth_m > view.measured)
    return float(np.mean(behind)), float(np.mean((depth_m > 0) & ~behind))


def _person(T_world_person: Pose, shirt: Pattern, trousers: Pattern, skin: Pattern) -> list[TexturedSurface]:
    """1.75 m tall, walking along x: legs, arms, a trunk of two cylinders side by side, neck and head."""
    parts: list[TexturedSurface] = []
    for side, swing_deg in ((1, 18), (-1, -18)):
        parts.append(_limb(T_world_person @ flat((0, 0.09 * side, 0.9)), swing_deg, 0.08, 0.9, trousers))
        parts.append(_limb(T_world_person @ flat((0, 0.25 * side, 1.42)), -swing_deg, 0.045, 0.62, shirt))
        trunk = T_world_person @ flat((0, 0.075 * side, 1.17))
        parts.append(Cylinder(trunk, 0.14, 0.6, shirt((2 * np.pi * 0.14, 0.6))))
    parts.append(Cylinder(T_world_person @ flat((0, 0, 1.5)), 0.055, 0.12, skin((0.35, 0.12))))
    head = (T_world_person @ (0.02, 0, 1.64, 1))[:3]
    return [*parts, Sphere((head[0], head[1], head[2]), 0.11, skin((0.7, 0.7)))]


def _limb(T_world_joint: Pose, swing_deg: float, radius_m: float, length_m: float, pattern: Pattern) -> Cylinder:
    T_joint_limb = np.eye(4)
    T_joint_limb[:3, :3] = Rotation.from_euler("y", swing_deg, degrees=True).as_matrix()
    T_joint_limb[:3, 3] = T_joint_limb[:3, :3] @ (0, 0, -length_m / 2)
    return Cylinder(T_world_joint @ T_joint_limb, radius_m, length_m, pattern((2 * np.pi * radius_m, length_m)))


def _plain(size_m: Size) -> Texture:
    return _PLAIN


def _cloth(rng: Rng, *, contrast: float) -> Pattern:
    return partial(mottled, rng, colour=vivid(rng), contrast=contrast, coarsest_m=0.2)


def _skin(rng: Rng) -> Pattern:
    return partial(mottled, rng, colour=(130, 160, 205), contrast=8, coarsest_m=0.1, texel_m=0.003)
