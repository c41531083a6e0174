# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The noise of a depth sensor: by name, by numbers, or as its own images show it; and the planes that show it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from vigg_ros.bench.worlds import KinectNoise, StereoNoise
from vigg_ros.registration import Camera, Config, extract
from vigg_ros.registration.depth_alignment import DepthSurface
from vigg_ros.registration.geometric import match_global
from vigg_ros.registration.geometry import DepthMap
from vigg_ros.registration.noise import MODELS, NO_NOISE, DepthNoise, DepthPlanes, estimate_noise, noise_of
from vigg_ros.registration.options import NoiseConfig
from vigg_ros.registration.visual import match_visual
from vigg_ros_testing.registration_samples import Studio, looking

CAMERA = Camera(width_px=320, height_px=240, fx_px=277.0, fy_px=275.0, cx_px=160.3, cy_px=119.1)


def rays(camera: Camera = CAMERA) -> NDArray[np.float64]:
    """(H, W, 3), each with z = 1."""
    v, u = np.indices((camera.height_px, camera.width_px))
    return np.stack(
        ((u - camera.cx_px) / camera.fx_px, (v - camera.cy_px) / camera.fy_px, np.ones(u.shape)), axis=-1
    )


def plane_depth(normal: tuple[float, float, float], distance_m: float) -> NDArray[np.float32]:
    """Of the plane n . X = d, where it lies before the camera."""
    towards = rays() @ normal
    return np.where(towards > 0.05, distance_m / np.maximum(towards, 0.05), 0).astype(np.float32)


