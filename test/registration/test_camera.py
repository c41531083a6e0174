# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The pinhole by hand: fx 100, fy 50, centre (10, 20)."""

from dataclasses import replace

import numpy as np
import pytest

from vigg_ros.registration import Camera, DataError

CAMERA = Camera(width_px=40, height_px=30, fx_px=100.0, fy_px=50.0, cx_px=10.0, cy_px=20.0)


def test_projection_and_lifting_by_hand() -> None:
    points = np.array([(0, 0, 1), (1, 0, 2), (0, 1, 2), (-0.5, -2, 4)], float)
    pixels = [(10, 20), (60, 20), (10, 45), (-2.5, -5)]  # u = 100 x / z + 10, v = 50 y / z + 20
    np.testing.assert_allclose(CAMERA.project(points), pixels)
    np.testing.assert_allclose(CAMERA.lift(np.array(pixels), points[:, 2]), points)
    assert CAMERA.matrix.tolist() == [[100, 0, 10], [0, 50, 20], [0, 0, 1]]


def test_what_is_not_in_front_does_not_project() -> None:
    assert np.isnan(CAMERA.project(np.array([(1, 1, 0), (1, 1, -2), (0, 0, np.nan)], float))).all()


def test_the_image_reaches_half_a_pixel_beyond_the_outer_centres() -> None:
    pixels = np.array([(-0.5, -0.5), (39.49, 29.49), (-0.51, 0), (39.5, 0), (0, 29.5), (np.nan, 3)])
    assert CAMERA.contains(pixels).tolist() == [True, True, False, False, False, False]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("fx_px", 0.0), ("fy_px", -1.0), ("fx_px", np.nan), ("cx_px", np.inf), ("cy_px", np.nan), ("width_px", 0),
        ("height_px", -3),
    ],
)  # fmt: skip
def test_intrinsics_that_no_camera_has(name: str, value: float) -> None:
    with pytest.raises(DataError, match="positive focal lengths") as caught:
        replace(CAMERA, **{name: value})
    assert caught.value.code == "BAD_INTRINSICS"
