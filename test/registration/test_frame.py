# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which pixel of a depth image sees which point, and what is refused as a frame."""

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
