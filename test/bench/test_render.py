# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rendering against closed forms, and against itself from another place."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from vigg_ros.bench.worlds import HandheldLoop, RollingShutter, render_depth, render_image, render_rgbd, room
from vigg_ros.bench.worlds.poses import Pose, flat, look_at, upright
from vigg_ros.bench.worlds.surfaces import Cylinder, Rectangle, Sphere, box
from vigg_ros.bench.worlds.texture import Texture
from vigg_ros.registration import Camera
from vigg_ros.registration.rigid import inverse, transform
from vigg_ros_testing.simple_scenes import AHEAD, CAMERA, plain_texture, scene_of, wall

FURNISHED_ROOM = room(seed=11)


def rays() -> NDArray[np.float64]:
    """(H, W, 3) in the optical frame, z = 1, through the pixel centres."""
    v, u = np.mgrid[: CAMERA.height_px, : CAMERA.width_px]
    pixels = np.column_stack((u.ravel(), v.ravel())).astype(float)
    return CAMERA.lift(pixels, np.ones(len(pixels))).reshape(*u.shape, 3)


def lifted(depth_m: NDArray[np.float32], T_world_camera: Pose) -> NDArray[np.float64]:
    """Points (N, 3) in the world of all pixels with depth."""
    return transform(T_world_camera, (rays() * depth_m[..., None])[depth_m > 0])


T_BOX = flat((2.5, 0.1, -0.4), 30)
BALL, BALL_M = np.array([3.0, 0.4, -0.2]), 0.7
PLAIN = plain_texture()


@pytest.mark.parametrize(
    ("surfaces", "seen"),
    [
        # Seen squarely from 2 m, |y| <= 0.5 m is |u - cx| <= 0.5 / 2 * f = 34.6 px, |z| <= 0.3 m is 20.8 px.
        ([wall(2, (1.0, 0.6))], lambda u, v, unit: (np.abs(u - 79.5) <= 34.6) & (np.abs(v - 59.5) <= 20.7)),
        # From behind, nothing.
        ([Rectangle(upright((2, 0, 0), 0), (1.0, 0.6), PLAIN)], lambda u, v, unit: np.zeros(u.shape, bool)),
        # The angle to the centre is below asin(radius / distance).
        ([Sphere(tuple(BALL), BALL_M, PLAIN)], lambda u, v, unit: unit @ BALL > np.sqrt(BALL @ BALL - BALL_M**2)),
        # Seen along its axis from 4 m, the lid is 3.5 m away: a disc of 0.5 / 3.5 * f = 19.8 px radius.
        (
            [Cylinder(upright((4, 0, 0), 0), 0.5, 1.0, PLAIN)],
            lambda u, v, unit: np.hypot(u - 79.5, v - 59.5) <= 0.5 / 3.5 * 138.5,
        ),
    ],
)
def test_silhouettes(surfaces: list, seen: Callable) -> None:
    v, u = np.mgrid[: CAMERA.height_px, : CAMERA.width_px]
    directions = rays() @ AHEAD[:3, :3].T
    unit = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    np.testing.assert_array_equal(render_depth(scene_of(*surfaces), CAMERA, AHEAD) > 0, seen(u, v, unit))


ORIGIN = np.zeros(3)


