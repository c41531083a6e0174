# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which pixel sees which point, and what is refused as a frame."""

from __future__ import annotations

import numpy as np
import pytest

from vigg_ros.registration import Camera, DataError, Frame
from vigg_ros_testing.registration_samples import motion

CAMERA = Camera(width_px=8, height_px=6, fx_px=10.0, fy_px=5.0, cx_px=3.0, cy_px=2.0)
IMAGE = np.zeros((6, 8, 3), np.uint8)


def depth_at(values: dict[tuple[int, int], float], dtype: type = np.float32) -> np.ndarray:
    """No depth but in some pixels, by (row, column)."""
    depth_m = np.zeros((6, 8), dtype)
    for place, metres in values.items():
        depth_m[place] = metres
    return depth_m


def test_depth_is_lifted_at_pixel_centres() -> None:
    frame = Frame.from_depth(IMAGE, depth_at({(2, 3): 1.5, (0, 3): 2.0, (2, 7): 4.0}), CAMERA, stamp_ns=7)
    # x = (u - 3) / 10 z, y = (v - 2) / 5 z, by rows.
    np.testing.assert_allclose(frame.points(), [(0, -0.8, 2), (0, 0, 1.5), (1.6, 0, 4)], atol=1e-6)
    assert frame.stamp_ns == 7


def test_a_pixel_sees_the_depth_of_the_nearest_centre_along_its_own_ray() -> None:
    frame = Frame.from_depth(IMAGE, depth_at({(2, 3): 1.5, (2, 4): 2.0}), CAMERA)
    points = frame.points_at(np.array([(3.4, 2.3), (3.6, 1.7), (6.0, 2.0)]))
    np.testing.assert_allclose(points[0], (0.4 / 10 * 1.5, 0.3 / 5 * 1.5, 1.5))
    np.testing.assert_allclose(points[1], (0.6 / 10 * 2.0, -0.3 / 5 * 2.0, 2.0))
    assert np.isnan(points[2]).all()


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_no_depth_is_no_point(dtype: type) -> None:
    nothing = {(0, 0): np.nan, (0, 1): np.inf, (0, 2): -np.inf, (0, 3): -1.0, (0, 4): 0.0}
    frame = Frame.from_depth(IMAGE, depth_at(nothing | {(5, 7): 2.0}, dtype), CAMERA)
    assert len(frame.points()) == 1
    assert np.isnan(frame.points_at(np.array([(column, 0) for column in range(5)], float))).all()


def test_depth_beyond_float32_is_none() -> None:
    frame = Frame.from_depth(IMAGE, depth_at({(0, 0): 1e300, (5, 7): 2.0}, np.float64), CAMERA)
    np.testing.assert_allclose(frame.points()[:, 2], [2.0])


def test_the_arrays_given_stay_as_they_are() -> None:
    """Messages are decoded to views; another frame may read the same bytes."""
    depth_m = depth_at({(0, 0): np.nan, (1, 1): -2.0, (5, 7): 2.0})
    before = depth_m.copy()
    depth_m.flags.writeable = False
    Frame.from_depth(IMAGE, depth_m, CAMERA)
    np.testing.assert_array_equal(depth_m, before)


@pytest.mark.parametrize(
    ("image", "depth_m", "code"),
    [
        (np.zeros((6, 9, 3), np.uint8), np.ones((6, 9), np.float32), "IMAGE_SIZE"),
        (np.zeros((6, 8, 4), np.uint8), np.ones((6, 8), np.float32), "IMAGE_SIZE"),
        (np.zeros((6, 8), np.uint16), np.ones((6, 8), np.float32), "IMAGE_SIZE"),
        (np.zeros(48, np.uint8), np.ones((6, 8), np.float32), "IMAGE_SIZE"),
        (IMAGE, np.ones((5, 8), np.float32), "DEPTH_SIZE"),
        (IMAGE, np.ones((6, 8, 1), np.float32), "DEPTH_SIZE"),
        (IMAGE, np.ones((6, 8), np.uint16), "DEPTH_SIZE"),
    ],
    ids=["wide", "four channels", "16 bits", "flat", "short depth", "deep depth", "depth in millimetres"],
)
def test_what_does_not_fit_the_camera_is_refused(image: np.ndarray, depth_m: np.ndarray, code: str) -> None:
    with pytest.raises(DataError, match="expected") as caught:
        Frame.from_depth(image, depth_m, CAMERA)
    assert caught.value.code == code


def grid_of_points() -> np.ndarray:
    """One point on the ray of every pixel of the camera, at 3 m."""
    v, u = np.mgrid[:6, :8]
    return np.column_stack(((u.ravel() - 3) / 10 * 3.0, (v.ravel() - 2) / 5 * 3.0, np.full(48, 3.0)))


def test_points_in_another_frame_are_seen_through_the_extrinsics() -> None:
    """The scanner stands 20 cm beside the camera, turned by a quarter about x; results stay in its frame."""
    T_camera_points = motion((90, 0, 0), (0.2, 0, 0))
    in_camera = np.concatenate((grid_of_points(), grid_of_points()))
    points = (in_camera - T_camera_points[:3, 3]) @ T_camera_points[:3, :3]
    frame = Frame.from_points(IMAGE, points, CAMERA, T_camera_points)
    np.testing.assert_allclose(frame.points(), points, atol=1e-6)
    seen = frame.points_at(np.array([(5.0, 4.0)]))
    np.testing.assert_allclose(seen[0], points[4 * 8 + 5], atol=1e-6)


def test_points_that_are_none_are_dropped_and_those_outside_the_image_kept() -> None:
    outside = np.array([(0, 0, -3), (100, 0, 3)], float)
    bad = np.array([(np.nan, 0, 3), (0, np.inf, 3)])
    points = np.concatenate((grid_of_points(), grid_of_points(), outside, bad))
    assert len(Frame.from_points(IMAGE, points, CAMERA, np.eye(4)).points()) == 98
    assert len(Frame.from_points(IMAGE, points, CAMERA, np.eye(4), within_view=True).points()) == 96


@pytest.mark.parametrize(
    ("points", "T_camera_points", "code"),
    [
        (-grid_of_points(), np.eye(4), "NO_DEPTH"),
        (np.zeros((0, 3)), np.eye(4), "NO_DEPTH"),
        (np.ones((60, 2)), np.eye(4), "POINTS_SHAPE"),
        (np.ones((60, 3), int), np.eye(4), "POINTS_SHAPE"),
        (np.tile(grid_of_points(), (2, 1)), np.diag((1.0, 1, -1, 1)), "BAD_EXTRINSICS"),
        (np.tile(grid_of_points(), (2, 1)), np.diag((2.0, 2, 2, 1)), "BAD_EXTRINSICS"),
        (np.tile(grid_of_points(), (2, 1)), np.full((4, 4), np.nan), "BAD_EXTRINSICS"),
        (np.tile(grid_of_points(), (2, 1)), np.eye(3), "BAD_EXTRINSICS"),
    ],
    ids=["behind", "none", "flat", "integers", "mirror", "scale", "nan", "3x3"],
)
def test_scans_that_do_not_fit_are_refused(points: np.ndarray, T_camera_points: np.ndarray, code: str) -> None:
    with pytest.raises(DataError, match="expected") as caught:
        Frame.from_points(IMAGE, points, CAMERA, T_camera_points)
    assert caught.value.code == code
