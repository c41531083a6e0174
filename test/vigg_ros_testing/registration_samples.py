# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the tests of the method share: motions, matches, places to look at, and sensors to look with."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vigg_ros.bench.worlds import ImageNoise, KinectNoise, Light, Scene, render_rgbd
from vigg_ros.bench.worlds.canvas import vivid
from vigg_ros.bench.worlds.patterns import mottled, poster
from vigg_ros.bench.worlds.poses import Pose, flat, look_at, upright
from vigg_ros.bench.worlds.surfaces import Cylinder, Rectangle, Sphere, TexturedSurface, box
from vigg_ros.registration import Camera, Config, Features, Frame, Registration, extract
from vigg_ros.registration.matches import Matches

CAMERA = Camera(width_px=160, height_px=120, fx_px=138.5, fy_px=138.5, cx_px=79.5, cy_px=59.5)
"""The field of view of a Kinect at a quarter of its size: a frame takes a tenth of a second."""

EYE, TARGET = np.array((-1.0, 0.2, 1.4)), np.array((1.5, 0.1, 0.8))
"""A place in the rendered room, and one to look at from there, over table and shelves."""


def looking(
    eye: Sequence[float] = (0, 0, 0), target: Sequence[float] = (0, 0, 0), roll_deg: float = 0.0
) -> NDArray[np.float64]:
    """T_world_camera in the room: from EYE to TARGET, both shifted by some metres."""
    return look_at(EYE + eye, TARGET + target, roll_deg)


def motion(rotation_deg: Sequence[float], translation_m: Sequence[float]) -> Pose:
    """A rigid motion (4, 4) of a rotation vector and a translation."""
    T_target_source = np.eye(4)
    T_target_source[:3, :3] = Rotation.from_rotvec(rotation_deg, degrees=True).as_matrix()
    T_target_source[:3, 3] = translation_m
    return T_target_source


def random_motion(rng: np.random.Generator, *, metres: float = 1.0) -> Pose:
    """A motion with any rotation, and a translation of some metres."""
    return motion(Rotation.random(random_state=rng).as_rotvec(degrees=True), rng.normal(0, metres, 3))


def apply(T_target_source: Pose, points: NDArray[np.floating]) -> NDArray[np.float64]:
    """Points (N, 3) moved one after another: no shortcut that could share a mistake with the code."""
    moved = [T_target_source[:3, :3] @ point + T_target_source[:3, 3] for point in points]
    return np.array(moved).reshape(-1, 3)


def error_vector(T_found: Pose, T_true: Pose) -> NDArray[np.float64]:
    """(6,): what was added to the true motion, in the order and axes of ``Registration.covariance``."""
    turned = Rotation.from_matrix(T_found[:3, :3] @ T_true[:3, :3].T)
    return np.concatenate((T_found[:3, 3] - T_true[:3, 3], turned.as_rotvec()))


def normalised_error(found: Registration, T_true: Pose) -> float:
    """e^T C^-1 e: with an honest covariance it follows chi-square with 6 degrees of freedom."""
    error = error_vector(found.T_target_source, T_true)
    return float(error @ np.linalg.solve(found.covariance, error))


def errors(T_found: Pose, T_true: Pose) -> tuple[float, float]:
    """Rotation error (deg) and translation error (m)."""
    vector = error_vector(T_found, T_true)
    return float(np.rad2deg(np.linalg.norm(vector[3:]))), float(np.linalg.norm(vector[:3]))


def truth(T_world_target: Pose, T_world_source: Pose) -> Pose:
    """The exact T_target_source of two places."""
    return np.linalg.inv(T_world_target) @ T_world_source


def assert_near(T_found: Pose, T_true: Pose, *, rotation_deg: float, translation_m: float) -> None:
    """Off by less than these, which depend on what the frames show."""
    found = errors(T_found, T_true)
    assert found[0] < rotation_deg, found
    assert found[1] < translation_m, found


def matches_of(target: NDArray[np.floating], source: NDArray[np.floating]) -> Matches:
    """Matches of points beside each other, all of full weight."""
    rows = np.arange(len(target))
    count = len(target)
    return Matches(
        np.asarray(target, float), np.asarray(source, float), np.ones(count), rows, rows, np.zeros(count)
    )


def answer(outcome: object) -> Registration:
    """The outcome, which must be an answer; a rejection is shown whole."""
    assert isinstance(outcome, Registration), outcome
    return outcome


