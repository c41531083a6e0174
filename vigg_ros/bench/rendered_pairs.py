# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A benchmark of rendered pairs: the motion is exact, so the errors are those of the methods alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from vigg_ros.bench.pairs import FramePair
from vigg_ros.bench.view_sampling import T_BASE_LIDAR, HandheldSampler, VehicleSampler
from vigg_ros.bench.worlds import (
    ImageNoise,
    KinectNoise,
    LidarModel,
    Scene,
    bare_room,
    hall_of_columns,
    render_image,
    render_lidar,
    render_rgbd,
    room,
    street,
    tiled_room,
)
from vigg_ros.bench.worlds.canvas import Rng
from vigg_ros.bench.worlds.poses import T_BODY_OPTICAL, Pose, flat
from vigg_ros.registration import Camera, Frame
from vigg_ros.registration.rigid import inverse

OVERLAPS = ((0.2, 0.45), (0.45, 0.65), (0.65, 0.9))
"""Shares of the surface that both frames see: pairs are drawn from these in turn."""

PAIRS_PER_SCENE = 6
"""Each scene, with its own textures, serves so many pairs of its kind."""

MAX_TRIES = 20
"""Motions tried from a view before another is drawn."""

HANDHELD_CAMERA = Camera(width_px=320, height_px=240, fx_px=262.5, fy_px=262.5, cx_px=159.5, cy_px=119.5)
"""A Kinect's view at half its size."""

CAR_CAMERA = Camera(width_px=512, height_px=256, fx_px=320.0, fy_px=320.0, cx_px=255.5, cy_px=127.5)
CAR_LIDAR = LidarModel(beams=32, columns=512)
T_BASE_CAMERA: Pose = flat((0.7, 0.1, 1.5), -1.5) @ T_BODY_OPTICAL


@dataclass(frozen=True, slots=True)
class SceneKind:
    """A kind of scene and how it is seen."""

    scene: Callable[[int], Scene]
    share: int
    """Of every eight pairs."""
    what: str
    depth_noise: KinectNoise = KinectNoise()
    image_sigma: float = 2.0
    gain: float = 0.05
    """Standard deviation of the logarithm of the exposure."""


_NOISY_DEPTH = KinectNoise(sigma_per_m2=0.0045, dropout=0.02)

SCENE_KINDS = {
    "room": SceneKind(room, 2, "furnished rooms"),
    "street": SceneKind(street, 2, "streets, camera and 32-beam LiDAR"),
    "repeated structure": SceneKind(hall_of_columns, 1, "a hall whose columns and tiles repeat every 1.2 m"),
    "repeated texture": SceneKind(tiled_room, 1, "rooms with one tile and one poster everywhere"),
    "weak texture": SceneKind(bare_room, 1, "white rooms with two boxes"),
    "noise": SceneKind(
        room, 1, "furnished rooms; depth noise times three, grain, other exposure", _NOISY_DEPTH, 12, 0.3
    ),
}

STREET = "street"
"""The kind that is seen with a LiDAR, and judged by the limits outdoors."""


@dataclass(frozen=True, slots=True)
class RenderedView:
    """A view of a rendered scene; rendered when it is asked for."""

    kind: str
    scene_seed: int
    T_world_body: tuple[float, ...]
    """(16,) of the camera's optical frame, or of the car."""
    noise_seed: int

    @property
    def name(self) -> str:
        """Kind, scene, and the draw of its noise."""
        return f"{self.kind} {self.scene_seed}.{self.noise_seed}"

    def load(self) -> Frame:
        pose = np.array(self.T_world_body).reshape(4, 4)
        scene, rng = scene_of(self.kind, self.scene_seed), np.random.default_rng(self.noise_seed)
        kind = SCENE_KINDS[self.kind]
        noise = ImageNoise(gain=float(np.exp(kind.gain * rng.standard_normal())), sigma=kind.image_sigma)
        if self.kind == STREET:
            image = noise.apply(render_image(scene, CAR_CAMERA, pose @ T_BASE_CAMERA), rng)
            points, _ = render_lidar(scene, pose @ T_BASE_LIDAR, CAR_LIDAR, rng=rng)
            return Frame.from_points(image, points, CAR_CAMERA, inverse(T_BASE_CAMERA) @ T_BASE_LIDAR)
        image, depth_m = render_rgbd(scene, HANDHELD_CAMERA, pose)
        return Frame.from_depth(
            noise.apply(image, rng), kind.depth_noise.apply(depth_m, HANDHELD_CAMERA, rng), HANDHELD_CAMERA
        )


@lru_cache(maxsize=8)
def scene_of(kind: str, seed: int) -> Scene:
    """The scene; one of each kind is kept, as building it takes seconds."""
    return SCENE_KINDS[kind].scene(seed)


def rendered_pair(number: int, seed: int) -> FramePair:
    """One of the pairs of a seed: all kinds in turn, the same whatever other pairs are made."""
    cycle = [name for turn in range(2) for name, kind in SCENE_KINDS.items() if kind.share > turn]
    turns, rest = divmod(number, len(cycle))
    kind = cycle[rest]
    earlier = turns * SCENE_KINDS[kind].share + cycle[:rest].count(kind)
    scene_seed = 1000 * seed + earlier // PAIRS_PER_SCENE
    bounds = OVERLAPS[earlier % len(OVERLAPS)]
    bodies, overlap = _draw(kind, scene_of(kind, scene_seed), bounds, np.random.default_rng((seed, number)))
    target, source = (
        RenderedView(kind, scene_seed, tuple(T_world_body.ravel().tolist()), 2 * (100000 * seed + number) + i)
        for i, T_world_body in enumerate(bodies)
    )
    T_body_points = T_BASE_LIDAR if kind == STREET else np.eye(4)
    T_target_source = inverse(bodies[0] @ T_body_points) @ bodies[1] @ T_body_points
    return FramePair(kind, target, source, T_target_source, round(overlap, 3))


def _draw(kind: str, scene: Scene, bounds: tuple[float, float], rng: Rng) -> tuple[list[Pose], float]:
    """Poses of target and source in the world, and their overlap, within the bounds."""
    sampler = VehicleSampler(scene) if kind == STREET else HandheldSampler(scene)
    while True:
        first = sampler.draw(rng)
        for _ in range(MAX_TRIES):
            second = sampler.draw_near(first, rng)
            overlap = sampler.overlap(first, second)
            if bounds[0] <= overlap < bounds[1]:
                views = (first, second) if rng.random() < 0.5 else (second, first)
                return [view.T_world_body for view in views], overlap
