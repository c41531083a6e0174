# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cameras and frames of them: which pixel sees which point, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from vigg_ros.registration import Camera, DataError, Frame

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
    expected = [(0.4 / 10 * 1.5, 0.3 / 5 * 1.5, 1.5), (0.6 / 10 * 2.0, -0.3 / 5 * 2.0, 2.0), [np.nan] * 3]
    np.testing.assert_allclose(points, expected)


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_no_depth_is_no_point_and_the_array_given_stays_as_it_is(dtype: type) -> None:
    """Messages are decoded to views; another frame may read the same bytes."""
    beyond = 1e300 if dtype is np.float64 else np.inf  # what float32 cannot hold
    nothing = {(0, 0): np.nan, (0, 1): np.inf, (0, 2): -np.inf, (0, 3): -1.0, (0, 4): 0.0, (0, 5): beyond}
    depth_m = depth_at(nothing | {(5, 7): 2.0}, dtype)
    before = depth_m.copy()
    depth_m.flags.writeable = False
    frame = Frame.from_depth(IMAGE, depth_m, CAMERA)
    np.testing.assert_allclose(frame.points()[:, 2], [2.0])
    assert np.isnan(frame.points_at(np.array([(column, 0) for column in range(6)], float))).all()
    np.testing.assert_array_equal(depth_m, before)


DEPTH = np.ones((6, 8), np.float32)


@pytest.mark.hostile("Image: depth and image of different size R")
@pytest.mark.parametrize(
    ("image", "depth_m", "code"),
    [
        (np.zeros((6, 9, 3), np.uint8), np.ones((6, 9), np.float32), "IMAGE_SIZE"),
        *(
            (image, DEPTH, "IMAGE_SIZE")
            for image in (np.zeros((6, 8, 4), "u1"), IMAGE.astype("u2"), np.zeros(48, "u1"))
        ),
        *((IMAGE, depth_m, "DEPTH_SIZE") for depth_m in (DEPTH[:5], DEPTH[:, :, None], DEPTH.astype("u2"))),
    ],
)
def test_what_does_not_fit_the_camera_is_refused(image: np.ndarray, depth_m: np.ndarray, code: str) -> None:
    with pytest.raises(DataError, match="expected") as caught:
        Frame.from_depth(image, depth_m, CAMERA)
    assert caught.value.code == code


PINHOLE = Camera(width_px=40, height_px=30, fx_px=100.0, fy_px=50.0, cx_px=10.0, cy_px=20.0)


def test_projection_and_lifting_by_hand() -> None:
    points = np.array([(0, 0, 1), (1, 0, 2), (0, 1, 2), (-0.5, -2, 4)], float)
    pixels = [(10, 20), (60, 20), (10, 45), (-2.5, -5)]  # u = 100 x / z + 10, v = 50 y / z + 20
    np.testing.assert_allclose(PINHOLE.project(points), pixels)
    np.testing.assert_allclose(PINHOLE.lift(np.array(pixels), points[:, 2]), points)
    assert PINHOLE.matrix.tolist() == [[100, 0, 10], [0, 50, 20], [0, 0, 1]]


def test_what_is_not_in_front_does_not_project() -> None:
    assert np.isnan(PINHOLE.project(np.array([(1, 1, 0), (1, 1, -2), (0, 0, np.nan)], float))).all()


def test_the_image_reaches_half_a_pixel_beyond_the_outer_centres() -> None:
    pixels = np.array([(-0.5, -0.5), (39.49, 29.49), (-0.51, 0), (39.5, 0), (0, 29.5), (np.nan, 3)])
    assert PINHOLE.contains(pixels).tolist() == [True, True, False, False, False, False]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("fx_px", 0.0), ("fy_px", -1.0), ("fx_px", np.nan), ("cx_px", np.inf), ("cy_px", np.nan), ("width_px", 0),
        ("height_px", -3),
    ],
)  # fmt: skip
def test_intrinsics_that_no_camera_has(name: str, value: float) -> None:
    with pytest.raises(DataError, match="positive focal lengths") as caught:
        replace(PINHOLE, **{name: value})
    assert caught.value.code == "BAD_INTRINSICS"
