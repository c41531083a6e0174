# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a motion leaves between two depth images, by closed form and by finite differences."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats
from scipy.spatial.transform import Rotation

from vigg_ros.bench.worlds import HandheldLoop, StereoNoise, render_rgbd, workshop
from vigg_ros.bench.worlds.poses import Pose, look_at
from vigg_ros.registration import Camera, Config, Features, Frame, Reason, Rejection, extract, register
from vigg_ros.registration.alignment import curvature_of, patch_of
from vigg_ros.registration.depth_alignment import PIXEL_SIGMA_SHARE, DepthAlignment, DepthSurface
from vigg_ros.registration.features import alignment
from vigg_ros.registration.geometry import DepthMap
from vigg_ros.registration.matches import Matches, no_matches
from vigg_ros.registration.noise import MODELS, DepthNoise, DepthPlanes
from vigg_ros.registration.refinement import refine
from vigg_ros_testing.registration_samples import (
    Studio,
    answer,
    apply,
    assert_near,
    enlarged,
    error_vector,
    looking,
    matches_of,
    motion,
    normalised_error,
    rendered,
    truth,
)

CONFIG = Config()
VOXEL_M = CONFIG.geometric.voxel_size_m
CAMERA = enlarged(2)
T_TRUE = motion((2, -3, 1), (0.05, -0.02, 0.04))
NORMAL, DISTANCE_M = np.array((0.3, -0.2, 0.93)), 2.0


def moved(T: Pose, step: NDArray[np.float64]) -> Pose:
    """The motion after a step of translation and rotation about the moved origin of the source."""
    after = T.copy()
    after[:3, :3] = Rotation.from_rotvec(step[3:]).as_matrix() @ T[:3, :3]
    after[:3, 3] += step[:3]
    return after


def plane_seen(normal: NDArray[np.float64], distance_m: float, noise: DepthNoise) -> DepthSurface:
    """The plane n . X = d as a camera with such noise sees it, exactly."""
    v, u = np.indices((CAMERA.height_px, CAMERA.width_px))
    pixels = np.column_stack((u.ravel(), v.ravel()))
    depth_m = distance_m / (CAMERA.lift(pixels, np.ones(len(pixels))) @ normal)
    planes = DepthPlanes.of(DepthMap(CAMERA, depth_m.reshape(u.shape).astype(np.float32)))
    return DepthSurface.of(planes, noise, near_m=0.0, far_m=20.0)


def of_a_plane(matches: Matches, noise: DepthNoise = MODELS["structured_light"]) -> DepthAlignment:
    """A plane that both see, T_TRUE apart: n . (R X + t) = d is n R . X = d - n . t in the source."""
    in_source = T_TRUE[:3, :3].T @ NORMAL
    target = plane_seen(NORMAL, DISTANCE_M, noise)
    source = plane_seen(in_source, DISTANCE_M - NORMAL @ T_TRUE[:3, 3], noise)
    return DepthAlignment(target, source, matches, VOXEL_M)


def points_in_view(count: int) -> NDArray[np.float64]:
    rng = np.random.default_rng(0)
    return CAMERA.lift(rng.uniform((20, 20), (300, 220), (count, 2)), rng.uniform(1, 4, count))


def exact_matches(count: int = 50) -> Matches:
    source = points_in_view(count)
    return matches_of(apply(T_TRUE, source), source)


def slopes(residuals_at, T: Pose) -> NDArray[np.float64]:
    """(N, 6): minus the derivative of the residuals (N,), by central differences."""
    return np.column_stack(
        [(residuals_at(moved(T, -1e-6 * axis)) - residuals_at(moved(T, 1e-6 * axis))) / 2e-6 for axis in np.eye(6)]
    )


def test_exact_matches_leave_nothing_and_their_slopes_are_those_of_finite_differences() -> None:
    """Whitening turns with the motion, but where nothing is left it turns nothing."""
    aligned = of_a_plane(exact_matches())
    found = aligned.visual(T_TRUE)
    np.testing.assert_allclose(found.value, 0, atol=1e-9)
    expected = slopes(lambda T: aligned.visual(T).value, T_TRUE)
    np.testing.assert_allclose(found.jacobian, expected, atol=1e-5 * np.abs(expected).max())
    # Four of each match: both ways, in u and v.
    np.testing.assert_array_equal(np.unique(found.cluster, return_counts=True)[1], 4)


