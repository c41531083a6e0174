# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scans against the surfaces that they hit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from vigg_ros.bench.worlds import LidarModel, Scene, render_lidar, scan_lidar
from vigg_ros.bench.worlds.poses import Pose, flat, upright
from vigg_ros.bench.worlds.surfaces import Rectangle
from vigg_ros.registration import ConfigError
from vigg_ros_testing.simple_scenes import plain_texture, scene_of

MODEL = LidarModel(beams=16, columns=180)


def four_walls() -> Scene:
    """Walls at x = +-10 and y = +-6, 20 m high: every beam of the model meets one."""
    walls = (((10, 0, 0), 180, 12), ((-10, 0, 0), 0, 12), ((0, 6, 0), 270, 20), ((0, -6, 0), 90, 20))
    return scene_of(*(Rectangle(upright(at, facing), (wide, 20), plain_texture()) for at, facing, wide in walls))


def off_the_walls_m(points: NDArray[np.floating]) -> NDArray[np.floating]:
    return np.maximum(np.abs(points[:, 0]) - 10, np.abs(points[:, 1]) - 6)


def moved(T_world_lidar: Pose, points: NDArray[np.floating]) -> NDArray[np.floating]:
    return points @ T_world_lidar[:3, :3].T + T_world_lidar[:3, 3]


def test_points_lie_on_the_walls() -> None:
    T_world_lidar = flat((2.0, -1.0, 0.5), 35)
    points, times_s = render_lidar(four_walls(), T_world_lidar, MODEL)
    assert points.dtype == np.float32
    assert points.shape == (16 * 180, 3)
    assert times_s.shape == (16 * 180,)
    # Float32 metres of up to 16 m are exact to a micrometre.
    np.testing.assert_allclose(off_the_walls_m(moved(T_world_lidar, points)), 0, atol=5e-6)


def test_columns_fire_from_rear_to_rear_and_the_middle_points_forward() -> None:
    points, times_s = render_lidar(four_walls(), flat((0, 0, 0)), MODEL)
    azimuth = np.arctan2(points[:, 1], points[:, 0])
    assert (np.diff(times_s) >= 0).all()
    # One turn in 0.1 s: azimuth = time / 0.1 s * 2 pi, zero at the stamp; float32 angles to 1e-6.
    np.testing.assert_allclose(azimuth, times_s / 0.1 * 2 * np.pi, atol=1e-5)


def test_beams_span_the_elevations() -> None:
    points, _ = render_lidar(four_walls(), flat((0, 0, 0)), MODEL)
    elevation_deg = np.degrees(np.arctan2(points[:, 2], np.hypot(points[:, 0], points[:, 1])))
    expected_deg = np.tile(np.linspace(-25, 15, 16), 180)
    np.testing.assert_allclose(elevation_deg, expected_deg, atol=1e-3)


def test_a_moving_scan_is_straight_again_with_the_pose_of_each_column() -> None:
    def motion(time_s: float) -> Pose:
        return flat((8.0 * time_s, 0, 0), 90.0 * time_s)

    points, times_s = render_lidar(four_walls(), motion, MODEL)
    in_world = np.concatenate([moved(motion(time_s), points[times_s == time_s]) for time_s in np.unique(times_s)])
    np.testing.assert_allclose(off_the_walls_m(in_world), 0, atol=5e-6)
    # Taken as rigid it is bent: from the middle to the ends of the scan the sensor moves 0.4 m.
    assert np.abs(off_the_walls_m(moved(motion(0.0), points))).max() > 0.3


def test_range_noise_has_the_stated_spread() -> None:
    rng = np.random.default_rng(5)
    exact, _ = render_lidar(four_walls(), flat((0, 0, 0)), MODEL)
    noisy, _ = render_lidar(four_walls(), flat((0, 0, 0)), MODEL, rng=rng)
    errors_m = np.linalg.norm(noisy, axis=1) - np.linalg.norm(exact, axis=1)
    # 2,880 samples: the spread of a spread is 1 / sqrt(2 n) = 1.3 %, four of those.
    assert errors_m.std() == pytest.approx(0.02, rel=0.053)
    assert abs(errors_m.mean()) < 4 * 0.02 / np.sqrt(2880)


def test_what_is_too_far_or_too_near_gives_no_return() -> None:
    points, _ = render_lidar(four_walls(), flat((9.7, 0, 0)), replace(MODEL, range_max_m=9.0))
    ranges_m = np.linalg.norm(points, axis=1)
    assert ranges_m.min() >= 0.5
    assert ranges_m.max() <= 9.0
    assert 0 < len(points) < 16 * 180


def test_intensity_falls_with_the_angle_of_incidence() -> None:
    scan = scan_lidar(four_walls(), flat((0, 0, 0)), MODEL)
    ahead = np.argmin(np.linalg.norm(scan.points - (10, 0, 0), axis=1))
    cosine = 10 / np.linalg.norm(scan.points[ahead])
    assert scan.intensities[ahead] == pytest.approx(128 * cosine, abs=0.1)
    assert scan.intensities.max() <= 128


def test_a_model_without_beams_is_refused() -> None:
    with pytest.raises(ConfigError, match="expected beams"):
        LidarModel(beams=0)
