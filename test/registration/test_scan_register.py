# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scans of a rendered street, and of a real road, registered against what is known of their motion."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vigg_ros.acceptance.agreement import Pair, assess
from vigg_ros.acceptance.limits import MAX_CONFLICT
from vigg_ros.bench.worlds import STREET_DRIVE, Scene
from vigg_ros.bench.worlds.patterns import asphalt
from vigg_ros.bench.worlds.poses import Pose, flat
from vigg_ros.bench.worlds.surfaces import Rectangle
from vigg_ros.bench.worlds.texture import Texture
from vigg_ros.registration import Camera, Config, Frame, Registration, Rejection, extract, register
from vigg_ros.registration.features import Features
from vigg_ros.registration.geometric import build_surface
from vigg_ros.registration.matches import no_matches
from vigg_ros.registration.rigid import inverse
from vigg_ros_testing.street_samples import (
    CAMERA,
    CONFIG,
    T_CAMERA_LIDAR,
    a_street,
    along,
    errors,
    features_along,
    frame_along,
    is_wrong,
    lidar_motion,
    rigid_frame,
)

KITTI = Path(__file__).parents[3] / "shared" / "data" / "kitti_04"

MAX_TRANSLATION_M, MAX_ROTATION_DEG = 0.02, 0.1
"""One range is good for 2 cm, and thousands of them decide; beams are 1.3 deg apart, and 0.1 deg is 2 cm at 11 m."""


@cache
def features_in_turn(time_s: float) -> Features:
    T_world_base = STREET_DRIVE.T_world_vehicle(time_s)
    return extract(rigid_frame(T_world_base, seed=round(10 * time_s)), CONFIG)


def assert_registered(target: Features, source: Features, T_true: NDArray[np.float64]) -> Registration:
    outcome = register(target, source, CONFIG)
    assert isinstance(outcome, Registration), outcome
    translation_m, rotation_deg = errors(outcome.T_target_source, T_true)
    assert translation_m < MAX_TRANSLATION_M
    assert rotation_deg < MAX_ROTATION_DEG
    return outcome


def test_the_preset_has_the_lengths_of_the_paper() -> None:
    assert CONFIG.geometric.voxel_size_m == 0.3
    assert CONFIG.cliques.inlier_threshold_m == 0.6
    assert CONFIG.geometric.sample_k == 10_000
    assert CONFIG.visual.top_k == 300
    # What is counted in voxels follows: a preset that sets it apart would part the two scales.
    rgbd = Config.preset("rgbd").geometric
    for name in ("feature_grid_voxels", "normal_radius_voxels", "feature_radius_voxels"):
        assert getattr(CONFIG.geometric, name) == getattr(rgbd, name)


def test_returns_from_the_car_itself_and_from_far_away_are_no_surface() -> None:
    rng = np.random.default_rng(2)
    around = rng.normal(size=(3000, 3))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    roof, street, sky = 2.45 * around, 2.55 * around, 81 * around
    cloud = np.vstack((roof, street, sky)).astype(np.float32)
    surface = build_surface(cloud, CONFIG.geometric)
    alone = build_surface(street.astype(np.float32), CONFIG.geometric)
    np.testing.assert_array_equal(surface.points, alone.points)
    assert len(alone) > 100


STRAIGHT = [(-10.0, -8.0), (0.0, 4.0), (4.0, 10.0), (0.0, 10.0), (-10.0, 0.0)]


@pytest.mark.parametrize(("target_m", "source_m"), STRAIGHT)
def test_driving_straight(target_m: float, source_m: float) -> None:
    T_true = lidar_motion(along(target_m), along(source_m))
    assert_registered(features_along(target_m), features_along(source_m), T_true)


TURNING = [(1.8, 2.2), (2.2, 2.6), (2.2, 3.0), (1.8, 3.0)]


def turn_motion(target_s: float, source_s: float) -> NDArray[np.float64]:
    return lidar_motion(STREET_DRIVE.T_world_vehicle(target_s), STREET_DRIVE.T_world_vehicle(source_s))


@pytest.mark.parametrize(("target_s", "source_s"), TURNING)
def test_turning_left(target_s: float, source_s: float) -> None:
    """By 10 to 49 deg within 2.4 to 7 m; the widest pair shares next to nothing of its images."""
    assert_registered(features_in_turn(target_s), features_in_turn(source_s), turn_motion(target_s, source_s))


