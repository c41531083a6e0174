# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A car with a camera and a LiDAR in a rendered street: frames whose motion is known exactly."""

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.worlds import LidarModel, Scene, render_image, render_lidar, street
from vigg_ros.bench.worlds.poses import T_BODY_OPTICAL, Pose, flat
from vigg_ros.registration import Camera, Config, Frame, Registration, extract
from vigg_ros.registration.features import Features
from vigg_ros.registration.result import Outcome
from vigg_ros.registration.rigid import angle_rad, inverse

CAMERA = Camera(width_px=512, height_px=256, fx_px=320.0, fy_px=320.0, cx_px=255.5, cy_px=127.5)
LIDAR = LidarModel(beams=32, columns=512)
T_BASE_LIDAR: Pose = flat((0.1, 0.0, 1.9), 2.0)
T_BASE_CAMERA: Pose = flat((0.7, 0.1, 1.5), -1.5) @ T_BODY_OPTICAL
T_CAMERA_LIDAR: Pose = inverse(T_BASE_CAMERA) @ T_BASE_LIDAR
CONFIG = Config.preset("lidar")


@cache
def a_street() -> Scene:
    """The one that the bundled bag shows."""
    return street(seed=3)


def along(x_m: float) -> Pose:
    """T_world_base on the right lane of the main street."""
    return flat((x_m, -0.6, 0.0))


def rigid_frame(T_world_base: Pose, *, seed: int, scene: Scene | None = None) -> Frame:
    """What the car sees at rest; the seed draws the range noise."""
    scene = a_street() if scene is None else scene
    image = render_image(scene, CAMERA, T_world_base @ T_BASE_CAMERA, supersampling=1)
    points, _ = render_lidar(scene, T_world_base @ T_BASE_LIDAR, LIDAR, rng=np.random.default_rng(seed))
    return Frame.from_points(image, points, CAMERA, T_CAMERA_LIDAR)


def moving_frame(T_world_base: Callable[[float], Pose], *, stamp_s: float, seed: int) -> Frame:
    """What the car sees around a stamp while it follows a motion, with the time of each point."""

    def lidar_at(since_stamp_s: float) -> Pose:
        return T_world_base(stamp_s + since_stamp_s) @ T_BASE_LIDAR

    image = render_image(a_street(), CAMERA, T_world_base(stamp_s) @ T_BASE_CAMERA, supersampling=1)
    points, times_s = render_lidar(a_street(), lidar_at, LIDAR, rng=np.random.default_rng(seed))
    stamp_ns = round(stamp_s * 1e9)
    return Frame.from_points(image, points, CAMERA, T_CAMERA_LIDAR, stamp_ns=stamp_ns, times_s=times_s)


@cache
def frame_along(x_m: float) -> Frame:
    """A frame on the main street; each place has noise of its own."""
    return rigid_frame(along(x_m), seed=round(x_m) + 1000)


@cache
def features_along(x_m: float) -> Features:
    """Its features."""
    return extract(frame_along(x_m), CONFIG)


def lidar_motion(T_world_target_base: Pose, T_world_source_base: Pose) -> NDArray[np.float64]:
    """The true T_target_source of the scans of two places."""
    return inverse(T_world_target_base @ T_BASE_LIDAR) @ T_world_source_base @ T_BASE_LIDAR


def errors(T_estimated: NDArray[np.float64], T_true: NDArray[np.float64]) -> tuple[float, float]:
    """TE in metres and RE in degrees."""
    T_error = inverse(T_true) @ T_estimated
    return float(np.linalg.norm(T_error[:3, 3])), float(np.rad2deg(angle_rad(T_error[:3, :3])))


def is_wrong(outcome: Outcome, T_true: NDArray[np.float64]) -> bool:
    """Whether it is an answer beyond what counts as registered outdoors: 60 cm and 5 deg."""
    if not isinstance(outcome, Registration):
        return False
    translation_m, rotation_deg = errors(outcome.T_target_source, T_true)
    return translation_m > 0.6 or rotation_deg > 5.0