def staircase() -> NDArray[np.float32]:
    """Sixteen panels that stand upright, half of them slanted, 0.6 to 5 m away."""
    depth_m = np.zeros((CAMERA.height_px, CAMERA.width_px), np.float32)
    for panel, distance_m in enumerate(np.linspace(0.6, 5, 16)):
        rows, columns = (slice(size * (k % 4), size * (k % 4 + 1)) for size, k in ((60, panel), (80, panel // 4)))
        depth_m[rows, columns] = plane_depth((0.2 * (panel % 2), 0.1, 1), distance_m)[rows, columns]
    return depth_m


def planes_of(depth_m: NDArray[np.floating]) -> DepthPlanes:
    return DepthPlanes.of(DepthMap(CAMERA, depth_m.astype(np.float32)))


SLANTED = (0.4, -0.3, 0.8), 1.7


def test_planes_of_a_plane_are_that_plane() -> None:
    normal, distance_m = np.array(SLANTED[0]), SLANTED[1]
    planes = planes_of(plane_depth(*SLANTED))
    shown = planes.grid[..., 0] > 0
    assert shown.mean() > 0.9
    pixels = planes.pixels()[shown]
    depth_m = distance_m / (CAMERA.lift(pixels, np.ones(len(pixels))) @ normal)
    np.testing.assert_allclose(planes.grid[shown][:, 0], depth_m, rtol=1e-6)
    towards_camera = -normal / np.linalg.norm(normal)
    np.testing.assert_allclose(planes.grid[shown][:, 1:4], np.tile(towards_camera, (len(pixels), 1)), atol=1e-4)
    # Depth is float32: 1e-7 of an inverse depth below 1.
    assert planes.grid[shown][:, 4].max() < 1e-6


def test_no_plane_reaches_across_an_edge() -> None:
    depth_m = np.where(np.arange(320) < 160, 1.0, 2.0) * np.ones((240, 1))
    grid = planes_of(depth_m).grid
    np.testing.assert_allclose(grid[grid[..., 0] > 0][:, 3], -1, atol=1e-5)
    assert set(np.round(grid[..., 0].ravel(), 5)) <= {0.0, 1.0, 2.0}


def test_samples_lie_within_the_range_and_are_as_sure_as_the_noise_says() -> None:
    noise = DepthNoise(0.002, 0.0, 0.003)
    surface = DepthSurface.of(planes_of(staircase()), noise, near_m=1.0, far_m=3.0)
    z = surface.samples.points[:, 2]
    assert len(z) > 500
    assert 1.0 < z.min() < 1.2
    assert 2.7 < z.max() <= 3.0
    np.testing.assert_allclose(surface.samples.sigma_m, np.sqrt(0.002**2 + (0.003 * z**2) ** 2), rtol=1e-4)


@pytest.mark.parametrize("noise", [*MODELS.values(), DepthNoise(0.01, 0.02, 0.003), DepthNoise(0.0, 0.01, 0.0)])
def test_the_reach_is_where_the_deviation_is_reached(noise: DepthNoise) -> None:
    for sigma_m in (0.03, 0.1, 0.5):
        reach_m = noise.reach_m(sigma_m)
        if noise == NO_NOISE:
            assert reach_m == np.inf
        else:
            assert noise.sigma_m(np.array([reach_m])) == pytest.approx(sigma_m)
    assert noise.reach_m(noise.constant_m) in (0.0, np.inf)
    assert noise.reach_m(0.9 * noise.constant_m) == 0.0


@pytest.mark.parametrize(
    ("sensor", "focal_baseline"),
    [
        (KinectNoise(disparity_step_px=0, correlation_px=0, dropout=0), 585 * 0.075),
        (KinectNoise(correlation_px=0, dropout=0), 585 * 0.075),
        (StereoNoise(correlation_px=0), 383 * 0.05),
    ],
    ids=["without steps", "with steps", "stereo"],
)
def test_noise_of_disparity_is_seen_in_the_image(sensor: KinectNoise | StereoNoise, focal_baseline: float) -> None:
    estimated = estimate_noise(planes_of(sensor.apply(staircase(), CAMERA, np.random.default_rng(0))))
    assert estimated is not None
    step_px = sensor.disparity_step_px if isinstance(sensor, KinectNoise) else sensor.step_px
    # Steps err evenly between their halves.
    per_m2 = np.hypot(float(sensor.sigma_m(np.array(1.0))), step_px / np.sqrt(12) / focal_baseline)
    assert estimated.per_m2 == pytest.approx(per_m2, rel=0.3)
    assert estimated.per_m == 0
    assert estimated.constant_m < 0.004


@pytest.mark.parametrize("constant_m", [0.005, 0.02])
def test_noise_that_does_not_grow_is_seen_too(constant_m: float) -> None:
    depth_m = staircase() + np.random.default_rng(1).normal(0, constant_m, (240, 320))
    estimated = estimate_noise(planes_of(depth_m))
    assert estimated is not None
    assert estimated.constant_m == pytest.approx(constant_m, rel=0.3)
    assert estimated.per_m2 * 3**2 < 0.5 * constant_m


def test_an_image_without_planes_is_taken_for_structured_light() -> None:
    depth_m = np.zeros((240, 320))
    depth_m[100:112, 100:112] = 2
    few = planes_of(depth_m)
    assert np.count_nonzero(few.grid[..., 0]) > 0
    assert estimate_noise(few) is None
    assert noise_of(few, NoiseConfig()) == MODELS["structured_light"]


def test_a_scan_is_a_lidars_and_a_name_or_numbers_override() -> None:
    planes = planes_of(KinectNoise().apply(staircase(), CAMERA, np.random.default_rng(0)))
    assert noise_of(None, NoiseConfig()) == MODELS["lidar"]
    assert noise_of(planes, NoiseConfig()) == estimate_noise(planes)
    for name, model in MODELS.items():
        assert noise_of(planes, NoiseConfig(model=name)) == noise_of(None, NoiseConfig(model=name)) == model
    own = NoiseConfig(model="stereo", sigma_per_m=0.01)
    assert noise_of(planes, own) == replace(MODELS["stereo"], per_m=0.01)
    assert noise_of(None, NoiseConfig(sigma_m=0.05, sigma_per_m2=0.002)) == DepthNoise(0.05, 0.0024, 0.002)


@pytest.mark.parametrize("name", ["rgbd_paper", "lidar_paper"])
def test_to_the_papers_method_all_points_are_equal(name: str, studio: Studio) -> None:
    config = Config.preset(name)
    target, source = (extract(studio.frame(pose, 1), config) for pose in (looking(), looking((0.1, 0.1, 0))))
    assert target.noise == NO_NOISE
    threshold_m = config.cliques.inlier_threshold_m
    visual = match_visual(target.keypoints, source.keypoints, config.visual)
    for matches in (visual, match_global(target.landmarks, source.landmarks, config.geometric)):
        assert len(matches) > 10
        assert (matches.radii_m(threshold_m) == threshold_m).all()


def test_a_frame_knows_its_noise_and_so_do_its_matches(studio: Studio) -> None:
    target, source = studio.pair((looking(), looking((0.1, 0.1, 0))))
    visual = match_visual(target.keypoints, source.keypoints, Config().visual)
    by_both = [
        features.noise.sigma_m(np.linalg.norm(points, axis=1))
        for features, points in ((target, visual.target), (source, visual.source))
    ]
    np.testing.assert_allclose(visual.sigma_m, np.hypot(*by_both))
    # Of a Kinect, whose errors go together over much of a window at a quarter of its size: they are seen too small.
    assert 0.0007 < target.noise.per_m2 < 0.003
