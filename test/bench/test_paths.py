# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Motions against their closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vigg_ros.bench.worlds import Drive, HandheldLoop, Leg, stamps_ns
from vigg_ros.bench.worlds.poses import T_BODY_OPTICAL, Pose, flat, look_at, upright, upside_down
from vigg_ros.registration import Camera, ConfigError

DRIVE = Drive(start=(1.0, 2.0, 0.0), start_yaw_deg=90.0, speed_mps=5.0, legs=(Leg(10.0), Leg(4 * math.pi, 90.0)))


def assert_rigid(T_world_thing: Pose) -> None:
    rotation = T_world_thing[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    assert T_world_thing[3].tolist() == [0, 0, 0, 1]


@pytest.mark.parametrize(
    "T_world_thing",
    [
        flat((1, 2, 3), 40),
        upright((1, 2, 3), 40),
        upside_down((1, 2, 3), 40),
        look_at((0, 0, 1), (3, 1, 0), 15),
        T_BODY_OPTICAL,
    ],
)
def test_poses_are_rigid(T_world_thing: Pose) -> None:
    assert_rigid(T_world_thing)


def test_an_unrolled_camera_sees_its_target_in_the_middle_and_up_above() -> None:
    camera = Camera(width_px=100, height_px=80, fx_px=90, fy_px=90, cx_px=49.5, cy_px=39.5)
    T_world_camera = look_at((1.0, 2.0, 0.5), (4.0, 1.0, 1.0))
    points = np.array([(4.0, 1.0, 1.0), (4.0, 1.0, 1.3)])
    pixels = camera.project((points - T_world_camera[:3, 3]) @ T_world_camera[:3, :3])
    np.testing.assert_allclose(pixels[0], (49.5, 39.5), atol=1e-9)
    assert pixels[1, 1] < 39.5
    assert pixels[1, 0] == pytest.approx(49.5)


def test_a_roll_turns_the_camera_clockwise() -> None:
    # Clockwise by 90 deg, seen from behind: its x axis, which pointed to the right, points down.
    np.testing.assert_allclose(look_at((0, 0, 0), (1, 0, 0), 90)[:3, 0], (0, 0, -1), atol=1e-12)


def test_a_loop_ends_where_it_began_and_moves_as_a_hand_does() -> None:
    loop = HandheldLoop()
    poses = [loop.T_world_camera(time_s) for time_s in np.linspace(0, loop.period_s, 501)]
    for T_world_camera in poses:
        assert_rigid(T_world_camera)
    np.testing.assert_allclose(poses[0], poses[-1], atol=1e-9)
    steps_m = np.linalg.norm(np.diff([pose[:3, 3] for pose in poses], axis=0), axis=1)
    speeds_mps = steps_m / (loop.period_s / 500)
    assert 0.2 < speeds_mps.min() < speeds_mps.max() < 0.7


def test_a_drive_goes_straight_then_around_a_quarter_circle() -> None:
    # North 10 m from (1, 2), then left by 90 deg on a radius of 4 pi / (pi / 2) = 8 m: to (-7, 20), west.
    np.testing.assert_allclose(DRIVE.T_world_vehicle(1.0), flat((1, 7, 0), 90), atol=1e-12)
    np.testing.assert_allclose(DRIVE.T_world_vehicle(2.0 + 4 * math.pi / 5), flat((-7, 20, 0), 180), atol=1e-9)
    halfway = DRIVE.T_world_vehicle(2.0 + 2 * math.pi / 5)
    np.testing.assert_allclose(halfway, flat((1 - 8 + 8 / 2**0.5, 12 + 8 / 2**0.5, 0), 135), atol=1e-9)


def test_a_drive_begins_before_zero_and_goes_on_behind_its_end() -> None:
    np.testing.assert_allclose(DRIVE.T_world_vehicle(-1.0), flat((1, -3, 0), 90), atol=1e-12)
    end_s = 2.0 + 4 * math.pi / 5
    np.testing.assert_allclose(DRIVE.T_world_vehicle(end_s + 2.0), flat((-17, 20, 0), 180), atol=1e-9)


def test_a_drive_keeps_its_speed() -> None:
    positions = np.array([DRIVE.T_world_vehicle(time_s)[:3, 3] for time_s in np.arange(0, 6, 0.001)])
    # Chords of 5 mm on a radius of 8 m are shorter than their arcs by less than 1e-7 of themselves.
    np.testing.assert_allclose(np.linalg.norm(np.diff(positions, axis=0), axis=1), 0.005, rtol=1e-6)


def test_stamps_keep_all_their_digits() -> None:
    start_ns = 1_772_013_245_123_456_789
    stamps = stamps_ns(4, 15.0, start_ns)
    # 1 s / 15 = 66,666,666.67 ns: each stamp is rounded, and the errors do not add up.
    assert (stamps - start_ns).tolist() == [0, 66_666_667, 133_333_333, 200_000_000]
    assert stamps.dtype == np.int64


def test_a_drive_without_speed_is_refused() -> None:
    with pytest.raises(ConfigError, match="expected speed"):
        Drive(speed_mps=0.0)
