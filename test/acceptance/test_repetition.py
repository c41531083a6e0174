# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Texture that repeats is refused, and texture that does not is not."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from vigg_ros.acceptance.agreement import Pair
from vigg_ros.acceptance.repetition import repeated_motion, shifted_motion
from vigg_ros.registration import Camera, Config, Frame, Registration, extract, register
from vigg_ros.registration.matches import Matches, no_matches
from vigg_ros_testing.registration_samples import looking

CONFIG = Config()
CAMERA = Camera(480, 360, 394.0, 394.0, 239.5, 179.5)
WALL_M = 2.0


def tile(seed, texels=160):
    """A blurred pattern of grey squares, whose left and right, upper and lower ends fit."""
    rng = np.random.default_rng(seed)
    squares = np.kron(rng.integers(0, 255, (10, 10)), np.ones((texels // 10, texels // 10)))
    blurred = cv2.GaussianBlur(np.tile(squares, (3, 3)).astype(np.float32), (0, 0), 3.0)
    return np.asarray(blurred[texels : 2 * texels, texels : 2 * texels])


def wall(period_m, seed, x_m):
    """A papered wall straight ahead, seen from ``x_m`` along it, with the noise of both sensors."""
    rng = np.random.default_rng((seed, round(1000 * x_m)))
    pattern = np.pad(tile(seed), 2, mode="wrap")
    v, u = np.mgrid[0 : CAMERA.height_px, 0 : CAMERA.width_px]
    along = ((u - CAMERA.cx_px) / CAMERA.fx_px * WALL_M + x_m) / period_m % 1 * 160 + 2
    up = ((v - CAMERA.cy_px) / CAMERA.fy_px * WALL_M) / period_m % 1 * 160 + 2
    image = cv2.remap(pattern, along.astype(np.float32), up.astype(np.float32), cv2.INTER_LINEAR)
    image = np.clip(image + rng.normal(0, 3, image.shape), 0, 255).astype(np.uint8)
    depth_m = (WALL_M + rng.normal(0, 0.005, image.shape)).astype(np.float32)
    return extract(Frame.from_depth(image, depth_m, CAMERA), CONFIG)


@pytest.mark.hostile("Scene: repeated texture and repeated structure: reject rather than choose wrongly")
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("period_m", [0.4, 0.5])
@pytest.mark.parametrize("x_m", [0.07, 0.22])
def test_a_wall_with_a_repeating_print_is_not_answered_wrongly(seed, period_m, x_m):
    target, source = wall(period_m, seed, 0.0), wall(period_m, seed, x_m)
    for config in (CONFIG, CONFIG.replace({"geometric.always": True}))[: 2 if seed == 1 else 1]:
        outcome = register(target, source, config)
        if isinstance(outcome, Registration):
            np.testing.assert_allclose(outcome.T_target_source[:3, 3], (x_m, 0, 0), atol=0.05)


def test_the_period_is_found():
    target, source = wall(0.5, 1, 0.0), wall(0.5, 1, 0.07)
    T_true = np.eye(4)
    T_true[0, 3] = 0.07
    pair = Pair(target, source, no_matches(), no_matches(), CONFIG)
    shifted = repeated_motion(pair, T_true)
    periods = (shifted[:3, 3] - T_true[:3, 3]) / 0.5
    assert np.abs(periods).max() > 0.9
    # Along either axis of the print. Keypoints are located to about a pixel, 5 mm here; the mean of dozens to less.
    np.testing.assert_allclose(periods, np.rint(periods), atol=0.02)


@pytest.mark.parametrize(("others", "is_shown"), [(0, False), (12, False), (30, True)])
def test_matches_that_chose_another_copy_show_its_shift(others, is_shown):
    """60 matches agree with no motion, ``others`` with a shift by 1.2 m, the rest of 150 with nothing.

    Twelve are beyond chance, but too few beside sixty to be copies of the same things.
    """
    rng = np.random.default_rng(0)
    source, target = rng.uniform(-3, 3, (2, 150, 3))
    target[:60] = source[:60]
    target[60 : 60 + others] = source[60 : 60 + others] + (0, 1.2, 0)
    rows = np.arange(150)
    visual = Matches(target, source, np.ones(150), rows, rows, np.zeros(150))
    found = shifted_motion(Pair(None, None, visual, no_matches(), CONFIG), np.eye(4))
    assert (found is not None) == is_shown
    if is_shown:
        np.testing.assert_allclose(found[:3, 3], (0, 1.2, 0), atol=0.02)


def test_a_furnished_room_does_not_repeat(studio):
    poses = [looking((0.1 * k, 0.05 * k, 0)) for k in range(4)]
    for k, pose in enumerate(poses[1:], 1):
        pair = Pair(studio.features(poses[0], 0), studio.features(pose, k), no_matches(), no_matches(), CONFIG)
        assert repeated_motion(pair, np.linalg.inv(poses[0]) @ pose) is None


def test_too_few_keypoints_show_no_period(studio):
    features = studio.features(looking(), 1)
    few = replace(features, keypoints=features.keypoints.select(np.arange(5)))
    assert repeated_motion(Pair(features, few, no_matches(), no_matches(), CONFIG), np.eye(4)) is None
