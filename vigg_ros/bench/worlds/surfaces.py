# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a world is made of: rectangles, spheres and cylinders, each met by rays in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.worlds.poses import Pose, flat, upright, upside_down
from vigg_ros.bench.worlds.texture import Texture
from vigg_ros.registration import ConfigError

Array = NDArray[np.float64]
Size = tuple[float, float]
Pattern = Callable[[Size], Texture]
"""Paints a face of a given width and height, metres."""


class TexturedSurface(Protocol):
    """Something a ray can meet. All arguments and results are in the world frame, metres."""

    @property
    def texture(self) -> Texture:
        """Its colours."""

    def corners(self) -> Array:
        """Points (K, 3) whose convex hull contains it: what is outside needs no ray."""

    def ranges(self, origins: Array, directions: Array) -> Array:
        """Lengths (...) along directions (..., 3) from origins (3,) or (..., 3); inf where it is missed.

        The unit is that of the direction: with z = 1 in a camera's frame, a range is a depth.
        """

    def normals(self, points: Array) -> Array:
        """Outward unit normals (N, 3) at points (N, 3) on it."""

    def coordinates(self, points: Array) -> Array:
        """Where on the texture points (N, 3) on it lie: (N, 2) metres from its middle."""


@dataclass(frozen=True, slots=True, eq=False)
class Rectangle:
    """A rectangle in the xy plane of its frame. It is seen from its front, where its z axis points."""

    T_world_surface: Pose
    size_m: Size
    texture: Texture

    def __post_init__(self) -> None:
        _check_lengths(*self.size_m)

    def corners(self) -> Array:
        return _to_world(self.T_world_surface, _CUBE * (self.size_m[0] / 2, self.size_m[1] / 2, 0))

    def ranges(self, origins: Array, directions: Array) -> Array:
        origin = _to_local(self.T_world_surface, origins)
        if (origin[..., 2] <= 0).all():
            return np.full(directions.shape[:-1], np.inf)
        x, y, z = (directions @ axis for axis in self.T_world_surface[:3, :3].T)
        with np.errstate(divide="ignore", invalid="ignore"):
            ranges = -origin[..., 2] / z
            inside = np.abs(origin[..., 0] + ranges * x) <= self.size_m[0] / 2
            inside &= np.abs(origin[..., 1] + ranges * y) <= self.size_m[1] / 2
        return np.where(inside & (z < 0) & (ranges > 0), ranges, np.inf)

    def normals(self, points: Array) -> Array:
        return np.broadcast_to(self.T_world_surface[:3, 2], points.shape)

    def coordinates(self, points: Array) -> Array:
        return _to_local(self.T_world_surface, points)[:, :2]


@dataclass(frozen=True, slots=True, eq=False)
class Sphere:
    """A ball. Its texture is laid on from the top: distance on the ball from there, by azimuth."""

    centre: tuple[float, float, float]
    radius_m: float
    texture: Texture

    def __post_init__(self) -> None:
        _check_lengths(self.radius_m)

    def corners(self) -> Array:
        return _CUBE * self.radius_m + self.centre

    def ranges(self, origins: Array, directions: Array) -> Array:
        ranges, _ = _round_ranges(origins - self.centre, directions, self.radius_m)
        with np.errstate(invalid="ignore"):
            return np.where(ranges > 0, ranges, np.inf)

    def normals(self, points: Array) -> Array:
        return (points - self.centre) / self.radius_m

    def coordinates(self, points: Array) -> Array:
        normals = self.normals(points)
        level = np.hypot(normals[:, 0], normals[:, 1])
        from_top_m = self.radius_m * np.arctan2(level, normals[:, 2])
        stretch = np.divide(from_top_m, level, out=np.zeros_like(level), where=level > 0)
        return normals[:, :2] * stretch[:, None]


