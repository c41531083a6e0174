# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scans against the surfaces that they hit, and noise against the statistics that it states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from vigg_ros.bench.worlds import (
    ImageNoise,
    KinectNoise,
    LidarModel,
    Scene,
    StereoNoise,
    render_depth,
    render_lidar,
    scan_lidar,
)
from vigg_ros.bench.worlds.poses import Pose, flat, look_at, upright
from vigg_ros.bench.worlds.surfaces import Rectangle
from vigg_ros.registration import ConfigError
from vigg_ros.registration.rigid import transform
from vigg_ros_testing.simple_scenes import CAMERA, plain_texture, scene_of, wall

MODEL = LidarModel(beams=16, columns=180)
AT_ORIGIN = flat((0, 0, 0))


def four_walls() -> Scene:
    """Walls at x = +-10 and y = +-6, 20 m high: every beam of the model meets one."""
    walls = (((10, 0, 0), 180, 12), ((-10, 0, 0), 0, 12), ((0, 6, 0), 270, 20), ((0, -6, 0), 90, 20))
    return scene_of(*(Rectangle(upright(at, facing), (wide, 20), plain_texture()) for at, facing, wide in walls))


def off_the_walls_m(points: NDArray[np.floating]) -> NDArray[np.floating]:
    return np.maximum(np.abs(points[:, 0]) - 10, np.abs(points[:, 1]) - 6)


def test_points_lie_on_the_walls() -> None:
    T_world_lidar = flat((2.0, -1.0, 0.5), 35)
    points, times_s = render_lidar(four_walls(), T_world_lidar, MODEL)
    assert points.dtype == np.float32
    assert points.shape == (16 * 180, 3)
    assert times_s.shape == (16 * 180,)
    # Float32 metres of up to 16 m are exact to a micrometre.
    np.testing.assert_allclose(off_the_walls_m(transform(T_world_lidar, points)), 0, atol=5e-6)
    points, _ = render_lidar(four_walls(), flat((9.7, 0, 0)), replace(MODEL, range_max_m=9.0))
    ranges_m = np.linalg.norm(points, axis=1)
    assert 0.5 <= ranges_m.min() < ranges_m.max() <= 9.0, "what is too near or too far gives no return"


def test_columns_fire_from_rear_to_rear_and_beams_span_the_elevations() -> None:
    points, times_s = render_lidar(four_walls(), AT_ORIGIN, MODEL)
    assert (np.diff(times_s) >= 0).all()
    # One turn in 0.1 s: azimuth = time / 0.1 s * 2 pi, zero at the stamp; float32 angles to 1e-6.
    np.testing.assert_allclose(np.arctan2(points[:, 1], points[:, 0]), times_s / 0.1 * 2 * np.pi, atol=1e-5)
    elevation_deg = np.degrees(np.arctan2(points[:, 2], np.hypot(points[:, 0], points[:, 1])))
    np.testing.assert_allclose(elevation_deg, np.tile(np.linspace(-25, 15, 16), 180), atol=1e-3)


def test_a_moving_scan_is_straight_again_with_the_pose_of_each_column() -> None:
    def motion(time_s: float) -> Pose:
        return flat((8.0 * time_s, 0, 0), 90.0 * time_s)

    points, times_s = render_lidar(four_walls(), motion, MODEL)
    in_world = np.concatenate([transform(motion(time_s), points[times_s == time_s]) for time_s in np.unique(times_s)])
    np.testing.assert_allclose(off_the_walls_m(in_world), 0, atol=5e-6)
    # Taken as rigid it is bent: from the middle to the ends of the scan the sensor moves 0.4 m.
    assert np.abs(off_the_walls_m(transform(motion(0.0), points))).max() > 0.3


def test_range_noise_has_the_stated_spread() -> None:
    rng = np.random.default_rng(5)
    exact, _ = render_lidar(four_walls(), AT_ORIGIN, MODEL)
    noisy, _ = render_lidar(four_walls(), AT_ORIGIN, MODEL, rng=rng)
    errors_m = np.linalg.norm(noisy, axis=1) - np.linalg.norm(exact, axis=1)
    # 2,880 samples: the spread of a spread is 1 / sqrt(2 n) = 1.3 %, four of those.
    assert errors_m.std() == pytest.approx(0.02, rel=0.053)
    assert abs(errors_m.mean()) < 4 * 0.02 / np.sqrt(2880)


