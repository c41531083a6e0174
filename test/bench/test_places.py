# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The street and the hard worlds are what they claim to be."""

from __future__ import annotations

import cv2
import numpy as np

from vigg_ros.bench.worlds import (
    HALL_PERIOD_M,
    STREET_DRIVE,
    LidarModel,
    Scene,
    bare_room,
    blank_plane,
    hall_of_columns,
    render_depth,
    render_image,
    render_lidar,
    render_rgbd,
    single_plane,
    tiled_room,
)
from vigg_ros.bench.worlds.poses import T_BODY_OPTICAL, flat, look_at
from vigg_ros.registration import Camera

EYE, TARGET = (-1.0, 0.2, 1.4), (2.0, 0.0, 1.2)


def keypoint_count(scene: Scene, camera: Camera) -> int:
    return len(cv2.SIFT_create().detect(render_image(scene, camera, look_at(EYE, TARGET)), None))


def test_a_drive_through_the_street_meets_nothing(a_street: Scene) -> None:
    camera = Camera(width_px=64, height_px=32, fx_px=40, fy_px=40, cx_px=31.5, cy_px=15.5)
    for time_s in np.arange(0, 6.5, 0.5):
        T_world_camera = STREET_DRIVE.T_world_vehicle(time_s) @ flat((0.3, 0, 1.5)) @ T_BODY_OPTICAL
        depth_m = render_depth(a_street, camera, T_world_camera)
        assert depth_m[depth_m > 0].min() > 1.0


def test_the_street_returns_most_beams_of_a_lidar(a_street: Scene) -> None:
    model = LidarModel(beams=16, columns=90)
    points, _ = render_lidar(a_street, flat((0, -1.2, 1.9)), model)
    assert len(points) > 0.8 * 16 * 90
    assert points[:, 2].min() > -1.9 - 1e-4, "nothing is below the ground"


def test_the_hall_looks_the_same_one_period_on(camera: Camera) -> None:
    scene = hall_of_columns(seed=2)
    here, there = (render_rgbd(scene, camera, look_at((x, 0.3, 1.4), (x + 2, 0.1, 1.2))) for x in (0.0, HALL_PERIOD_M))
    near = here[1] < 15
    assert near.mean() > 0.9
    # Positions differ by 1.2 m exactly, so depth to rounding, and texture to the 1/32 texel of a look-up.
    np.testing.assert_allclose(here[1][near], there[1][near], atol=1e-4)
    assert np.quantile(cv2.absdiff(here[0], there[0])[near], 0.99) <= 2


def test_weak_worlds_have_few_keypoints_and_the_plane_has_many(camera: Camera) -> None:
    assert keypoint_count(bare_room(seed=2), camera) < 15
    assert keypoint_count(blank_plane(seed=2), camera) == 0
    assert keypoint_count(single_plane(seed=2), camera) > 100


def test_all_points_of_a_single_plane_are_on_it(camera: Camera) -> None:
    T_world_camera = look_at(EYE, TARGET)
    depth_m = render_depth(single_plane(seed=2), camera, T_world_camera)
    v, u = np.nonzero(depth_m)
    points = camera.lift(np.column_stack((u, v)).astype(float), depth_m[v, u].astype(float))
    x = (points @ T_world_camera[:3, :3].T + T_world_camera[:3, 3])[:, 0]
    np.testing.assert_allclose(x, 2.0, atol=1e-5)


def test_the_tiled_room_shows_one_tile_everywhere_and_shapes_that_differ() -> None:
    scene = tiled_room(seed=2)
    floor, ceiling, *walls = [surface.texture.levels[0][:60, :60] for surface in scene.surfaces[:6]]
    for other in (ceiling, *walls):
        np.testing.assert_array_equal(other, floor)
    camera = Camera(width_px=64, height_px=48, fx_px=52.5, fy_px=52.5, cx_px=31.5, cy_px=23.5)
    here, there = (render_depth(scene, camera, look_at((x, 0.2, 1.4), (x + 3, 0, 1.2))) for x in (-1.0, -0.5))
    # Four tiles further on: boxes and walls are elsewhere.
    assert np.mean(np.abs(here - there) > 0.1) > 0.3