def test_a_plane_is_met_exactly_and_its_slopes_are_those_of_finite_differences() -> None:
    aligned = of_a_plane(no_matches())
    found = aligned.surface(T_TRUE)
    assert len(found) > 1000
    np.testing.assert_allclose(found.value, 0, atol=2e-6)
    expected = slopes(lambda T: aligned.surface(T).value, T_TRUE)
    assert len(expected) == len(found)
    # Samples meet planes up to two pixels beside, 2 cm at 2 m, and symmetric ICP leaves the turn of the normal out.
    # The few that see the next plane after the step tell of two float32.
    off = np.abs(found.jacobian - expected)
    assert np.mean(off[:, :3].max(axis=1) < 1e-3) > 0.999
    assert np.mean(off[:, 3:].max(axis=1) < 0.02) > 0.999
    assert np.abs(expected[:, 3:]).max() > 1


def test_residuals_divided_by_their_noise_are_white() -> None:
    """Keypoints off by their nominal error, and depth by its noise, at a step to the side that shows it."""
    noise, count = DepthNoise(0.0, 0.0, 0.02), 4000
    rng = np.random.default_rng(1)
    true = points_in_view(count)
    T = motion((0, 5, 0), (0.4, -0.2, 0.1))
    sides = []
    for points in (apply(T, true), true):
        # A keypoint of either image is off; their errors are compared in one of them.
        pixels = CAMERA.project(points) + rng.normal(0, PIXEL_SIGMA_SHARE * CAMERA.width_px / np.sqrt(2), (count, 2))
        sides.append(CAMERA.lift(pixels, points[:, 2] + noise.sigma_m(points[:, 2]) * rng.standard_normal(count)))
    aligned = of_a_plane(matches_of(*sides), noise)
    errors = aligned.visual(T).value.reshape(count, 4)
    for way in (errors[:, :2], errors[:, 2:]):
        # An entry of the covariance of 4000 draws is known to 2 %; scale and depth change by some per cent within.
        np.testing.assert_allclose(np.cov(way.T), np.eye(2), atol=0.12)
    # Without the depth's share they would not be: along the step it shifts a point by 2 pixels and more.
    sure = of_a_plane(matches_of(*sides), DepthNoise(1e-6, 0, 0)).visual(T).value.reshape(count, 4)
    assert np.var(sure[:, 0]) > 3


@pytest.mark.parametrize("dimensions", [1, 2, 3])
def test_the_curvature_is_the_derivative_of_the_weighted_residuals(dimensions: int) -> None:
    rng = np.random.default_rng(2)
    drawn = rng.normal(0, 1.3, (200_000, dimensions))
    sigma = 0.9

    def pull(shift: NDArray[np.float64]) -> NDArray[np.float64]:
        shifted = drawn + shift
        size = np.linalg.norm(shifted, axis=1) / np.sqrt(dimensions)
        return np.asarray(np.mean(shifted / (1 + (size / sigma) ** 2)[:, None], axis=0))

    derivative = [(pull(1e-4 * axis) - pull(-1e-4 * axis)) @ axis / 2e-4 for axis in np.eye(dimensions)]
    size = np.linalg.norm(drawn, axis=1) / np.sqrt(dimensions)
    weight = np.mean(1 / (1 + (size / sigma) ** 2))
    assert curvature_of(size, sigma, dimensions) == pytest.approx(np.mean(derivative) / weight, rel=1e-3)


def test_patches_that_lie_opposite_have_numbers_of_their_own() -> None:
    corners = np.array([(x, y, z) for x in (-3, 3) for y in (-3, 3) for z in (-3, 3)], np.float32)
    near = np.concatenate((corners, corners + np.float32(0.1), corners + np.float32(1)))
    patch = patch_of(near, 0.5)
    assert patch.min() >= 0
    np.testing.assert_array_equal(patch[:8], patch[8:16])
    assert len(np.unique(patch)) == 16
    assert patch_of(np.empty((0, 3), np.float32), 0.5).shape == (0,)


def kinect_pair(studio: Studio, T_world_target: Pose, T_world_source: Pose, seed: int | None) -> list[Features]:
    seeds = (None, None) if seed is None else (2 * seed, 2 * seed + 1)
    poses = (T_world_target, T_world_source)
    return [
        extract(rendered(studio.scene, CAMERA, pose, seed=draw), CONFIG)
        for pose, draw in zip(poses, seeds, strict=True)
    ]


@pytest.mark.parametrize("start", [np.eye(4), motion((0.5, -0.5, 0.3), (0.02, 0.01, -0.02))], ids=["at rest", "off"])
def test_exact_depth_is_aligned_to_a_fraction_of_a_millimetre_without_images(start: Pose, studio: Studio) -> None:
    poses = looking(), looking((0.03, -0.02, 0.01), (0.02, 0.03, 0))
    target, source = kinect_pair(studio, *poses, None)
    aligned = alignment(target, source, no_matches(), CONFIG)
    assert isinstance(aligned, DepthAlignment)
    fit = refine(aligned, start @ truth(*poses), iterations=10, voxel_m=VOXEL_M)
    assert_near(fit.T_target_source, truth(*poses), rotation_deg=0.01, translation_m=0.0002)


