# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rectification against the formulas of the lens models.

The raw images are linear ramps, which bilinear sampling gives back exactly: a rectified pixel must show
the ramp's value at the place where the model says it comes from.
"""

import math

import numpy as np
import pytest

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.rectification import IDENTITY_ROTATION, Rectifier, resized, scaled

RAW = Camera(160, 120, 110.0, 112.0, 78.0, 61.0)
WIDE = Camera(201, 201, 50.0, 50.0, 100.0, 100.0)
RECTIFIED = Camera(150, 110, 100.0, 101.0, 70.0, 57.0)
PLUMB_BOB = (-0.25, 0.06, 0.002, -0.001, 0.01)
RATIONAL = (0.6, -0.05, 0.001, -0.0005, 0.002, 0.9, 0.02, 0.01)
EQUIDISTANT = (0.02, -0.01, 0.003, -0.001)
TURN = (0.995004165278026, 0.0, 0.099833416646828, 0.0, 1.0, 0.0, -0.099833416646828, 0.0, 0.995004165278026)


def brown(x: float, y: float, lens: tuple[float, ...]) -> tuple[float, float]:
    """OpenCV's documented model: radial fraction and tangential terms."""
    k1, k2, p1, p2, k3, k4, k5, k6 = (*lens, 0.0, 0.0, 0.0, 0.0)[:8]
    r2 = x * x + y * y
    radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    return (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y)


def kannala(x: float, y: float, lens: tuple[float, ...]) -> tuple[float, float]:
    """The equidistant model: the image radius is a polynomial of the angle to the axis."""
    r = math.hypot(x, y)
    angle = math.atan(r)
    image_radius = angle * (1 + sum(k * angle ** (2 * i + 2) for i, k in enumerate(lens)))
    return (x * image_radius / r, y * image_radius / r) if r else (0.0, 0.0)


MODELS = {"plumb_bob": brown, "rational_polynomial": brown, "equidistant": kannala}
LENSES = [*zip(MODELS, (PLUMB_BOB, RATIONAL, EQUIDISTANT), strict=True), ("plumb_bob", PLUMB_BOB[:4])]


def source_of(rectifier: Rectifier, u: int, v: int) -> tuple[float, float, float]:
    """Raw pixel that a rectified pixel shows, and its depth along the raw axis per depth along its own."""
    camera, raw = rectifier.rectified, rectifier.raw
    ray = np.array([(u - camera.cx_px) / camera.fx_px, (v - camera.cy_px) / camera.fy_px, 1.0])
    ray = np.reshape(rectifier.R_rectified_raw, (3, 3)).T @ ray
    x, y = MODELS[rectifier.model](ray[0] / ray[2], ray[1] / ray[2], rectifier.coefficients)
    return raw.fx_px * x + raw.cx_px, raw.fy_px * y + raw.cy_px, ray[2]


def ramp(camera: Camera) -> np.ndarray:
    """40 + u / 2 + v, without its rounding at most 40 + 80 + 120."""
    v, u = np.mgrid[: camera.height_px, : camera.width_px]
    return 40 + u / 2 + v


PIXELS = [(u, v) for u in range(2, 150, 21) for v in range(2, 110, 17)]


@pytest.mark.parametrize(("model", "lens"), LENSES)
@pytest.mark.parametrize("rotation", [IDENTITY_ROTATION, TURN])
def test_a_rectified_pixel_shows_what_the_lens_model_says(model, lens, rotation):
    rectifier = Rectifier(RAW, RECTIFIED, model, lens, rotation)
    rectified = rectifier.image(ramp(RAW).astype(np.uint8)).astype(float)
    depth_m = rectifier.depth((ramp(RAW) / 100).astype(np.float32))
    assert depth_m.dtype == np.float32
    seen = 0
    for u, v in PIXELS:
        source_u, source_v, raw_z = source_of(rectifier, u, v)
        expected = 40 + source_u / 2 + source_v
        if 1 <= source_u < RAW.width_px - 2 and 1 <= source_v < RAW.height_px - 2:
            # The ramp is cut to whole numbers (up to 1 less), places to 1/32 px, the result rounded.
            assert rectified[v, u] == pytest.approx(expected - 0.25, abs=1.1)
            # Depth is that of the nearest raw pixel, along the rectified axis: half a pixel in u and v, as the
            # ramp rises, is 0.0025 + 0.005; and 1/32 px of OpenCV's.
            assert depth_m[v, u] == pytest.approx(expected / 100 / raw_z, abs=0.0085)
            seen += 1
        elif not (-1 <= source_u <= RAW.width_px and -1 <= source_v <= RAW.height_px):
            assert rectified[v, u] == 0
    assert seen > 20


