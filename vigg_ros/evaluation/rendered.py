# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A benchmark of rendered pairs: the motion is exact, so the errors are those of the methods alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from vigg_ros.evaluation.pairs import Wanted
from vigg_ros.registration import Camera, Frame
from vigg_ros.registration.rigid import inverse, transform
from vigg_ros.registration.visibility import DepthView
from vigg_ros.worlds import (
    ImageNoise,
    KinectNoise,
    LidarModel,
    Scene,
    bare_room,
    hall_of_columns,
    render_depth,
    render_image,
    render_lidar,
    render_rgbd,
    room,
    street,
    tiled_room,
)
from vigg_ros.worlds.poses import T_BODY_OPTICAL, Pose, flat, look_at

OVERLAPS = ((0.2, 0.45), (0.45, 0.65), (0.65, 0.9))
"""Shares of the surface that both frames see: pairs are drawn from these in turn."""

PAIRS_PER_SCENE = 6
"""Each scene, with its own textures, serves so many pairs of its kind."""

TRIES = 20
"""Motions tried from a place before another is drawn."""

CAMERA = Camera(width_px=320, height_px=240, fx_px=262.5, fy_px=262.5, cx_px=159.5, cy_px=119.5)
_GLANCE = Camera(width_px=64, height_px=48, fx_px=52.5, fy_px=52.5, cx_px=31.5, cy_px=23.5)
"""A Kinect's view at half its size, and a coarse one to measure overlaps with."""

CAR_CAMERA = Camera(width_px=512, height_px=256, fx_px=320.0, fy_px=320.0, cx_px=255.5, cy_px=127.5)
LIDAR = LidarModel(beams=32, columns=512)
T_BASE_LIDAR: Pose = flat((0.1, 0.0, 1.9), 2.0)
T_BASE_CAMERA: Pose = flat((0.7, 0.1, 1.5), -1.5) @ T_BODY_OPTICAL
_GLANCE_LIDAR = LidarModel(beams=32, columns=128)
_SAME_PLACE_M = 1.0
"""Points of two scans nearer than this, about the spacing of beams at 30 m, are of the same surface."""

Rng = np.random.Generator


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
    """Standard deviation of the exposure."""


_BAD = KinectNoise(sigma_per_m2=0.0045, dropout=0.02)

