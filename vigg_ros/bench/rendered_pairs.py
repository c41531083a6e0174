# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A benchmark of rendered pairs: the motion is exact, so the errors are those of the methods alone."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from itertools import count

import numpy as np

from vigg_ros.bench.foregrounds import Board, Foreground, People
from vigg_ros.bench.pairs import FramePair
from vigg_ros.bench.view_sampling import (
    T_BASE_LIDAR,
    Bounds,
    HandheldSampler,
    Handling,
    VehicleSampler,
    counter_viewpoint,
    hall_viewpoint,
    nudge,
    shelf_viewpoint,
    walk,
    workshop_viewpoint,
)
from vigg_ros.bench.worlds import (
    ImageNoise,
    KinectNoise,
    LidarModel,
    RollingShutter,
    Scene,
    StereoNoise,
    bare_room,
    hall_of_columns,
    kitchen_row,
    render_image,
    render_lidar,
    render_rgbd,
    room,
    shelf,
    street,
    tiled_room,
    workshop,
)
from vigg_ros.bench.worlds.canvas import Rng
from vigg_ros.bench.worlds.poses import T_BODY_OPTICAL, Pose, flat
from vigg_ros.registration import Camera, ConfigError, Frame
from vigg_ros.registration.rigid import inverse

OVERLAPS = ((0.2, 0.45), (0.45, 0.65), (0.65, 0.9))
"""Shares of the surface that both frames see: pairs are drawn from these in turn, unless their kind says otherwise."""
NEARLY_ALL = (0.9, 1.0)
"""And what is left, which only small motions leave."""

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
    """Of every eight pairs of its family."""
    what: str
    depth_noise: KinectNoise | StereoNoise = KinectNoise()
    image_sigma: float = 2.0
    gain: float = 0.05
    """Standard deviation of the logarithm of the exposure."""
    handling: Handling = Handling()
    overlaps: tuple[Bounds, ...] = OVERLAPS
    foreground: Foreground | None = None
    """What hides a part of the scene and does not stay with it."""
    readout_s: float = 0.0
    """From the exposure of the first row to that of the last, of a rolling shutter in a moving hand."""


_NOISY_DEPTH = KinectNoise(sigma_per_m2=0.0045, dropout=0.02)

PLACES = {
    "room": SceneKind(room, 2, "furnished rooms"),
    "street": SceneKind(street, 2, "streets, camera and 32-beam LiDAR"),
    "repeated structure": SceneKind(
        hall_of_columns, 1, "a hall whose columns and tiles repeat every 1.2 m", handling=Handling(hall_viewpoint)
    ),
    "repeated texture": SceneKind(tiled_room, 1, "rooms with one tile and one poster everywhere"),
    "weak texture": SceneKind(bare_room, 1, "white rooms with two boxes"),
    "noise": SceneKind(
        room, 1, "furnished rooms; depth noise times three, grain, other exposure", _NOISY_DEPTH, 12, 0.3
    ),
}

DISTURBANCES = {
    "far depth": SceneKind(
        workshop, 1, "a hall of 14 x 9 m seen with stereo depth up to 10 m", StereoNoise(),
        handling=Handling(workshop_viewpoint, partial(walk, shift_m=(1.4, 0.25, 1.2))),
    ),
    "close shelf": SceneKind(
        shelf, 1, "a shelf 40 to 90 cm away, stereo depth, motions of 3 to 20 cm", StereoNoise(),
        handling=Handling(shelf_viewpoint, partial(nudge, turn_deg=(0.0, 15.0), shift_m=(0.03, 0.2)), 0.3),
        overlaps=OVERLAPS[1:],
    ),
    "equal doors": SceneKind(
        kitchen_row, 1, "a kitchen counter whose doors repeat every 0.6 m",
        handling=Handling(counter_viewpoint, partial(walk, turn_deg=(8, 25, 6), shift_m=(1.2, 0.1, 0.3))),
    ),
    "own body": SceneKind(room, 1, "furnished rooms, a board fixed to the camera over 30 % of the view",
                          foreground=Board()),
    "moving board": SceneKind(room, 1, "the same with the board 15 cm elsewhere in the other frame",
                              foreground=Board(shift_m=0.15, coverage=(0.2, 0.4))),
    "people walking": SceneKind(room, 1, "furnished rooms, two or three people over 10 to 30 % of the view, who walk",
                                foreground=People()),
    "rolling shutter": SceneKind(room, 1, "furnished rooms; rows exposed over 25 ms at 50 to 120 deg/s",
                                 readout_s=0.025),
    "small motion": SceneKind(room, 1, "furnished rooms, motions of 1 to 5 cm and up to 3 deg",
                              handling=Handling(motion=nudge), overlaps=((0.65, 1.0),)),
}  # fmt: skip