def normalised_error(outcome: Registration, T_true: NDArray[np.float64]) -> float:
    """Squared Mahalanobis distance of the six errors, as the covariance of ``Registration`` orders them."""
    T_found = outcome.T_target_source
    turned = Rotation.from_matrix(T_found[:3, :3] @ T_true[:3, :3].T).as_rotvec()
    error = np.concatenate((T_found[:3, 3] - T_true[:3, 3], turned))
    return float(error @ np.linalg.solve(outcome.covariance, error))


def test_errors_are_those_that_the_covariance_expects() -> None:
    pairs = [(features_along(a), features_along(b), lidar_motion(along(a), along(b))) for a, b in STRAIGHT]
    pairs += [(features_in_turn(a), features_in_turn(b), turn_motion(a, b)) for a, b in TURNING]
    squared = [normalised_error(assert_registered(*pair), pair[2]) for pair in pairs]
    # Of chi-square with 9 x 6 degrees of freedom 99.9 % lie below 91. It may be too cautious, by a factor of
    # three in the deviations at most: then the sum is 54 / 9.
    assert 54 / 9 < sum(squared) < 91


def test_swapping_target_and_source_inverts_the_motion() -> None:
    target, source = features_in_turn(1.8), features_in_turn(2.2)
    forward, backward = register(target, source, CONFIG), register(source, target, CONFIG)
    assert isinstance(forward, Registration)
    assert isinstance(backward, Registration)
    # The scans sample each other's surfaces differently: a quarter of what either may be off.
    translation_m, rotation_deg = errors(backward.T_target_source, inverse(forward.T_target_source))
    assert translation_m < MAX_TRANSLATION_M / 4
    assert rotation_deg < MAX_ROTATION_DEG / 4


def test_the_same_scans_give_the_same_bytes() -> None:
    first, again = (register(features_along(-10.0), features_along(0.0), CONFIG) for _ in range(2))
    assert isinstance(first, Registration)
    assert isinstance(again, Registration)
    assert first.T_target_source.tobytes() == again.T_target_source.tobytes()
    assert first.covariance.tobytes() == again.covariance.tobytes()


@pytest.mark.parametrize(
    ("target_m", "source_m"),
    [(-30.0, -10.0), (-20.0, 0.0), (-10.0, 10.0), (-30.0, -8.0), (-20.0, 4.0), (10.0, -10.0)],
)
@pytest.mark.hostile("Scene: LiDAR rings on flat ground that look like no motion at all")
def test_twenty_metres_along_a_flat_street_are_never_taken_for_none(target_m: float, source_m: float) -> None:
    """Rings on the ground look alike from everywhere; at this distance most of the rest hides or changes."""
    outcome = register(features_along(target_m), features_along(source_m), CONFIG)
    assert not is_wrong(outcome, lidar_motion(along(target_m), along(source_m)))


@pytest.mark.parametrize(("target_m", "source_m"), [(-30.0, -10.0), (-20.0, 0.0), (-10.0, 10.0)])
def test_free_space_tells_no_motion_from_twenty_metres(target_m: float, source_m: float) -> None:
    """The reason behind the test above: overlap and what is hidden are about the same for both."""
    target, source = features_along(target_m), features_along(source_m)
    pair = Pair(target, source, no_matches(), no_matches(), CONFIG)
    right = assess(pair, lidar_motion(along(target_m), along(source_m))).agreement
    wrong = assess(pair, np.eye(4)).agreement
    assert right.overlap < 1.5 * wrong.overlap
    # Well to either side of the bound, so that noise does not decide.
    assert right.conflict < MAX_CONFLICT.value / 1.5
    assert wrong.conflict > MAX_CONFLICT.value * 1.5


def plain(paint: Texture) -> Scene:
    """Nothing but ground."""
    return Scene((Rectangle(flat((10, 15, 0)), (120, 110), paint),), a_street().light, (235, 215, 190))


