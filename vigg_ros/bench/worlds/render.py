# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a perfect RGB-D camera sees: one ray per depth pixel, several per colour pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vigg_ros.bench.worlds.poses import Pose
from vigg_ros.bench.worlds.scene import Scene
from vigg_ros.bench.worlds.surfaces import TexturedSurface
from vigg_ros.registration import Camera

Window = tuple[slice, slice]

_NEAR_M = 0.01
"""Corners nearer than this to the image plane do not project; their surface is tried everywhere."""
_SHUTTER_MARGIN_PX = 4
"""While the camera turns by a few degrees a pixel's path is an arc that bends by less than a pixel: some to spare."""


@dataclass(frozen=True, slots=True, eq=False)
class RollingShutter:
    """A camera that exposes its rows one after the other while it moves evenly, the middle of its image at a pose."""

    T_world_camera: Pose
    velocity_mps: NDArray[np.float64]
    """(3,), along the camera's axes."""
    turn_rate_radps: NDArray[np.float64]
    """(3,), about the camera's axes."""
    readout_s: float
    """From the first row to the last."""

    def T_world_rows(self, rows: int) -> NDArray[np.float64]:
        """(rows, 4, 4): where each row was exposed."""
        times_s = ((np.arange(rows) + 0.5) / rows - 0.5)[:, None] * self.readout_s
        T_middle_rows = np.tile(np.eye(4), (rows, 1, 1))
        T_middle_rows[:, :3, :3] = Rotation.from_rotvec(times_s * self.turn_rate_radps).as_matrix()
        T_middle_rows[:, :3, 3] = times_s * self.velocity_mps
        return self.T_world_camera @ T_middle_rows