"""What a sensor, a place or things in view make harder, one thing at a time."""

SCENE_KINDS = {**PLACES, **DISTURBANCES}

_CYCLES = tuple(
    [name for turn in range(2) for name, kind in family.items() if kind.share > turn]
    for family in (PLACES, DISTURBANCES)
)
"""Which kinds come in turn, eight of each family."""
_CYCLE = 8
_DRAWS_PER_FAMILY = 50_000
"""The draws of a family have numbers of their own: those of the first are what they were before there was a second."""

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
    T_world_things: tuple[tuple[float, ...], ...] = ()
    """(16,) of each thing in the foreground."""

    @property
    def name(self) -> str:
        """Kind, scene, and the draw of its noise."""
        return f"{self.kind} {self.scene_seed}.{self.noise_seed}"

    def load(self) -> Frame:
        pose = np.array(self.T_world_body).reshape(4, 4)
        kind, rng = SCENE_KINDS[self.kind], np.random.default_rng(self.noise_seed)
        scene = self._scene(kind)
        noise = ImageNoise(gain=float(np.exp(kind.gain * rng.standard_normal())), sigma=kind.image_sigma)
        if self.kind == STREET:
            image = noise.apply(render_image(scene, CAR_CAMERA, pose @ T_BASE_CAMERA), rng)
            points, _ = render_lidar(scene, pose @ T_BASE_LIDAR, CAR_LIDAR, rng=rng)
            return Frame.from_points(image, points, CAR_CAMERA, inverse(T_BASE_CAMERA) @ T_BASE_LIDAR)
        eye = swung(pose, kind.readout_s, rng) if kind.readout_s > 0 else pose
        image, depth_m = render_rgbd(scene, HANDHELD_CAMERA, eye)
        seen = noise.apply(image, rng)
        if isinstance(kind.depth_noise, StereoNoise):
            measured_m = kind.depth_noise.apply(depth_m, HANDHELD_CAMERA, rng, image=image)
        else:
            measured_m = kind.depth_noise.apply(depth_m, HANDHELD_CAMERA, rng)
        return Frame.from_depth(seen, measured_m, HANDHELD_CAMERA)

    def _scene(self, kind: SceneKind) -> Scene:
        """With what stands before it, which is the same in both frames of a pair."""
        scene = scene_of(self.kind, self.scene_seed)
        if kind.foreground is None:
            return scene
        T_world_things = [np.array(values).reshape(4, 4) for values in self.T_world_things]
        things = kind.foreground.shapes(T_world_things, np.random.default_rng(self.noise_seed // 2))
        return replace(scene, surfaces=(*scene.surfaces, *things))


def swung(T_world_camera: Pose, readout_s: float, rng: Rng) -> RollingShutter:
    """A hand that turns at 50 to 120 deg/s, mostly about the vertical, and moves at up to 0.6 m/s."""
    axis = np.array((rng.uniform(-0.4, 0.4), rng.choice((-1.0, 1.0)), rng.uniform(-0.3, 0.3)))
    rate_radps = np.radians(rng.uniform(50, 120)) * axis / np.linalg.norm(axis)
    return RollingShutter(T_world_camera, rng.uniform(-0.35, 0.35, 3), rate_radps, readout_s)


def scene_of(kind: str, seed: int) -> Scene:
    """The scene; kinds with the same places share it."""
    return _built(SCENE_KINDS[kind].scene, seed)


@lru_cache(maxsize=12)
def _built(scene: Callable[[int], Scene], seed: int) -> Scene:
    """A scene of each kind is kept, as building it takes up to seconds."""
    return scene(seed)


def rendered_pair(number: int, seed: int) -> FramePair:
    """One of the pairs of a seed: all kinds in turn, the same whatever other pairs are made."""
    kind, draw, earlier = _turn(number)
    scene_seed = 1000 * seed + earlier // PAIRS_PER_SCENE
    bounds = SCENE_KINDS[kind].overlaps[earlier % len(SCENE_KINDS[kind].overlaps)]
    drawn = _draw(kind, scene_of(kind, scene_seed), bounds, np.random.default_rng((seed, draw)))
    target, source = (
        RenderedView(kind, scene_seed, _flattened(T_world_body), 2 * (100000 * seed + draw) + i,
                     tuple(map(_flattened, drawn.T_world_things[i])))
        for i, T_world_body in enumerate(drawn.T_world_bodies)
    )  # fmt: skip
    T_body_points = T_BASE_LIDAR if kind == STREET else np.eye(4)
    T_target_source = inverse(drawn.T_world_bodies[0] @ T_body_points) @ drawn.T_world_bodies[1] @ T_body_points
    return FramePair(kind, target, source, T_target_source, round(drawn.overlap, 3))


def kind_of(number: int) -> str:
    """The kind of a pair."""
    return _turn(number)[0]


def pair_numbers(kinds: Collection[str]) -> Iterator[int]:
    """The numbers of all pairs of these kinds, without end. Raises ConfigError for kinds that there are not."""
    unknown = [kind for kind in kinds if kind not in SCENE_KINDS]
    if unknown or not kinds:
        raise ConfigError(f"found kinds {', '.join(unknown) or 'none'}; expected some of: {', '.join(SCENE_KINDS)}")
    return (number for number in count() if kind_of(number) in kinds)


def number_of(view_name: str, seed: int) -> int:
    """The number of the pair that a view of this name belongs to."""
    draw = int(view_name.rpartition(".")[2]) // 2 - 100000 * seed
    family, place = divmod(draw, _DRAWS_PER_FAMILY)
    turns, rest = divmod(place, _CYCLE)
    return (turns * len(_CYCLES) + family) * _CYCLE + rest


def _turn(number: int) -> tuple[str, int, int]:
    """Of a pair: its kind, the number of its draw, and how many of its kind are before it."""
    rounds, rest = divmod(number, _CYCLE)
    turns, family = divmod(rounds, len(_CYCLES))
    cycle = _CYCLES[family]
    earlier = turns * SCENE_KINDS[cycle[rest]].share + cycle[:rest].count(cycle[rest])
    return cycle[rest], family * _DRAWS_PER_FAMILY + turns * _CYCLE + rest, earlier


@dataclass(frozen=True, slots=True, eq=False)
class _Draw:
    """Target and source in the world, and what stands before each."""

    T_world_bodies: list[Pose]
    T_world_things: list[list[Pose]]
    overlap: float


def _draw(kind: str, scene: Scene, bounds: Bounds, rng: Rng) -> _Draw:
    """Poses with an overlap within the bounds."""
    how = SCENE_KINDS[kind]
    sampler = VehicleSampler(scene) if kind == STREET else HandheldSampler(scene, how.handling)
    while True:
        first = sampler.draw(rng)
        for _ in range(MAX_TRIES):
            second = sampler.draw_near(first, rng)
            overlap = sampler.overlap(first, second)
            if bounds[0] <= overlap < bounds[1]:
                views = (first, second) if rng.random() < 0.5 else (second, first)
                things = how.foreground.place(scene, views, rng) if how.foreground else [[], []]
                if things is not None:
                    return _Draw([view.T_world_body for view in views], things, overlap)


def _flattened(T: Pose) -> tuple[float, ...]:
    return tuple(T.ravel().tolist())
