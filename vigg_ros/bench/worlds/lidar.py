# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a spinning LiDAR measures, at rest or while it moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.worlds.poses import Pose
from vigg_ros.bench.worlds.scene import Scene
from vigg_ros.bench.worlds.surfaces import Array, TexturedSurface
from vigg_ros.registration import ConfigError

Motion = Callable[[float], Pose]
"""T_world_lidar at a time, seconds relative to the moment the beams point forward."""


@dataclass(frozen=True, slots=True)
class LidarModel:
    """Beams fired together, column by column, from the rear over left-hand turns to the rear again."""

    beams: int = 32
    elevation_min_deg: float = -25.0
    elevation_max_deg: float = 15.0
    columns: int = 512
    range_sigma_m: float = 0.02
    range_min_m: float = 0.5
    range_max_m: float = 80.0
    scan_period_s: float = 0.1

    def __post_init__(self) -> None:
        ordered = 0 <= self.range_min_m < self.range_max_m
        ordered &= self.elevation_min_deg <= self.elevation_max_deg
        spreads = (self.range_sigma_m, self.scan_period_s)
        if not ordered or min(self.beams, self.columns) < 1 or min(spreads) < 0:
            raise ConfigError(f"found {self}; expected beams, columns and limits in order; correct it")

    def directions(self) -> Array:
        """Unit directions (columns, beams, 3) in the lidar frame (x forward, y left, z up)."""
        azimuth = (np.arange(self.columns) + 0.5) / self.columns * 2 * np.pi - np.pi
        elevation = np.radians(np.linspace(self.elevation_min_deg, self.elevation_max_deg, self.beams))
        level = np.cos(elevation)
        x, y = np.cos(azimuth)[:, None] * level, np.sin(azimuth)[:, None] * level
        return np.stack((x, y, np.broadcast_to(np.sin(elevation), x.shape)), axis=-1)

    def column_times_s(self) -> Array:
        """When each column (columns,) fires, relative to the middle of the scan, where x points."""
        return ((np.arange(self.columns) + 0.5) / self.columns - 0.5) * self.scan_period_s


@dataclass(frozen=True, slots=True, eq=False)
class LidarScan:
    """The returns of one turn, in the order they were fired."""

    points: NDArray[np.float32]
    """(N, 3), metres, each in the lidar frame of the moment it was fired."""
    times_s: Array
    """(N,), relative to the middle of the scan."""
    intensities: NDArray[np.float32]
    """(N,), 0..255: the grey value of the surface times the cosine of the angle of incidence."""


def render_lidar(
    scene: Scene, T_world_lidar: Pose | Motion, model: LidarModel, *, rng: np.random.Generator | None = None
) -> tuple[NDArray[np.float32], Array]:
    """Points (N, 3) float32 in the lidar frame and times_s (N,) of a scan: see scan_lidar."""
    scan = scan_lidar(scene, T_world_lidar, model, rng=rng)
    return scan.points, scan.times_s


def scan_lidar(
    scene: Scene, T_world_lidar: Pose | Motion, model: LidarModel, *, rng: np.random.Generator | None = None
) -> LidarScan:
    """One turn of the sensor at a pose (4, 4) or along a motion; exact unless an rng adds range noise.

    A motion gives each column its own pose, and its points stay in that column's lidar frame: the
    raw scan of a moving sensor, as drivers publish it.
    """
    T_world_column = _column_poses(T_world_lidar, model)
    local = model.directions()
    directions = np.einsum("cij,cbj->cbi", T_world_column[:, :3, :3], local).reshape(-1, 3)
    origins = np.repeat(T_world_column[:, :3, 3], model.beams, axis=0)
    ranges_m, grey = _cast(scene, origins, directions)
    measured_m = ranges_m if rng is None else ranges_m + rng.normal(0, model.range_sigma_m, ranges_m.shape)
    seen = (measured_m >= model.range_min_m) & (measured_m <= model.range_max_m)
    points = local.reshape(-1, 3)[seen] * measured_m[seen, None]
    times_s = np.repeat(model.column_times_s(), model.beams)[seen]
    return LidarScan(points.astype(np.float32), times_s, grey[seen].astype(np.float32))


def _column_poses(T_world_lidar: Pose | Motion, model: LidarModel) -> Array:
    if callable(T_world_lidar):
        return np.stack([T_world_lidar(float(time_s)) for time_s in model.column_times_s()])
    return np.broadcast_to(T_world_lidar, (model.columns, 4, 4))


def _cast(scene: Scene, origins: Array, directions: Array) -> tuple[Array, Array]:
    """Ranges (N,), inf where nothing is met, and intensities (N,)."""
    ranges_m = np.full(len(origins), np.inf)
    nearest = np.full(len(origins), -1)
    for index, surface in enumerate(scene.surfaces):
        rays = _rays_near(surface, origins, directions)
        found_m = surface.ranges(origins[rays], directions[rays])
        nearer = found_m < ranges_m[rays]
        ranges_m[rays[nearer]] = found_m[nearer]
        nearest[rays[nearer]] = index
    intensities = np.zeros(len(origins))
    for index in np.unique(nearest[nearest >= 0]):
        rays = np.flatnonzero(nearest == index)
        points = origins[rays] + directions[rays] * ranges_m[rays, None]
        intensities[rays] = _intensities(scene.surfaces[index], points, directions[rays], ranges_m[rays])
    return ranges_m, intensities


def _rays_near(surface: TexturedSurface, origins: Array, directions: Array) -> NDArray[np.intp]:
    """The rays that pass through the sphere around a surface's corners."""
    corners = surface.corners()
    centre = corners.mean(axis=0)
    radius_m = np.linalg.norm(corners - centre, axis=1).max()
    offset = centre - origins
    along_m = np.einsum("ni,ni->n", offset, directions)
    beside_squared = np.einsum("ni,ni->n", offset, offset) - along_m**2
    return np.flatnonzero((beside_squared <= radius_m**2) & (along_m > -radius_m))


def _intensities(surface: TexturedSurface, points: Array, directions: Array, ranges_m: Array) -> Array:
    cosine = np.abs((surface.normals(points) * directions).sum(axis=1))
    # A beam is a few milliradians wide.
    colours = surface.texture.sample(surface.coordinates(points), 0.003 * np.maximum(ranges_m, 0.1))
    return np.asarray(colours.mean(axis=1) * cosine, dtype=np.float64)