def test_intensity_falls_with_the_angle_of_incidence() -> None:
    scan = scan_lidar(four_walls(), AT_ORIGIN, MODEL)
    ahead = np.argmin(np.linalg.norm(scan.points - (10, 0, 0), axis=1))
    cosine = 10 / np.linalg.norm(scan.points[ahead])
    assert scan.intensities[ahead] == pytest.approx(128 * cosine, abs=0.1)
    assert scan.intensities.max() <= 128


CONTINUOUS = KinectNoise(disparity_step_px=0, correlation_px=0, dropout=0)
EVEN = np.ones((CAMERA.height_px, CAMERA.width_px), np.float32)


def measure(noise: KinectNoise, depth_m: NDArray[np.float32], seed: int = 1) -> NDArray[np.float32]:
    return noise.apply(depth_m, CAMERA, np.random.default_rng(seed))


@pytest.mark.parametrize("depth_m", [1.0, 2.0, 4.0])
def test_the_error_grows_with_the_square_of_the_distance(depth_m: float) -> None:
    measured_m = measure(CONTINUOUS, depth_m * EVEN, 1)
    # 19,200 samples: the spread of a spread is 0.5 %, four of those.
    assert (measured_m - depth_m).std() == pytest.approx(0.00145 * depth_m**2, rel=0.02)


def test_correlated_error_keeps_its_spread_and_binds_neighbours() -> None:
    noise = KinectNoise(disparity_step_px=0, correlation_px=1.5, dropout=0)
    errors_m = measure(noise, 2.0 * EVEN, 2) - 2.0
    # Blurred by 1.5 px, 4 pi 1.5^2 = 28 px count as one sample: of 680 the spread is 2.7 %, four of those.
    assert errors_m.std() == pytest.approx(0.00145 * 4, rel=0.11)
    # White noise after a Gaussian blur s is correlated by exp(-1 / (4 s^2)) = 0.895 from pixel to pixel.
    neighbours = np.corrcoef(errors_m[:, :-1].ravel(), errors_m[:, 1:].ravel())[0, 1]
    assert neighbours == pytest.approx(0.895, abs=0.03)


def test_disparities_come_in_steps() -> None:
    noise = KinectNoise(dropout=0)
    measured_m = measure(noise, 3.0 * EVEN, 3)
    steps = noise.focal_baseline_px_m / measured_m / noise.disparity_step_px
    # Float32 depths of 3 m are exact to 1e-7 of themselves, and there are 117 steps.
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-4)
    assert 2 < len(np.unique(np.rint(steps))) < 20


def test_there_is_no_depth_at_edges() -> None:
    depth_m = EVEN.copy()
    depth_m[:, 80:] = 2.0
    measured_m = measure(CONTINUOUS, depth_m, 4)
    np.testing.assert_array_equal(np.flatnonzero((measured_m == 0).any(axis=0)), [79, 80])


@pytest.mark.parametrize(("tilt_deg", "seen"), [(70, True), (84, False)])
def test_grazing_surfaces_give_no_depth(tilt_deg: float, seen: bool) -> None:
    # A wall that the middle of the view meets at tilt_deg from its normal; the limit is 80 deg.
    eye = (2 - 1.5 * np.cos(np.radians(tilt_deg)), -1.5 * np.sin(np.radians(tilt_deg)), 0.0)
    depth_m = render_depth(scene_of(wall(2)), CAMERA, look_at(eye, (2, 0, 0)))
    measured_m = measure(CONTINUOUS, depth_m, 5)
    assert (measured_m[50:70, 78:82] > 0).all() == seen
    assert (measured_m[50:70, 78:82] > 0).any() == seen


def test_patches_are_lost_and_the_range_is_limited() -> None:
    noise = KinectNoise(dropout=0.02)
    measured_m = measure(noise, 2.0 * EVEN, 6)
    assert np.mean(measured_m == 0) == pytest.approx(0.02, abs=1e-3)
    for depth_m in (0.3, 6.5, 0.0):
        assert not measure(noise, depth_m * EVEN, 7).any()


def test_the_same_generator_state_gives_the_same_bytes() -> None:
    first, again, other = (measure(KinectNoise(), 2.0 * EVEN, seed) for seed in (8, 8, 9))
    assert first.tobytes() == again.tobytes() != other.tobytes()