def off_cylinder_m(p: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.maximum(np.hypot(p[:, 0], p[:, 1]) - 0.5, np.abs(p[:, 2]) - 0.6)


def off_box_m(p: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.max(np.abs(transform(inverse(T_BOX), p) - (0, 0, 0.3)) - (0.4, 0.25, 0.3), axis=1)


@pytest.mark.parametrize(
    ("surfaces", "outside_m", "eyes", "target"),
    [
        ([wall(2, (50, 50))], lambda p: 2 - p[:, 0], (ORIGIN, (-1.0, 0.7, 0.4), (0.5, -0.6, -0.5)), (2, 0.3, -0.2)),
        ([Sphere(tuple(BALL), BALL_M, PLAIN)], lambda p: np.linalg.norm(p - BALL, axis=1) - BALL_M, [ORIGIN], BALL),
        (
            [Cylinder(flat(ORIGIN), 0.5, 1.2, PLAIN)], off_cylinder_m,
            ((-3.0, 0.5, 0.3), (-1.5, 0.2, 2.5), (-1.0, 0.0, -3.0)), ORIGIN,
        ),
        (box(T_BOX, (0.8, 0.5, 0.6), lambda size_m: PLAIN), off_box_m, [(0, 0, 0.8)], (2.5, 0, 0)),
    ],
)  # fmt: skip
def test_points_lie_on_the_near_side_of_the_surface(surfaces, outside_m, eyes, target) -> None:
    for eye in eyes:
        T_world_camera = look_at(eye, target, roll_deg=20)
        points = lifted(render_depth(scene_of(*surfaces), CAMERA, T_world_camera), T_world_camera)
        np.testing.assert_allclose(outside_m(points), 0, atol=1e-5)
        assert len(points) > 500
        # Half a hundredth of the way to the eye is outside.
        assert (outside_m(points + 0.005 * (eye - points)) > 0).all()


def test_the_nearer_surface_hides_the_farther() -> None:
    # 70 pixels wide and high, so that its rims lie between pixels and none is a mixture.
    near, far = wall(1, (70 / 138.5, 70 / 138.5), plain_texture(200)), wall(3, texture=plain_texture(50))
    for surfaces in ((near, far), (far, near)):
        image, depth_m = render_rgbd(scene_of(*surfaces), CAMERA, AHEAD)
        np.testing.assert_array_equal(image[:, :, 0] == 200, depth_m < 2)
        np.testing.assert_array_equal(image[:, :, 0] == 50, depth_m > 2)
        assert np.count_nonzero(depth_m < 2) == 70 * 70


def test_a_texture_is_seen_upright_not_mirrored_and_averaged_where_it_is_far() -> None:
    picture = np.zeros((40, 40, 3), dtype=np.uint8)
    picture[:20, :20], picture[:20, 20:], picture[20:, :20] = np.diag((255, 255, 255))
    image = render_image(scene_of(wall(2, (2, 2), Texture.of(picture, 0.05))), CAMERA, AHEAD)
    corners = [image[row, column].tolist() for row, column in ((20, 30), (20, 130), (100, 30))]
    assert corners == [[255, 0, 0], [0, 255, 0], [0, 0, 255]]
    # Stripes of 1 cm seen from 20 m, where a pixel is 14 cm wide: all grey. Half of 0 and 255 is 127.5.
    stripes = np.zeros((256, 2048, 3), dtype=np.uint8)
    stripes[:, ::2] = 255
    image = render_image(scene_of(wall(20, (20, 2), Texture.of(stripes, 0.01))), CAMERA, AHEAD)
    assert np.abs(image[58:62, 20:140].astype(float) - 127.5).max() < 3


def test_one_view_has_the_depths_and_colours_that_another_view_shows() -> None:
    T_world_a, T_world_b = (HandheldLoop().T_world_camera(time_s) for time_s in (0.2, 0.7))
    (image_a, depth_a_m), (image_b, depth_b_m) = (
        render_rgbd(FURNISHED_ROOM, CAMERA, T_world_camera) for T_world_camera in (T_world_a, T_world_b)
    )
    in_b = transform(inverse(T_world_b), lifted(depth_a_m, T_world_a))
    maps = CAMERA.project(in_b).reshape(*depth_a_m.shape, 2).astype(np.float32)
    in_view = CAMERA.contains(maps.reshape(-1, 2)).reshape(depth_a_m.shape)
    shown_m = cv2.remap(depth_b_m, maps[..., 0], maps[..., 1], cv2.INTER_NEAREST)
    differences_m = in_b[:, 2].reshape(depth_a_m.shape) - shown_m
    # Rounding to a pixel moves a ray by half a pixel: 4 mrad of a slant of up to 80 deg at 3 m is 6 cm.
    # What lies deeper than B sees is hidden in B; nothing may lie nearer, except at the rims of things.
    assert in_view.mean() > 0.6
    assert np.mean(differences_m[in_view] < -0.06) < 0.03
    assert np.mean(np.abs(differences_m[in_view]) < 0.06) > 0.85
    assert abs(np.median(differences_m[in_view])) < 1e-3
    warped = cv2.remap(image_b, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR)
    errors = np.abs(warped.astype(float) - image_a)[in_view & (np.abs(differences_m) < 0.06)]
    # Surfaces keep their brightness to rounding; at edges, a tenth of these pixels, interpolation blurs.
    assert np.median(errors) <= 2
    assert np.mean(errors < 15) > 0.85
    assert np.mean(np.abs(image_b.astype(float) - image_a) < 15) < 0.5, "without the warp it is another picture"


def test_a_seed_is_a_world() -> None:
    T_world_camera = HandheldLoop().T_world_camera(0)
    first, again, other = (render_rgbd(room(seed), CAMERA, T_world_camera) for seed in (1, 1, 2))
    assert first[0].tobytes() == again[0].tobytes()
    assert first[1].tobytes() == again[1].tobytes()
    assert first[0].tobytes() != other[0].tobytes()


def test_room_views_have_features_everywhere() -> None:
    camera = Camera(width_px=320, height_px=240, fx_px=277, fy_px=277, cx_px=159.5, cy_px=119.5)
    for time_s in (0.0, 1.7, 3.4):
        image = render_image(FURNISHED_ROOM, camera, HandheldLoop().T_world_camera(time_s))
        corners = np.array([keypoint.pt for keypoint in cv2.SIFT_create().detect(image, None)])
        counts = np.histogram2d(corners[:, 0], corners[:, 1], bins=4, range=((0, 320), (0, 240)))[0]
        assert len(corners) >= 300
        assert np.count_nonzero(counts >= 3) >= 12, f"of 16 parts of the image, keypoints lie as {counts}"


T_ROOM_CAMERA = look_at((-1.2, 0.3, 1.4), (1.5, 0.0, 0.8), 5)


def test_a_rolling_shutter_at_rest_sees_what_a_global_one_sees() -> None:
    at_rest = RollingShutter(T_ROOM_CAMERA, np.zeros(3), np.zeros(3), 0.03)
    views = [render_rgbd(FURNISHED_ROOM, CAMERA, eye) for eye in (at_rest, T_ROOM_CAMERA)]
    for first, second in zip(*views, strict=True):
        np.testing.assert_allclose(first, second, atol=1e-6)


def test_each_row_is_seen_from_where_it_was_exposed() -> None:
    shutter = RollingShutter(T_ROOM_CAMERA, np.array((0.5, -0.2, 0.3)), np.radians((20.0, 110.0, -30.0)), 0.03)
    depth_m = render_depth(FURNISHED_ROOM, CAMERA, shutter)
    image = render_image(FURNISHED_ROOM, CAMERA, shutter, supersampling=1)
    poses = shutter.T_world_rows(120)
    for row in (0, 40, 85, 119):
        seen_image, seen_m = render_rgbd(FURNISHED_ROOM, CAMERA, poses[row], supersampling=1)
        np.testing.assert_allclose(depth_m[row], seen_m[row], atol=1e-5)
        np.testing.assert_allclose(image[row].astype(int), seen_image[row], atol=1)
    # The middle lies between the two rows in the middle; 0.03 s at 0.5 m/s are 15 mm from the first row to the last.
    np.testing.assert_allclose((poses[59] + poses[60]) / 2, T_ROOM_CAMERA, atol=1e-5)
    shift_m = (inverse(poses[0]) @ poses[119])[:3, 3]
    np.testing.assert_allclose(shift_m, 119 / 120 * 0.03 * np.array((0.5, -0.2, 0.3)), atol=1e-3)