@dataclass(frozen=True, slots=True, eq=False)
class Cylinder:
    """A closed upright cylinder: z is its axis and its frame is in its middle.

    The texture's x runs around the side; both lids take the texture from its middle.
    """

    T_world_surface: Pose
    radius_m: float
    height_m: float
    texture: Texture

    def __post_init__(self) -> None:
        _check_lengths(self.radius_m, self.height_m)

    def corners(self) -> Array:
        return _to_world(self.T_world_surface, _CUBE * (self.radius_m, self.radius_m, self.height_m / 2))

    def ranges(self, origins: Array, directions: Array) -> Array:
        """The cylinder is where the infinite tube meets the slab between its lids."""
        origin = _to_local(self.T_world_surface, origins)
        direction = directions @ self.T_world_surface[:3, :3]
        side_in, side_out = _round_ranges(origin[..., :2], direction[..., :2], self.radius_m)
        lid_in, lid_out = _slab_ranges(origin[..., 2], direction[..., 2], self.height_m / 2)
        enter, leave = np.maximum(side_in, lid_in), np.minimum(side_out, lid_out)
        return np.where((enter <= leave) & (enter > 0), enter, np.inf)

    def normals(self, points: Array) -> Array:
        local = _to_local(self.T_world_surface, points)
        lid = self._on_lid(local)
        side = np.column_stack((local[:, :2] / self.radius_m, np.zeros(len(local))))
        cap = np.column_stack((np.zeros((len(local), 2)), np.sign(local[:, 2])))
        return np.where(lid[:, None], cap, side) @ self.T_world_surface[:3, :3].T

    def coordinates(self, points: Array) -> Array:
        local = _to_local(self.T_world_surface, points)
        around_m = np.arctan2(local[:, 1], local[:, 0]) * self.radius_m
        side = np.column_stack((around_m, local[:, 2]))
        return np.where(self._on_lid(local)[:, None], local[:, :2], side)

    def _on_lid(self, local: Array) -> NDArray[np.bool_]:
        to_lid_m = self.height_m / 2 - np.abs(local[:, 2])
        return to_lid_m < self.radius_m - np.hypot(local[:, 0], local[:, 1])


def box(T_world_base: Pose, size_m: tuple[float, float, float], pattern: Pattern) -> tuple[Rectangle, ...]:
    """The six faces of a box, each painted for itself. Its frame is in the middle of its base, z up."""
    x_m, y_m, z_m = size_m
    faces: list[tuple[Pose, Size]] = [
        (flat((0, 0, z_m)), (x_m, y_m)),
        (upside_down((0, 0, 0)), (x_m, y_m)),
        (upright((x_m / 2, 0, z_m / 2), 0), (y_m, z_m)),
        (upright((0, y_m / 2, z_m / 2), 90), (x_m, z_m)),
        (upright((-x_m / 2, 0, z_m / 2), 180), (y_m, z_m)),
        (upright((0, -y_m / 2, z_m / 2), 270), (x_m, z_m)),
    ]
    return tuple(Rectangle(T_world_base @ T_base_face, size, pattern(size)) for T_base_face, size in faces)


_CUBE = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


def _to_local(T_world_surface: Pose, points: Array) -> Array:
    return (points - T_world_surface[:3, 3]) @ T_world_surface[:3, :3]


def _to_world(T_world_surface: Pose, points: Array) -> Array:
    return points @ T_world_surface[:3, :3].T + T_world_surface[:3, 3]


def _round_ranges(origin: Array, direction: Array, radius_m: float) -> tuple[Array, Array]:
    """Where rays enter and leave a ball (..., 3) or a circle (..., 2) around the origin; NaN where they miss."""
    squared = (direction * direction).sum(axis=-1)
    along = (direction * origin).sum(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(along**2 - squared * ((origin * origin).sum(axis=-1) - radius_m**2))
        return (-along - root) / squared, (-along + root) / squared


def _slab_ranges(origin: Array, direction: Array, half_m: float) -> tuple[Array, Array]:
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second = (-half_m - origin) / direction, (half_m - origin) / direction
    return np.minimum(first, second), np.maximum(first, second)


def _check_lengths(*lengths_m: float) -> None:
    if not all(math.isfinite(length_m) and length_m > 0 for length_m in lengths_m):
        raise ConfigError(f"found a surface with lengths {lengths_m} m; expected positive ones; correct them")