KINDS = {
    "room": Kind(room, 2, "furnished rooms"),
    "street": Kind(street, 2, "streets, camera and 32-beam LiDAR"),
    "repeated structure": Kind(hall_of_columns, 1, "a hall whose columns and tiles repeat every 1.2 m"),
    "repeated texture": Kind(tiled_room, 1, "rooms with one tile and one poster everywhere"),
    "weak texture": Kind(bare_room, 1, "white rooms with two boxes"),
    "noise": Kind(room, 1, "furnished rooms; three times the depth noise, grainy images, other exposure", _BAD, 12, 0.3),
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
        noise = ImageNoise(gain=float(1 + kind.gain * rng.standard_normal()), sigma=kind.image_sigma)
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
    """So many pairs of all kinds, the same for the same seed; the first ones are the same for any count."""
    cycle = [name for turn in range(2) for name, kind in KINDS.items() if kind.share > turn]
    made = dict.fromkeys(KINDS, 0)
    for i in range(count):
        kind = cycle[i % len(cycle)]
        scene_seed = 1000 * seed + made[kind] // PAIRS_PER_SCENE
        overlap = OVERLAPS[made[kind] % len(OVERLAPS)]
        made[kind] += 1
        drawn = _draw(kind, scene_of(kind, scene_seed), overlap, np.random.default_rng((seed, i)))
        yield _wanted(kind, scene_seed, drawn, noise_seed=2 * (100000 * seed + i))


def _draw(
    kind: str, scene: Scene, wanted: tuple[float, float], rng: Rng
) -> tuple[Pose, Pose, float]:
    """Poses of target and source in the world, and an overlap that is as wanted."""
    glance = _Drive(scene) if kind == OUTDOOR else _Walk(scene)
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


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """Where a sensor stands, and what it sees from there at a glance: depth (H, W) or points (N, 3) in the world."""

    T_world_body: Pose
    seen: NDArray[np.floating]


class _Walk:
    """Views of a camera in a hand."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._is_hall = max(surface.corners()[:, 0].max() for surface in scene.surfaces) > 20

    def place(self, rng: Rng) -> _Place:
        """A view that nothing stands right in front of."""
        while True:
            if self._is_hall:
                eye = rng.uniform((-15, -0.6, 1.2), (15, 0.6, 1.7))
                target = eye + (rng.choice((-3, 3)), rng.uniform(-2, 2), rng.uniform(-1.2, 0.0))
            else:
                eye = rng.uniform((-1.6, -1.2, 1.1), (0.2, 1.2, 1.7))
                target = rng.uniform((1.0, -1.6, 0.3), (2.4, 1.6, 1.4))
            place = self._glance(look_at(eye, target, rng.uniform(-8, 8)))
            if _is_free(place.seen):
                return place

    def another(self, first: _Place, rng: Rng) -> _Place:
        """Up to 60 deg, mostly about the vertical, and up to 1.2 m, mostly level, from the first."""
        T = np.eye(4)
        size = rng.uniform(0.1, 1.0)
        T[:3, :3] = Rotation.from_rotvec(size * rng.uniform((-20, -55, -15), (20, 55, 15)), degrees=True).as_matrix()
        T[:3, 3] = size * rng.uniform((-1.0, -0.25, -0.7), (1.0, 0.25, 0.7))
        return self._glance(first.T_world_body @ T)

    def overlap(self, first: _Place, second: _Place) -> float:
        """Mean share of each view's surface that the other sees too; 0 if the second is no free view."""
        if not _is_free(second.seen):
            return 0.0
        T_first_second = inverse(first.T_world_body) @ second.T_world_body
        forth = _seen_share(first.seen, second.seen, T_first_second)
        back = _seen_share(second.seen, first.seen, inverse(T_first_second))
        return (forth + back) / 2

    def _glance(self, T_world_camera: Pose) -> _Place:
        return _Place(T_world_camera, render_depth(self._scene, _GLANCE, T_world_camera))


class _Drive:
    """Places of a car along the main street."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene

    def place(self, rng: Rng) -> _Place:
        """Somewhere on the right lane."""
        return self._glance(flat((rng.uniform(-30, 10), rng.uniform(-1.2, 0), 0), rng.uniform(-5, 5)))

    def another(self, first: _Place, rng: Rng) -> _Place:
        """Up to 25 m further on, turned by up to 20 deg."""
        ahead_m = first.T_world_body[0, 3] + rng.uniform(1, 25)
        return self._glance(flat((ahead_m, rng.uniform(-1.2, 0), 0), rng.uniform(-20, 20)))

    def overlap(self, first: _Place, second: _Place) -> float:
        """Mean share of each scan's points that have one of the other nearby."""
        clouds = (first.seen, second.seen)
        near = [cKDTree(a).query(b, distance_upper_bound=_SAME_PLACE_M)[0] for a, b in (clouds, clouds[::-1])]
        return float(np.mean([np.mean(np.isfinite(distance)) for distance in near]))

    def _glance(self, T_world_base: Pose) -> _Place:
        T_world_lidar = T_world_base @ T_BASE_LIDAR
        return _Place(T_world_base, transform(T_world_lidar, render_lidar(self._scene, T_world_lidar, _GLANCE_LIDAR)[0]))


def _is_free(depth_m: NDArray[np.floating]) -> bool:
    """Whether the camera stands in the room, with nothing before its lens."""
    return bool(np.mean(depth_m > 0.5) > 0.97)


def _seen_share(
    viewer_m: NDArray[np.floating], other_m: NDArray[np.floating], T_viewer_other: NDArray[np.float64]
) -> float:
    """The share of the other's depth pixels whose surface the viewer sees too."""
    row, column = np.nonzero(other_m)
    pixels = np.column_stack((column, row)).astype(np.float64)
    points = _GLANCE.lift(pixels, other_m[row, column].astype(np.float64))
    behind_m = DepthView(_GLANCE, viewer_m.astype(np.float32)).behind(transform(T_viewer_other, points))
    # Coarse pixels see slanting surfaces at depths that differ by some percent.
    with np.errstate(invalid="ignore"):
        return float(np.mean(np.abs(behind_m) < 0.03 + 0.03 * other_m[row, column]))
