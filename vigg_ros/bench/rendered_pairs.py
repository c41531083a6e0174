# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A benchmark of rendered pairs: the motion is exact, so the errors are those of the methods alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from vigg_ros.bench.pairs import Wanted
from vigg_ros.bench.view_sampling import T_BASE_LIDAR, Drive, Walk
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

TRIES = 20
"""Motions tried from a place before another is drawn."""

CAMERA = Camera(width_px=320, height_px=240, fx_px=262.5, fy_px=262.5, cx_px=159.5, cy_px=119.5)
"""A Kinect's view at half its size."""

CAR_CAMERA = Camera(width_px=512, height_px=256, fx_px=320.0, fy_px=320.0, cx_px=255.5, cy_px=127.5)
LIDAR = LidarModel(beams=32, columns=512)
T_BASE_CAMERA: Pose = flat((0.7, 0.1, 1.5), -1.5) @ T_BODY_OPTICAL


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of place and how it is seen."""

    scene: Callable[[int], Scene]
    share: int
    """Of every eight pairs."""
    what: str
    depth_noise: KinectNoise = KinectNoise()
    image_sigma: float = 2.0
    gain: float = 0.05
    """Standard deviation of the logarithm of the exposure."""


_BAD = KinectNoise(sigma_per_m2=0.0045, dropout=0.02)

KINDS = {
    "room": Kind(room, 2, "furnished rooms"),
    "street": Kind(street, 2, "streets, camera and 32-beam LiDAR"),
    "repeated structure": Kind(hall_of_columns, 1, "a hall whose columns and tiles repeat every 1.2 m"),
    "repeated texture": Kind(tiled_room, 1, "rooms with one tile and one poster everywhere"),
    "weak texture": Kind(bare_room, 1, "white rooms with two boxes"),
    "noise": Kind(room, 1, "furnished rooms; depth noise times three, grain, other exposure", _BAD, 12, 0.3),
}

OUTDOOR = "street"
"""The kind that is seen with a LiDAR, and judged by the limits outdoors."""


@dataclass(frozen=True, slots=True)
class RenderedLook:
    """A view of a rendered place; rendered when it is asked for."""

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
        """Renders it."""
        pose = np.array(self.T_world_body).reshape(4, 4)
        scene, rng = scene_of(self.kind, self.scene_seed), np.random.default_rng(self.noise_seed)
        kind = KINDS[self.kind]
        noise = ImageNoise(gain=float(np.exp(kind.gain * rng.standard_normal())), sigma=kind.image_sigma)
        if self.kind == OUTDOOR:
            image = noise.apply(render_image(scene, CAR_CAMERA, pose @ T_BASE_CAMERA), rng)
            points, _ = render_lidar(scene, pose @ T_BASE_LIDAR, LIDAR, rng=rng)
            return Frame.from_points(image, points, CAR_CAMERA, inverse(T_BASE_CAMERA) @ T_BASE_LIDAR)
        image, depth_m = render_rgbd(scene, CAMERA, pose)
        return Frame.from_depth(noise.apply(image, rng), kind.depth_noise.apply(depth_m, CAMERA, rng), CAMERA)


@lru_cache(maxsize=8)
def scene_of(kind: str, seed: int) -> Scene:
    """The scene; one of each kind is kept, as building it takes seconds."""
    return KINDS[kind].scene(seed)


def rendered_pairs(count: int, seed: int) -> Iterator[Wanted]:
    """So many pairs of all kinds in turn, the same for the same seed."""
    return (rendered_pair(number, seed) for number in range(count))


def rendered_pair(number: int, seed: int) -> Wanted:
    """One of the pairs, whatever the others are."""
    cycle = [name for turn in range(2) for name, kind in KINDS.items() if kind.share > turn]
    turns, place = divmod(number, len(cycle))
    kind = cycle[place]
    earlier = turns * KINDS[kind].share + cycle[:place].count(kind)
    scene_seed = 1000 * seed + earlier // PAIRS_PER_SCENE
    overlap = OVERLAPS[earlier % len(OVERLAPS)]
    drawn = _draw(kind, scene_of(kind, scene_seed), overlap, np.random.default_rng((seed, number)))
    return _wanted(kind, scene_seed, drawn, noise_seed=2 * (100000 * seed + number))


def _draw(kind: str, scene: Scene, wanted: tuple[float, float], rng: Rng) -> tuple[Pose, Pose, float]:
    """Poses of target and source in the world, and an overlap that is as wanted."""
    glance = Drive(scene) if kind == OUTDOOR else Walk(scene)
    while True:
        first = glance.place(rng)
        for _ in range(TRIES):
            second = glance.another(first, rng)
            overlap = glance.overlap(first, second)
            if wanted[0] <= overlap < wanted[1]:
                places = (first, second) if rng.random() < 0.5 else (second, first)
                return places[0].T_world_body, places[1].T_world_body, overlap


def _wanted(kind: str, scene_seed: int, drawn: tuple[Pose, Pose, float], noise_seed: int) -> Wanted:
    T_world_target, T_world_source, overlap = drawn
    T_body_points = T_BASE_LIDAR if kind == OUTDOOR else np.eye(4)
    T_target_source = inverse(T_world_target @ T_body_points) @ T_world_source @ T_body_points
    target, source = (
        RenderedLook(kind, scene_seed, tuple(pose.ravel().tolist()), noise_seed + i)
        for i, pose in enumerate((T_world_target, T_world_source))
    )
    return Wanted(kind, target, source, T_target_source, round(overlap, 3))
