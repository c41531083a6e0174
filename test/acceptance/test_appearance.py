# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What two images show of the same places, by closed form and on rendered views."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vigg_ros.acceptance.agreement import Pair, photometric_correlation
from vigg_ros.acceptance.appearance import MIN_COMMON_PLACES, REDUCED_SIDE_PX, Appearance, correlation
from vigg_ros.registration import Camera, Config, Frame, extract
from vigg_ros.registration.matches import no_matches
from vigg_ros_testing.registration_samples import looking

CAMERA = Camera(width_px=320, height_px=240, fx_px=200.0, fy_px=200.0, cx_px=159.5, cy_px=119.5)


def ramp(channels):
    """Grey that grows by half a level per column; the same in each channel."""
    columns = np.tile((0.5 * np.arange(320)).astype(np.uint8), (240, 1))
    return columns if channels == 1 else np.repeat(columns[..., None], channels, axis=2)


@pytest.mark.parametrize("channels", [1, 3])
def test_a_point_has_the_colour_of_its_pixel(channels):
    frame = Frame.from_depth(ramp(channels), np.full((240, 320), 2.0, np.float32), CAMERA)
    appearance = Appearance.of(frame)
    assert max(appearance.image.shape[:2]) == REDUCED_SIDE_PX
    points = CAMERA.lift(np.array([(40.0, 100.0), (200.5, 10.0), (300.0, 230.0)]), np.array((1.0, 2.0, 3.0)))
    # Half a level per column, cut to whole levels twice: within one level.
    expected = np.repeat([[20.0], [100.25], [150.0]], channels, axis=1)
    np.testing.assert_allclose(appearance.at(points), expected, atol=1.0)


def test_what_is_not_in_the_image_has_no_colour():
    appearance = Appearance.of(Frame.from_depth(ramp(3), np.full((240, 320), 2.0, np.float32), CAMERA))
    colours = appearance.at(np.array([(0, 0, 2.0), (0, 0, -2.0), (5.0, 0, 2.0), (0, -5.0, 2.0)]))
    assert np.isfinite(colours).all(axis=1).tolist() == [True, False, False, False]
    assert appearance.at(np.empty((0, 3))).shape == (0, 3)


def colours(seed, count=200):
    return np.random.default_rng(seed).uniform(0, 255, (count, 3)).astype(np.float32)


def test_gain_and_offset_do_not_matter():
    assert correlation(colours(0), 0.4 * colours(0) + 60) == pytest.approx(1)
    assert correlation(colours(0), 255 - colours(0)) == pytest.approx(-1)
    # Of 200 independent places a correlation has a deviation of 0.07, the mean of three channels one of 0.04.
    assert abs(correlation(colours(0), colours(1))) < 0.16


def test_a_channel_without_contrast_says_nothing():
    """Of a tinted or an infrared camera that fills three channels; and grey is compared with their mean."""
    first, second = colours(0), colours(0)
    first[:, 1:], second[:, 2] = 7, 7
    assert correlation(first, second) == pytest.approx(1)
    assert correlation(colours(0), colours(0).mean(axis=1, keepdims=True)) == pytest.approx(1)


@pytest.mark.parametrize("lack", ["few", "unseen", "grey"])
def test_too_little_in_common_says_nothing(lack):
    first, second = colours(0), colours(0)
    if lack == "few":
        first, second = first[: MIN_COMMON_PLACES - 1], second[: MIN_COMMON_PLACES - 1]
    elif lack == "unseen":
        first[: len(first) // 2], second[len(second) // 2 :] = np.nan, np.nan
    else:
        second = 128 + second / 255
    assert math.isnan(correlation(first, second))


def test_views_are_alike_under_their_motion_and_not_under_another_one(studio):
    poses = looking(), looking((0.2, 0.2, 0), (0, 0.3, 0))
    target, source = (studio.features(pose, seed) for seed, pose in enumerate(poses))
    pair = Pair(target, source, no_matches(), no_matches(), Config())
    T_true = np.linalg.inv(poses[0]) @ poses[1]
    assert photometric_correlation(pair, T_true) > 0.7
    aside = T_true.copy()
    aside[0, 3] += 0.5
    assert photometric_correlation(pair, aside) < photometric_correlation(pair, T_true) - 0.3
    away = T_true.copy()
    away[0, 3] += 50
    assert math.isnan(photometric_correlation(pair, away)), "nothing coincides"


@pytest.mark.parametrize("grey", [False, True])
def test_the_correlation_is_the_same_the_other_way_round(grey, studio):
    """Also of a grey image and a coloured one."""
    poses = looking(), looking((0.1, 0.3, 0))
    one, other = (studio.frame(pose, seed) for seed, pose in enumerate(poses))
    if grey:
        other = replace(other, image=np.ascontiguousarray(other.image[..., 1]))
    one, other = (extract(frame, Config()) for frame in (one, other))
    T = np.linalg.inv(poses[0]) @ poses[1]
    forth = photometric_correlation(Pair(one, other, no_matches(), no_matches(), Config()), T)
    back = photometric_correlation(Pair(other, one, no_matches(), no_matches(), Config()), np.linalg.inv(T))
    assert forth == pytest.approx(back, abs=1e-6)
