# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Motions against their closed forms; the street and the ambiguous scenes are what they claim to be."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from vigg_ros.bench.worlds import (
    DOOR_M,
    HALL_PERIOD_M,
    STREET_DRIVE,
    Drive,
    HandheldLoop,
    Leg,
    LidarModel,
    Scene,
    bare_room,
    blank_plane,
    hall_of_columns,
    kitchen_row,
    render_depth,
    render_image,
    render_lidar,
    render_rgbd,
    shelf,
    single_plane,
    stamps_ns,
    street,
    tiled_room,
    workshop,
)  # fmt: skip
from vigg_ros.bench.worlds.poses import T_BODY_OPTICAL, Pose, flat, look_at, upright, upside_down
from vigg_ros.registration import Camera, ConfigError
from vigg_ros.registration.rigid import inverse, transform
from vigg_ros_testing.simple_scenes import CAMERA

DRIVE = Drive(start=(1.0, 2.0, 0.0), start_yaw_deg=90.0, speed_mps=5.0, legs=(Leg(10.0), Leg(4 * math.pi, 90.0)))
LOOP = HandheldLoop()


@pytest.mark.parametrize(
    "T_world_thing",
    [
        flat((1, 2, 3), 40), upright((1, 2, 3), 40), upside_down((1, 2, 3), 40), look_at((0, 0, 1), (3, 1, 0), 15),
        T_BODY_OPTICAL, *(LOOP.T_world_camera(time_s) for time_s in (0.0, 1.3, 4.9)),
    ],
)  # fmt: skip
def test_poses_are_rigid(T_world_thing: Pose) -> None:
    rotation = T_world_thing[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    assert T_world_thing[3].tolist() == [0, 0, 0, 1]


def test_a_camera_sees_its_target_in_the_middle_and_what_is_above_up_and_rolls_clockwise() -> None:
    T_camera_world = inverse(look_at((1.0, 2.0, 0.5), (4.0, 1.0, 1.0)))
    target, above = CAMERA.project(transform(T_camera_world, np.array([(4.0, 1.0, 1.0), (4.0, 1.0, 1.3)])))
    np.testing.assert_allclose(target, (79.5, 59.5), atol=1e-9)
    assert above[1] < 59.5
    assert above[0] == pytest.approx(79.5)
    # By 90 deg, seen from behind: its x axis, which pointed to the right, points down.
    np.testing.assert_allclose(look_at((0, 0, 0), (1, 0, 0), 90)[:3, 0], (0, 0, -1), atol=1e-12)


def test_a_loop_ends_where_it_began_and_moves_as_a_hand_does() -> None:
    poses = [LOOP.T_world_camera(time_s) for time_s in np.linspace(0, LOOP.period_s, 501)]
    np.testing.assert_allclose(poses[0], poses[-1], atol=1e-9)
    steps_m = np.linalg.norm(np.diff([pose[:3, 3] for pose in poses], axis=0), axis=1)
    speeds_mps = steps_m / (LOOP.period_s / 500)
    assert 0.2 < speeds_mps.min() < speeds_mps.max() < 0.7


@pytest.mark.parametrize(
    ("time_s", "expected"),
    [
        (-1.0, flat((1, -3, 0), 90)),  # straight on before zero
        # North 10 m from (1, 2), then left by 90 deg on a radius of 4 pi / (pi / 2) = 8 m: to (-7, 20), west.
        (1.0, flat((1, 7, 0), 90)),
        (2.0 + 2 * math.pi / 5, flat((1 - 8 + 8 / 2**0.5, 12 + 8 / 2**0.5, 0), 135)),
        (2.0 + 4 * math.pi / 5, flat((-7, 20, 0), 180)),
        (4.0 + 4 * math.pi / 5, flat((-17, 20, 0), 180)),  # and behind its end
    ],
)
def test_a_drive_goes_straight_then_around_a_quarter_circle(time_s: float, expected: Pose) -> None:
    np.testing.assert_allclose(DRIVE.T_world_vehicle(time_s), expected, atol=1e-9)


def test_a_drive_keeps_its_speed() -> None:
    positions = np.array([DRIVE.T_world_vehicle(time_s)[:3, 3] for time_s in np.arange(0, 6, 0.001)])
    # Chords of 5 mm on a radius of 8 m are shorter than their arcs by less than 1e-7 of themselves.
    np.testing.assert_allclose(np.linalg.norm(np.diff(positions, axis=0), axis=1), 0.005, rtol=1e-6)
    with pytest.raises(ConfigError, match="expected speed"):
        Drive(speed_mps=0.0)


def test_stamps_keep_all_their_digits() -> None:
    start_ns = 1_772_013_245_123_456_789
    stamps = stamps_ns(4, 15.0, start_ns)
    # 1 s / 15 = 66,666,666.67 ns: each stamp is rounded, and the errors do not add up.
    assert (stamps - start_ns).tolist() == [0, 66_666_667, 133_333_333, 200_000_000]
    assert stamps.dtype == np.int64


STREET = street(seed=3)
EYE, TARGET = (-1.0, 0.2, 1.4), (2.0, 0.0, 1.2)


def keypoint_count(scene: Scene) -> int:
    return len(cv2.SIFT_create().detect(render_image(scene, CAMERA, look_at(EYE, TARGET)), None))


def test_a_drive_through_the_street_meets_nothing() -> None:
    camera = Camera(width_px=64, height_px=32, fx_px=40, fy_px=40, cx_px=31.5, cy_px=15.5)
    for time_s in np.arange(0, 6.5, 0.5):
        T_world_camera = STREET_DRIVE.T_world_vehicle(time_s) @ flat((0.3, 0, 1.5)) @ T_BODY_OPTICAL
        depth_m = render_depth(STREET, camera, T_world_camera)
        assert depth_m[depth_m > 0].min() > 1.0


def test_the_street_returns_most_beams_of_a_lidar() -> None:
    model = LidarModel(beams=16, columns=90)
    points, _ = render_lidar(STREET, flat((0, -1.2, 1.9)), model)
    assert len(points) > 0.8 * 16 * 90
    assert points[:, 2].min() > -1.9 - 1e-4, "nothing is below the ground"


def test_the_hall_looks_the_same_one_period_on() -> None:
    scene = hall_of_columns(seed=2)
    here, there = (render_rgbd(scene, CAMERA, look_at((x, 0.3, 1.4), (x + 2, 0.1, 1.2))) for x in (0.0, HALL_PERIOD_M))
    near = here[1] < 15
    assert near.mean() > 0.9
    # Positions differ by 1.2 m exactly, so depth to rounding, and texture to the 1/32 texel of a look-up.
    np.testing.assert_allclose(here[1][near], there[1][near], atol=1e-4)
    assert np.quantile(cv2.absdiff(here[0], there[0])[near], 0.99) <= 2


def test_weak_worlds_have_few_keypoints_and_the_plane_has_many() -> None:
    assert keypoint_count(bare_room(seed=2)) < 15
    assert keypoint_count(blank_plane(seed=2)) == 0
    assert keypoint_count(single_plane(seed=2)) > 100
    # And it is a plane: seen squarely, all of the wall x = 2 is 3 m from x = -1.
    depth_m = render_depth(single_plane(seed=2), CAMERA, look_at(EYE, (2.0, 0.2, 1.4)))
    np.testing.assert_allclose(depth_m[depth_m > 0], 3.0, atol=1e-5)


def test_the_tiled_room_shows_one_tile_everywhere_and_shapes_that_differ() -> None:
    scene = tiled_room(seed=2)
    floor, ceiling, *walls = [surface.texture.levels[0][:60, :60] for surface in scene.surfaces[:6]]
    for other in (ceiling, *walls):
        np.testing.assert_array_equal(other, floor)
    camera = Camera(width_px=64, height_px=48, fx_px=52.5, fy_px=52.5, cx_px=31.5, cy_px=23.5)
    here, there = (render_depth(scene, camera, look_at((x, 0.2, 1.4), (x + 3, 0, 1.2))) for x in (-1.0, -0.5))
    # Four tiles further on: boxes and walls are elsewhere.
    assert np.mean(np.abs(here - there) > 0.1) > 0.3


def test_the_doors_of_the_kitchen_repeat_and_what_stands_on_it_does_not() -> None:
    scene = kitchen_row(seed=2)

    def seen(y: float, height_m: float) -> tuple[np.ndarray, np.ndarray]:
        return render_rgbd(scene, CAMERA, look_at((-0.9, y, height_m), (0.0, y, height_m)))

    # Shapes are the same. Painted otherwise are handles, the carcass in gaps of 12 mm, and the worktop's edge.
    here, door_on, half_on = (seen(y, 0.5) for y in (0.1, 0.1 + DOOR_M, 0.1 + DOOR_M / 2))
    np.testing.assert_allclose(here[1], door_on[1], atol=1e-4)
    alike = [np.mean(cv2.absdiff(here[0], other[0]).max(axis=2) <= 2) for other in (door_on, half_on)]
    assert alike[0] > 0.9
    assert alike[1] < 0.3
    above = [seen(y, 1.1) for y in (0.1, 0.1 + DOOR_M)]
    assert np.mean(np.abs(above[0][1] - above[1][1]) > 0.02) > 0.03


def test_the_workshop_is_wide_and_the_shelf_is_close() -> None:
    wide_m = render_depth(workshop(seed=2), CAMERA, look_at((-5.0, 0.5, 1.5), (2.0, 0.0, 1.0)))
    assert wide_m.min() > 0.3
    assert np.quantile(wide_m, 0.02) < 3
    assert np.quantile(wide_m, 0.8) > 8
    close_m = render_depth(shelf(seed=2), CAMERA, look_at((-0.5, 0.2, 1.0), (0.1, 0.25, 0.95)))
    assert 0.35 < close_m.min() < np.quantile(close_m, 0.98) < 1.0
    # Things stand before the back wall, which is 0.85 m away.
    assert np.mean(close_m < 0.75) > 0.3