def small_motions(count: int) -> list[tuple[Pose, Pose]]:
    """By 1.4 cm and a quarter of a degree to all sides, from places around the room."""
    path, rng = HandheldLoop(), np.random.default_rng(3)
    pairs = []
    for k in range(count):
        pose = path.T_world_camera(0.6 * (k % 8) + 0.07 * (k // 8))
        towards = rng.normal(size=3)
        step = motion(rng.normal(0, 0.25, 3), 0.014 * towards / np.linalg.norm(towards))
        pairs.append((pose, pose @ step))
    return pairs


def test_steps_of_disparity_do_not_hold_a_camera_that_moves_by_a_centimetre(studio: Studio) -> None:
    """Both frames share them: surfaces that lock onto them were off by 10 mm, and sure of it (NEES 165)."""
    normalised, off_m = [], []
    for seed, poses in enumerate(small_motions(12)):
        found = answer(register(*kinect_pair(studio, *poses, seed), CONFIG))
        normalised.append(normalised_error(found, truth(*poses)))
        off_m.append(np.linalg.norm(error_vector(found.T_target_source, truth(*poses))[:3]))
    assert max(off_m) < 0.002, off_m
    assert 2 < np.mean(normalised) < 10, normalised
    assert max(normalised) < stats.chi2(6).ppf(0.9999)


STEREO_CAMERA = Camera(320, 240, 191.5, 191.5, 159.5, 119.5)


@pytest.mark.parametrize("sigma_px", [0.1, 0.2])
def test_far_noisy_depth_does_not_veto_a_right_answer(sigma_px: float) -> None:
    """A hall up to 10 m deep: judged by fixed distances, two fifths of what both see would contradict."""
    poses = [look_at((-5.5, 0, 1.5), (3, 0.2, 0.9)), look_at((-5, 0.3, 1.5), (3.3, 0.2, 0.9))]
    seen = []
    for seed, pose in enumerate(poses):
        image, depth_m = render_rgbd(workshop(1), STEREO_CAMERA, pose)
        noise = StereoNoise(sigma_px=sigma_px)
        depth_m = noise.apply(depth_m, STEREO_CAMERA, np.random.default_rng(seed), image=image)
        assert np.mean(depth_m > 5) > 0.2, "much of it is far"
        seen.append(extract(Frame.from_depth(image, depth_m, STEREO_CAMERA), CONFIG))
    found = answer(register(seen[0], seen[1], CONFIG))
    assert_near(found.T_target_source, truth(*poses), rotation_deg=0.1, translation_m=0.006)
    assert normalised_error(found, truth(*poses)) < stats.chi2(6).ppf(0.9999)


@pytest.mark.parametrize("filled", [0.6, 0.2])
def test_depth_with_many_holes_is_aligned_in_space(filled: float, studio: Studio) -> None:
    """As depth registered to a larger image comes: no window is filled enough for a plane, yet the points are there."""
    poses = looking(), looking((0.06, 0.02, 0), (0.03, 0, 0.02))
    seen = []
    for seed, pose in enumerate(poses):
        frame = studio.frame(pose, seed)
        holes = np.random.default_rng(10 + seed).random(frame.geometry.depth_m.shape) > filled
        depth_m = np.where(holes, np.float32(0), frame.geometry.depth_m)
        seen.append(extract(Frame.from_depth(frame.image, depth_m, frame.camera), Config()))
    assert seen[0].depth_surface is None
    found = answer(register(*seen, Config()))
    assert_near(found.T_target_source, truth(*poses), rotation_deg=0.5, translation_m=0.02)


def test_frames_beyond_the_reach_of_their_surface_are_refused(studio: Studio) -> None:
    """Keypoints without a patch near them: NO_DEPTH, and nothing else is searched."""
    frame = studio.frame(looking(), 1)
    far = Frame.from_depth(frame.image, np.full_like(frame.geometry.depth_m, 5.0), frame.camera)
    config = Config().replace({"noise.model": "stereo"})
    outcome = register(extract(far, config), extract(far, config), config)
    assert isinstance(outcome, Rejection)
    assert outcome.reason is Reason.NO_DEPTH


def test_depth_that_stands_for_nothing_is_none(studio: Studio) -> None:
    """Some drivers write the largest float where nothing was measured."""
    frame = studio.frame(looking(), 1)
    depth_m = frame.geometry.depth_m.copy()
    depth_m[::3] = np.finfo(np.float32).max
    assert (Frame.from_depth(frame.image, depth_m, frame.camera).geometry.depth_m[::3] == 0).all()