def render_rgbd(
    scene: Scene, camera: Camera, T_world_camera: Pose | RollingShutter, *, supersampling: int = 2
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Image (H, W, 3) uint8 BGR and depth (H, W) float32, metres along z at pixel centres, 0 = nothing.

    supersampling squared is the number of rays averaged in a colour pixel. A depth is along the z of its row.
    """
    image = render_image(scene, camera, T_world_camera, supersampling=supersampling)
    return image, render_depth(scene, camera, T_world_camera)


def render_depth(scene: Scene, camera: Camera, T_world_camera: Pose | RollingShutter) -> NDArray[np.float32]:
    """Depth (H, W) float32, metres along z at pixel centres, 0 where there is nothing."""
    depth_m, nearest = _cast(scene, _View.of(camera, T_world_camera, 1))
    return np.where(nearest >= 0, depth_m, 0).astype(np.float32)


def render_image(
    scene: Scene, camera: Camera, T_world_camera: Pose | RollingShutter, *, supersampling: int = 2
) -> NDArray[np.uint8]:
    """Image (H, W, 3) uint8 BGR."""
    view = _View.of(camera, T_world_camera, supersampling)
    colours = _shade(scene, view, *_cast(scene, view))
    blocks = colours.reshape(camera.height_px, supersampling, camera.width_px, supersampling, 3)
    image: NDArray[np.uint8] = np.rint(blocks.mean(axis=(1, 3))).astype(np.uint8)
    return image


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """The rays of a camera whose pixels are split; directions (H, W, 3) have z = 1 in the frame of their row."""

    camera: Camera
    T_world_rows: NDArray[np.float64]
    """(1, 4, 4), or (H, 4, 4) where each row has a pose of its own."""
    directions: NDArray[np.float64]

    @classmethod
    def of(cls, camera: Camera, T_world_camera: Pose | RollingShutter, scale: int) -> _View:
        fine = Camera(
            camera.width_px * scale, camera.height_px * scale, camera.fx_px * scale, camera.fy_px * scale,
            (camera.cx_px + 0.5) * scale - 0.5, (camera.cy_px + 0.5) * scale - 0.5,
        )  # fmt: skip
        if isinstance(T_world_camera, RollingShutter):
            T_world_rows = T_world_camera.T_world_rows(fine.height_px)
        else:
            T_world_rows = T_world_camera[None]
        x = (np.arange(fine.width_px) - fine.cx_px) / fine.fx_px
        y = (np.arange(fine.height_px) - fine.cy_px) / fine.fy_px
        right, down, forward = (T_world_rows[:, None, :3, axis] for axis in range(3))
        directions = x[None, :, None] * right + y[:, None, None] * down + forward
        return cls(fine, T_world_rows, directions)

    def origins(self, rows: slice) -> NDArray[np.float64]:
        """Where the rays of these rows start: (3,), or (rows, 1, 3) where each row has a pose of its own."""
        return self.T_world_rows[0, :3, 3] if len(self.T_world_rows) == 1 else self.T_world_rows[rows, None, :3, 3]

    def ray_origins(self, rays: NDArray[np.intp]) -> NDArray[np.float64]:
        """Where rays start, by their index in the image, row by row: (N, 3), or (3,) for all."""
        if len(self.T_world_rows) == 1:
            return self.T_world_rows[0, :3, 3]
        return self.T_world_rows[rays // self.camera.width_px, :3, 3]

    def window(self, surface: TexturedSurface) -> Window | None:
        """The pixels that a surface may cover, or None when it is out of sight.

        While rows are exposed things move by some pixels, nearly evenly: between the first pose and the last.
        """
        ends = self.T_world_rows[:: max(1, len(self.T_world_rows) - 1)]
        world = surface.corners()
        corners = np.concatenate([(world - T[:3, 3]) @ T[:3, :3] for T in ends])
        if (corners[:, 2] < _NEAR_M).all():
            return None
        if (corners[:, 2] < _NEAR_M).any():
            return np.s_[:, :]
        margin_px = 0 if len(ends) == 1 else _SHUTTER_MARGIN_PX
        pixels = self.camera.project(corners)
        low = np.maximum(np.floor(pixels.min(axis=0)) - margin_px, 0)
        high = np.minimum(np.ceil(pixels.max(axis=0)) + 1 + margin_px, (self.camera.width_px, self.camera.height_px))
        if (low >= high).any():
            return None
        return np.s_[int(low[1]) : int(high[1]), int(low[0]) : int(high[0])]


def _cast(scene: Scene, view: _View) -> tuple[NDArray[np.float64], NDArray[np.int16]]:
    """Per ray: depth (H, W) in metres, inf where nothing is met; the surface's index (H, W) in the scene, or -1."""
    depth_m = np.full(view.directions.shape[:2], np.inf)
    nearest = np.full(view.directions.shape[:2], -1, dtype=np.int16)
    for index, surface in enumerate(scene.surfaces):
        window = view.window(surface)
        if window is not None:
            ranges = surface.ranges(view.origins(window[0]), view.directions[window])
            nearer = ranges < depth_m[window]
            depth_m[window][nearer] = ranges[nearer]
            nearest[window][nearer] = index
    return depth_m, nearest


def _shade(scene: Scene, view: _View, depth_m: NDArray[np.float64], nearest: NDArray[np.int16]) -> NDArray[np.float32]:
    """Colours (H, W, 3) BGR in 0..255 of all rays."""
    colours = np.empty((nearest.size, 3), dtype=np.float32)
    colours[:] = scene.background_bgr
    order = np.argsort(nearest, axis=None, kind="stable")
    bounds = np.searchsorted(nearest.ravel()[order], np.arange(len(scene.surfaces) + 1))
    for index in np.flatnonzero(np.diff(bounds)):
        rays = order[bounds[index] : bounds[index + 1]]
        surface, directions = scene.surfaces[index], view.directions.reshape(-1, 3)[rays]
        ranges = depth_m.ravel()[rays]
        points = view.ray_origins(rays) + directions * ranges[:, None]
        normals = surface.normals(points)
        footprint_m = _footprints_m(directions, normals) * ranges / view.camera.fx_px
        albedo = surface.texture.sample(surface.coordinates(points), footprint_m)
        colours[rays] = albedo * scene.light.shades(points, normals)[:, None]
    return colours.reshape(*nearest.shape, 3)


def _footprints_m(directions: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """How wide a ray that is 1 m wide falls on a surface with these normals, as one number per ray (N,).

    It is 1 / cosine wide in one direction only; the geometric mean blurs little and aliases little.
    """
    cosine = np.abs((normals * directions).sum(axis=1)) / np.linalg.norm(directions, axis=1)
    return np.asarray(1 / np.sqrt(np.maximum(cosine, 0.02)))
