# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor models against the statistics that they state."""

from __future__ import annotations

import numpy as np
import pytest

from vigg_ros.bench.worlds import ImageNoise, KinectNoise, render_depth
from vigg_ros.bench.worlds.poses import look_at, upright
from vigg_ros.bench.worlds.surfaces import Rectangle
from vigg_ros.registration import Camera, ConfigError
from vigg_ros_testing.simple_scenes import plain_texture, scene_of

CONTINUOUS = KinectNoise(disparity_step_px=0, correlation_px=0, dropout=0)


def even_depth(depth_m: float, camera: Camera) -> np.ndarray:
    return np.full((camera.height_px, camera.width_px), depth_m, dtype=np.float32)


@pytest.mark.parametrize("depth_m", [1.0, 2.0, 4.0])
def test_the_error_grows_with_the_square_of_the_distance(camera: Camera, depth_m: float) -> None:
    measured_m = CONTINUOUS.apply(even_depth(depth_m, camera), camera, np.random.default_rng(1))
    # 19,200 samples: the spread of a spread is 0.5 %, four of those.
    assert (measured_m - depth_m).std() == pytest.approx(0.00145 * depth_m**2, rel=0.02)


def test_correlated_error_keeps_its_spread_and_binds_neighbours(camera: Camera) -> None:
    noise = KinectNoise(disparity_step_px=0, correlation_px=1.5, dropout=0)
    errors_m = noise.apply(even_depth(2.0, camera), camera, np.random.default_rng(2)) - 2.0
    # Blurred by 1.5 px, 4 pi 1.5^2 = 28 px count as one sample: of 680 the spread is 2.7 %, four of those.
    assert errors_m.std() == pytest.approx(0.00145 * 4, rel=0.11)
    # White noise after a Gaussian blur s is correlated by exp(-1 / (4 s^2)) = 0.895 from pixel to pixel.
    neighbours = np.corrcoef(errors_m[:, :-1].ravel(), errors_m[:, 1:].ravel())[0, 1]
    assert neighbours == pytest.approx(0.895, abs=0.03)


def test_disparities_come_in_steps(camera: Camera) -> None:
    noise = KinectNoise(dropout=0)
    measured_m = noise.apply(even_depth(3.0, camera), camera, np.random.default_rng(3))
    steps = noise.focal_baseline_px_m / measured_m / noise.disparity_step_px
    # Float32 depths of 3 m are exact to 1e-7 of themselves, and there are 117 steps.
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-4)
    assert 2 < len(np.unique(np.rint(steps))) < 20


def test_there_is_no_depth_at_edges(camera: Camera) -> None:
    depth_m = even_depth(1.0, camera)
    depth_m[:, 80:] = 2.0
    measured_m = CONTINUOUS.apply(depth_m, camera, np.random.default_rng(4))
    assert (measured_m[:, 79:81] == 0).all()
    assert (measured_m[:, :79] > 0).all()
    assert (measured_m[:, 81:] > 0).all()


@pytest.mark.parametrize(("tilt_deg", "seen"), [(70, True), (84, False)])
def test_grazing_surfaces_give_no_depth(camera: Camera, tilt_deg: float, seen: bool) -> None:
    # A wall that the middle of the view meets at tilt_deg from its normal; the limit is 80 deg.
    eye = (2 - 1.5 * np.cos(np.radians(tilt_deg)), -1.5 * np.sin(np.radians(tilt_deg)), 0.0)
    scene = scene_of(Rectangle(upright((2, 0, 0), 180), (9, 9), plain_texture()))
    depth_m = render_depth(scene, camera, look_at(eye, (2, 0, 0)))
    measured_m = CONTINUOUS.apply(depth_m, camera, np.random.default_rng(5))
    assert (measured_m[50:70, 78:82] > 0).all() == seen
    assert (measured_m[50:70, 78:82] > 0).any() == seen


def test_patches_are_lost_and_the_range_is_limited(camera: Camera) -> None:
    noise = KinectNoise(dropout=0.02)
    measured_m = noise.apply(even_depth(2.0, camera), camera, np.random.default_rng(6))
    assert np.mean(measured_m == 0) == pytest.approx(0.02, abs=1e-3)
    for depth_m in (0.3, 6.5, 0.0):
        assert not noise.apply(even_depth(depth_m, camera), camera, np.random.default_rng(7)).any()


def test_the_same_generator_state_gives_the_same_bytes(camera: Camera) -> None:
    first, again, other = (
        KinectNoise().apply(even_depth(2.0, camera), camera, np.random.default_rng(seed)) for seed in (8, 8, 9)
    )
    assert first.tobytes() == again.tobytes() != other.tobytes()


def test_image_noise_has_the_stated_gain_and_spread() -> None:
    image = np.full((100, 100, 3), 100, dtype=np.uint8)
    noisy = ImageNoise(gain=1.2, sigma=4.0).apply(image, np.random.default_rng(10)).astype(float)
    # 30,000 samples; rounding to grey levels adds a variance of 1/12.
    assert noisy.mean() == pytest.approx(120, abs=4 * 4 / np.sqrt(30000))
    assert noisy.std() == pytest.approx(np.sqrt(16 + 1 / 12), rel=0.02)


def test_noise_saturates_instead_of_wrapping() -> None:
    image = np.full((10, 10, 3), 250, dtype=np.uint8)
    assert (ImageNoise(gain=2.0, sigma=0.0).apply(image, np.random.default_rng(0)) == 255).all()


def test_a_negative_spread_is_refused() -> None:
    with pytest.raises(ConfigError, match="numbers from 0 up"):
        KinectNoise(sigma_per_m2=-1.0)
