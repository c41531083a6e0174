# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Depth images: metres by hand, and what is no depth."""

from __future__ import annotations

import numpy as np
import pytest

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.errors import DataError
from vigg_ros.registration.frame import Frame
from vigg_ros.sensors.depth_image import decode_depth
from vigg_ros_testing.message_samples import STAMP_NS, image

TYPES_ROW = pytest.mark.hostile(
    "Image: depth 16UC1 mono16 32FC1 64FC1 A, colour on the depth topic R, depth on the image topic R"
)
MILLIMETRES = np.array([[1000, 1500, 2000], [2500, 750, 40_000]])
METRES = np.array([[1.0, 1.5, 2.0], [2.5, 0.75, 40.0]])


@TYPES_ROW
@pytest.mark.hostile("Image: big-endian 16UC1/32FC1 A")
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(
    ("encoding", "values", "dtype"),
    [("16UC1", MILLIMETRES, "u2"), ("mono16", MILLIMETRES, "u2"), ("32FC1", METRES, "f4"), ("64FC1", METRES, "f8")],
)
def test_each_type_becomes_metres(encoding, values, dtype, order):
    decoded = decode_depth(image(values.astype(order + dtype), encoding))
    # 16 bits are multiplied with 0.001 in float32: one rounding.
    np.testing.assert_allclose(decoded.depth_m, METRES, rtol=2e-7)
    assert decoded.depth_m.dtype == np.float32
    assert decoded.depth_m.dtype.isnative
    assert (decoded.stamp_ns, decoded.frame_id, decoded.notes) == (STAMP_NS, "camera", ())


@pytest.mark.parametrize(("encoding", "dtype"), [("16UC1", "<u2"), ("32FC1", "<f4")])
def test_a_scale_that_is_given_holds_for_every_type(encoding, dtype):
    decoded = decode_depth(image(MILLIMETRES.astype(dtype), encoding), depth_scale_m=0.0002)
    np.testing.assert_allclose(decoded.depth_m, MILLIMETRES * 0.0002, rtol=2e-7)


def test_padding_and_odd_steps_are_read_right():
    padded = np.zeros((2, 9), "u1")
    padded[:, :6] = MILLIMETRES.astype("<u2").view("u1")
    msg = image(MILLIMETRES.astype("<u2"), "16UC1", step=9, data=padded.tobytes())
    np.testing.assert_allclose(decode_depth(msg).depth_m, METRES, rtol=2e-7)


@pytest.mark.hostile("Image: depth of 0, NaN, Inf, negative, 65535: no point there; too few left: NO_DEPTH")
@pytest.mark.parametrize(
    ("encoding", "dtype", "nothing"),
    [
        ("16UC1", "<u2", [0, 65_535]),
        ("32FC1", "<f4", [0, np.nan, np.inf, -np.inf, -1, -0.0, 1e30, 10_001]),
        ("64FC1", ">f8", [0, np.nan, np.inf, -np.inf, -1, 1e300, -1e300]),
    ],
)
def test_what_is_no_distance_is_zero(encoding, dtype, nothing):
    values = np.array([[1, 2, 3], [0, 0, 0]] + [[value, 2, 3] for value in nothing]).astype(dtype)
    # With half a millimetre per unit 65535 would be a depth of 33 m.
    scale_m = 0.0005 if encoding == "16UC1" else 1.0
    decoded = decode_depth(image(values, encoding), depth_scale_m=scale_m).depth_m
    expected = np.array([[1, 2, 3], [0, 0, 0]] + [[0, 2, 3]] * len(nothing)) * scale_m
    np.testing.assert_allclose(decoded, expected, rtol=2e-7)

    with pytest.raises(DataError) as caught:
        decode_depth(image(np.array([[*nothing, 1, 2]]).astype(dtype), encoding))
    assert caught.value.code == "NO_DEPTH"
    assert "2 pixels" in caught.value.found


@pytest.mark.hostile("Image: depth and image of different size R")
def test_depth_that_does_not_fit_its_image_is_refused():
    depth_m = decode_depth(image(MILLIMETRES.astype("<u2"), "16UC1")).depth_m
    camera = Camera(width_px=6, height_px=4, fx_px=5, fy_px=5, cx_px=2.5, cy_px=1.5)
    with pytest.raises(DataError) as caught:
        Frame.from_depth(np.zeros((4, 6), np.uint8), depth_m, camera)
    assert caught.value.code == "DEPTH_SIZE"