def test_depths_are_never_mixed():
    raw = np.zeros((120, 160), np.float32)
    raw[:, 80:] = 5.0
    raw[::7] = 1.0
    rectified = Rectifier(RAW, RECTIFIED, "plumb_bob", PLUMB_BOB).depth(raw)
    assert set(np.unique(rectified)) == {0.0, 1.0, 5.0}


def test_no_distortion_and_the_same_camera_change_nothing():
    image = np.random.default_rng(0).integers(0, 255, (120, 160, 3), dtype=np.uint8)
    same = Rectifier(RAW, RAW, "plumb_bob", (0.0,) * 4)
    np.testing.assert_array_equal(same.image(image), image)
    depth_m = image[:, :, 0].astype(np.float32)
    np.testing.assert_array_equal(same.depth(depth_m), depth_m)


def test_beyond_the_fold_of_the_polynomial_nothing_is_shown():
    # r (1 - 0.3 r^2) rises up to r = 1 / sqrt(0.9) = 1.054 and then turns back into the image.
    rectifier = Rectifier(WIDE, WIDE, "plumb_bob", (-0.3, 0.0, 0.0, 0.0))
    rectified = rectifier.image(np.full((201, 201), 255, np.uint8))
    v, u = np.mgrid[:201, :201]
    radius = np.hypot(u - 100, v - 100) / 50
    assert (rectified[radius < 1.05] == 255).all()
    assert (rectified[radius > 1.06] == 0).all()


def test_tangential_terms_are_no_fold():
    # To the right x - 0.6 x^2 turns back at 0.83; to the left x = -1 comes from -1.6, pixel 20.
    rectifier = Rectifier(WIDE, WIDE, "plumb_bob", (0.0, 0.0, 0.0, -0.2))
    rectified = rectifier.image(np.tile(np.arange(201, dtype=np.uint8), (201, 1)))
    assert rectified[100, 50] == 20


def test_images_of_another_size_are_refused():
    rectifier = Rectifier(RAW, RECTIFIED, "plumb_bob", PLUMB_BOB)
    for refuse, pixels in (
        (rectifier.image, np.zeros((110, 150), "u1")),
        (rectifier.depth, np.zeros((120, 161), "f4")),
    ):
        with pytest.raises(DataError) as caught:
            refuse(pixels)
        assert caught.value.code == "IMAGE_SIZE"


@pytest.mark.parametrize("lens", [(1e300,) * 5, (-1e12, 1e15, 0.0, 0.0, 0.0)])
def test_a_lens_that_cannot_be_gives_an_empty_image_and_no_warning(lens):
    rectifier = Rectifier(RAW, RECTIFIED, "plumb_bob", lens)
    rectified = rectifier.image(np.full((120, 160), 255, np.uint8))
    assert np.count_nonzero(rectified) <= 9  # the rays along the axis come through any lens
    assert np.isfinite(rectifier.depth(np.ones((120, 160), np.float32))).all()


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"model": "brown"}, "BAD_DISTORTION"),
        ({"coefficients": (0.1,) * 6}, "BAD_DISTORTION"),
        ({"coefficients": (math.nan,) * 4}, "BAD_DISTORTION"),
        ({"R_rectified_raw": (1.0,) * 9}, "BAD_RECTIFICATION"),
        ({"R_rectified_raw": (math.nan,) * 9}, "BAD_RECTIFICATION"),
        ({"R_rectified_raw": (1.0,) * 8}, "BAD_RECTIFICATION"),
    ],
)
def test_a_rectifier_that_is_none_is_refused(changes, code):
    good = {"model": "plumb_bob", "coefficients": PLUMB_BOB, "R_rectified_raw": IDENTITY_ROTATION}
    with pytest.raises(DataError) as caught:
        Rectifier(RAW, RECTIFIED, **{**good, **changes})
    assert caught.value.code == code


def test_a_point_is_seen_at_the_same_place_of_a_resized_and_of_a_binned_image():
    # What a camera derived from another must do, whatever its numbers: pixel edges map to pixel edges.
    point = np.array([[0.2, -0.1, 1.0]])
    ((u, v),) = RAW.project(point)
    ((half_u, half_v),) = resized(RAW, 80, 60).project(point)
    assert (half_u + 0.5, half_v + 0.5) == pytest.approx(((u + 0.5) / 2, (v + 0.5) / 2))
    ((third_u, third_v),) = scaled(RAW, (53, 60), (1 / 3, 1 / 2)).project(point)
    assert (third_u + 0.5, third_v + 0.5) == pytest.approx(((u + 0.5) / 3, (v + 0.5) / 2))