class Studio:
    """A scene and its camera: a pose is rendered once, and measured as often as there are draws of noise."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._views: dict[bytes, tuple[NDArray[np.uint8], NDArray[np.float32]]] = {}
        self._features: dict[tuple[bytes, int | None], Features] = {}

    def view(self, T_world_camera: Pose) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Exact image and depth."""
        key = T_world_camera.tobytes()
        if key not in self._views:
            self._views[key] = render_rgbd(self.scene, CAMERA, T_world_camera)
        return self._views[key]

    def frame(self, T_world_camera: Pose, seed: int | None = None, *, gain: float = 1.0) -> Frame:
        """As a Kinect measures it with the noise of ``seed``; exactly without one."""
        image, depth_m = self.view(T_world_camera)
        return noisy(image, depth_m, seed=seed, gain=gain)

    def features(self, T_world_camera: Pose, seed: int | None = None) -> Features:
        """Features of ``frame`` with the default configuration."""
        key = T_world_camera.tobytes(), seed
        if key not in self._features:
            self._features[key] = extract(self.frame(T_world_camera, seed), Config())
        return self._features[key]

    def pair(self, poses: Sequence[Pose], seeds: Sequence[int | None] = (1, 2)) -> tuple[Features, Features]:
        """Features of a target and a source."""
        target, source = map(self.features, poses, seeds)
        return target, source


def measured(
    image: NDArray[np.uint8], depth_m: NDArray[np.float32], *, seed: int, gain: float = 1.0
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """A rendered view through the noise of a Kinect and of an image sensor, in its draw ``seed``."""
    rng = np.random.default_rng(seed)
    depth_m = KinectNoise().apply(depth_m, CAMERA, rng)
    return ImageNoise(gain=gain).apply(image, rng), depth_m


def noisy(
    image: NDArray[np.uint8], depth_m: NDArray[np.float32], *, seed: int | None, gain: float = 1.0
) -> Frame:
    """The frame of a rendered view as it is measured; exact without a seed."""
    if seed is not None:
        image, depth_m = measured(image, depth_m, seed=seed, gain=gain)
    return Frame.from_depth(image, depth_m, CAMERA)


def enlarged(scale: int) -> Camera:
    """CAMERA with so many times the pixels each way."""
    width, height = scale * CAMERA.width_px, scale * CAMERA.height_px
    return Camera(width, height, scale * CAMERA.fx_px, scale * CAMERA.fy_px, (width - 1) / 2, (height - 1) / 2)


def rendered(scene: Scene, camera: Camera, T_world_camera: Pose, *, seed: int | None) -> Frame:
    """A view of any size as a Kinect measures it; exact without a seed."""
    image, depth_m = render_rgbd(scene, camera, T_world_camera)
    if seed is not None:
        rng = np.random.default_rng(seed)
        depth_m = KinectNoise().apply(depth_m, camera, rng)
        image = ImageNoise().apply(image, rng)
    return Frame.from_depth(image, depth_m, camera)


def clutter(seed: int) -> Scene:
    """A place of its own for each seed: a floor, two slanting walls, and things standing and floating about."""
    rng = np.random.default_rng(seed)
    paint = partial(poster, rng, shapes=40, texel_m=0.008)
    rough = partial(mottled, rng, colour=vivid(rng), contrast=12, texel_m=0.012)
    side = rng.choice((-1, 1))
    surfaces: list[TexturedSurface] = [
        Rectangle(flat((0, 0, 0), rng.uniform(0, 90)), (8, 8), rough((8, 8))),
        Rectangle(upright((rng.uniform(2, 3.5), 0, 1.5), 180 + rng.uniform(-30, 30)), (8, 3), rough((8, 3))),
        Rectangle(
            upright((1, side * rng.uniform(1.2, 2.2), 1.5), -side * 90 + rng.uniform(-20, 20)),
            (8, 3),
            rough((8, 3)),
        ),
    ]
    for _ in range(9):
        x, y = rng.uniform((0.4, -1.3), (2.2, 1.3))
        wide, deep, high = rng.uniform((0.15, 0.15, 0.1), (0.6, 0.6, 1.1))
        around = np.pi * wide
        surfaces += (
            box(flat((x, y, 0), rng.uniform(0, 90)), (wide, deep, high), paint),
            (Cylinder(flat((x, y, high / 2)), wide / 2, high, paint((around, high))),),
            (Sphere((x, y, rng.uniform(0.1, 1.2)), wide / 2, paint((around, around))),),
        )[rng.integers(3)]
    return Scene(tuple(surfaces), Light((-1, 0, 2.5), ambient=0.6))


CLUTTER_VIEW = look_at((-1, 0, 1.3), (1.5, 0, 0.5))
"""From where a place of ``clutter`` is seen."""