def test_image_noise_has_the_stated_gain_and_spread() -> None:
    image = np.full((100, 100, 3), 100, dtype=np.uint8)
    noisy = ImageNoise(gain=1.2, sigma=4.0).apply(image, np.random.default_rng(10)).astype(float)
    # 30,000 samples; rounding to grey levels adds a variance of 1/12.
    assert noisy.mean() == pytest.approx(120, abs=4 * 4 / np.sqrt(30000))
    assert noisy.std() == pytest.approx(np.sqrt(16 + 1 / 12), rel=0.02)
    bright = ImageNoise(gain=3.0, sigma=0.0).apply(image, np.random.default_rng(0))
    assert (bright == 255).all(), "it saturates and does not wrap"


def measured_by_stereo(depth_m: NDArray[np.float32], image: NDArray[np.uint8] | None = None, **changes: float):
    """By a stereo camera that measures continuously and errs at each pixel for itself, unless changes say otherwise."""
    noise = replace(StereoNoise(step_px=0, correlation_px=0), **changes)
    return noise.apply(depth_m, CAMERA, np.random.default_rng(11), image=image)


@pytest.mark.parametrize(("depth_m", "sigma_m"), [(1.0, 0.0052), (2.0, 0.0209), (4.0, 0.0836)])
def test_stereo_errs_evenly_in_disparity_two_percent_at_4_m(depth_m: float, sigma_m: float) -> None:
    measured_m = measured_by_stereo(depth_m * EVEN)
    errors_m = measured_m[measured_m > 0] - depth_m
    # 18,000 samples: 0.5 %, four of those, and at 4 m another 0.2 % as depth is no line in disparity.
    assert errors_m.std() == pytest.approx(sigma_m, rel=0.025)
    assert StereoNoise().sigma_m(np.array(depth_m)) == pytest.approx(sigma_m, rel=0.01)


def test_stereo_disparities_come_in_32nds_of_a_native_pixel_and_neighbours_err_together() -> None:
    measured_m = StereoNoise().apply(4.0 * EVEN, CAMERA, np.random.default_rng(1))
    seen = measured_m[:, 5:]
    steps = 383.0 * 0.05 / seen * 32
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-3)
    assert 8 < len(np.unique(np.rint(steps))) < 40
    # A blur of 2 native px is 0.72 px here: neighbours are correlated by exp(-1 / (4 0.72^2)) = 0.62.
    assert np.corrcoef(seen[:, :-1].ravel(), seen[:, 1:].ravel())[0, 1] == pytest.approx(0.62, abs=0.05)


def test_stereo_sees_nothing_where_the_right_imager_does_not() -> None:
    depth_m = 4.0 * EVEN
    depth_m[:, 80:120] = 1.0
    lost = np.flatnonzero((measured_by_stereo(depth_m) == 0).all(axis=0))
    # f b is 138.5 px * 50 mm: disparities are 1.73 px at 4 m, which the left band is wide, and 6.93 at 1 m: 5.19 px
    # beside the near thing are hidden. Windows of three pixels reach over its edges.
    np.testing.assert_array_equal(lost, [0, 1, 75, 76, 77, 78, 79, 80, 119, 120])


def test_stereo_needs_texture_where_its_projector_does_not_reach() -> None:
    depth_m = 4.0 * EVEN
    depth_m[:60] = 2.0
    image = np.full((*EVEN.shape, 3), 120, np.uint8)
    image[:, 80:] += np.random.default_rng(2).integers(0, 20, (120, 80, 1)).astype(np.uint8)
    seen = measured_by_stereo(depth_m, image) > 0
    assert seen[5:55, 5:].all()
    assert not seen[65:, :75].any()
    # Nine pixels of this pattern are now and then alike.
    assert seen[65:, 85:].mean() > 0.99


def test_stereo_has_a_range() -> None:
    for depth_m in (0.2, 11.0, 0.0):
        assert not measured_by_stereo(depth_m * EVEN, sigma_px=0.0).any()


def test_impossible_models_are_refused() -> None:
    with pytest.raises(ConfigError, match="numbers from 0 up"):
        KinectNoise(sigma_per_m2=-1.0)
    with pytest.raises(ConfigError, match="focal length and baseline above"):
        StereoNoise(baseline_m=0.0)
    with pytest.raises(ConfigError, match="expected beams"):
        LidarModel(beams=0)