def test_an_empty_plain_without_texture_is_refused() -> None:
    grey = plain(Texture.of(np.full((16, 16, 3), 128, np.uint8), texel_m=10.0))
    target, source = (extract(rigid_frame(along(x), seed=int(x), scene=grey), CONFIG) for x in (0.0, 5.0))
    assert isinstance(register(target, source, CONFIG), Rejection)


@pytest.mark.hostile("Scene: LiDAR rings on flat ground that look like no motion at all")
@pytest.mark.parametrize(
    ("apart_m", "noise"), [(0.6, 10), (1.0, 10), (2.0, 10), (4.0, 10), (2.0, 9), (4.0, 9), (8.0, 9), (20.0, 9)]
)
def test_an_empty_plain_is_answered_by_its_texture_or_not_at_all(apart_m: float, noise: int) -> None:
    """Rings on a plain are where they were, whatever the motion; with the same noise (9) to the last bit."""
    road = plain(asphalt(np.random.default_rng(3), (120, 110)))
    target = extract(rigid_frame(along(0.0), seed=9, scene=road), CONFIG)
    outcome = register(target, extract(rigid_frame(along(apart_m), seed=noise, scene=road), CONFIG), CONFIG)
    assert not is_wrong(outcome, lidar_motion(along(0.0), along(apart_m)))


def test_a_view_clipped_to_the_camera_still_answers() -> None:
    """The paper's unified field of view: less surface, so three times the error is allowed."""
    clipped = []
    for frame in (frame_along(0.0), frame_along(4.0)):
        seen = Frame.from_points(frame.image, frame.points(), CAMERA, T_CAMERA_LIDAR, within_view=True)
        assert len(seen.points()) < 0.4 * len(frame.points())
        clipped.append(extract(seen, CONFIG))
    outcome = register(clipped[0], clipped[1], CONFIG)
    assert isinstance(outcome, Registration)
    translation_m, rotation_deg = errors(outcome.T_target_source, lidar_motion(along(0.0), along(4.0)))
    assert translation_m < 3 * MAX_TRANSLATION_M
    assert rotation_deg < 3 * MAX_ROTATION_DEG


@cache
def kitti_features(index: int) -> Features:
    rows = dict(line.split(":") for line in (KITTI / "calib.txt").read_text().splitlines())
    P_camera2, T_velodyne = (np.array(rows[name].split(), float).reshape(3, 4) for name in ("P2", "Tr"))
    T_camera2_camera0, T_camera0_points = np.eye(4), np.eye(4)
    T_camera2_camera0[:3, 3] = np.linalg.solve(P_camera2[:, :3], P_camera2[:, 3])
    T_camera0_points[:3] = T_velodyne
    image = cv2.imread(str(KITTI / "image_2" / f"{index:06d}.png"))
    height_px, width_px = image.shape[:2]
    camera = Camera(width_px, height_px, *P_camera2[(0, 1, 0, 1), (0, 1, 2, 2)])
    points = np.fromfile(KITTI / "velodyne" / f"{index:06d}.bin", np.float32).reshape(-1, 4)[:, :3]
    return extract(Frame.from_points(image, points, camera, T_camera2_camera0 @ T_camera0_points), CONFIG)


def kitti_pair(target: int, source: int) -> Pose:
    for row in np.loadtxt(KITTI / "refined_pairs.txt"):
        if (row[0], row[1]) == (target, source):
            return np.asarray(row[2:].reshape(4, 4))
    raise LookupError((target, source))


@pytest.mark.skipif(not KITTI.is_dir(), reason=f"no data folder {KITTI.parent.name}/{KITTI.name} beside the project")
@pytest.mark.parametrize(("target", "source", "bound_m"), [(12, 4, 0.022), (16, 4, 0.03), (20, 4, 0.04)])
def test_a_real_road(target: int, source: int, bound_m: float) -> None:
    """Gaps of 8, 12 and 16 frames: 11, 17 and 22 m.

    The reference was refined by GICP at 0.3 m, which is good for about a centimetre itself; 2.2 cm and
    0.06 deg are what is asked for at the first gap, and less surface is left at the others.
    """
    outcome = register(kitti_features(target), kitti_features(source), CONFIG)
    assert isinstance(outcome, Registration), outcome
    translation_m, rotation_deg = errors(outcome.T_target_source, kitti_pair(target, source))
    assert translation_m < bound_m
    assert rotation_deg < 0.06
