# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Surfaces, landmarks and global matches."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vigg_ros.registration import Config, extract
from vigg_ros.registration.geometric import (
    GLOBAL_MATCHES,
    Landmarks,
    build_landmarks,
    build_patches,
    build_surface,
    match_global,
    salient,
    sample,
)
from vigg_ros.registration.options import GeometricConfig
from vigg_ros_testing.registration_samples import Studio, apply, looking, motion

CONFIG = GeometricConfig()


def sphere(radius_m: float, centre: tuple[float, float, float] = (0, 0, 3), count: int = 60000) -> NDArray[np.float32]:
    """The side of a ball that is turned to the sensor at the origin."""
    rng = np.random.default_rng(0)
    outwards = rng.normal(size=(count, 3))
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    points = np.asarray(centre) + radius_m * outwards
    return points[np.einsum("ni,ni->n", points, outwards) < 0].astype(np.float32)


def test_a_surface_has_one_point_a_voxel_with_its_normal_towards_the_sensor() -> None:
    surface = build_surface(sphere(0.5), CONFIG)
    # Voxels of 2.5 cm on less than half of a ball of 0.5 m: a cube of side a meets a^2 of surface 1.5 times.
    area_m2 = 2 * np.pi * 0.5**2 * (1 - 0.5 / 3)
    assert len(surface) == pytest.approx(1.5 * area_m2 / 0.025**2, rel=0.1)
    outwards = (surface.points - np.float32([0, 0, 3])) / np.linalg.norm(surface.points - (0, 0, 3), axis=1)[:, None]
    cosine = np.einsum("ni,ni->n", surface.normals, outwards)
    assert np.median(cosine) > 0.999
    # At the rim patches of 5 cm are cut off; nowhere does a normal turn its back.
    assert (np.einsum("ni,ni->n", surface.normals, surface.points) <= 0).all()
    np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=1), 1, atol=1e-5)


@pytest.mark.parametrize(("near", "far", "kept"), [(0.0, 8.0, "both"), (2.0, 8.0, "far"), (0.0, 2.0, "near")])
def test_points_out_of_range_are_dropped(near: float, far: float, kept: str) -> None:
    points = np.concatenate((sphere(0.3, (0, 0, 1.5)), sphere(0.3, (0, 0, 4))))
    config = GeometricConfig(min_range_m=near, max_range_m=far)
    z = build_surface(points, config).points[:, 2]
    assert {"near": (z < 2).all(), "far": (z > 3).all(), "both": (z < 2).any() and (z > 3).any()}[kept]


def test_keypoints_out_of_range_do_not_count_either(studio: Studio) -> None:
    features = extract(studio.frame(looking(), 1), Config().replace({"geometric.max_range_m": 2.5}))
    assert 0 < len(features.keypoints) < len(studio.features(looking(), 1).keypoints)
    assert np.linalg.norm(features.keypoints.points, axis=1).max() <= 2.5
    assert np.linalg.norm(features.surface.points, axis=1).max() <= 2.5 + 1e-3


@pytest.mark.parametrize(
    "points",
    [*(sphere(0.5)[:count] for count in (0, 1, 3)), np.mgrid[1:6, 1:6, 1:6].reshape(3, -1).T.astype(np.float32)],
    ids=["none", "one", "three", "a metre apart"],
)
def test_what_is_no_surface_has_neither_points_nor_landmarks(points: NDArray[np.float32]) -> None:
    surface = build_surface(points, CONFIG)
    assert len(surface) == len(build_landmarks(surface, CONFIG)) == 0


def test_landmarks_are_fewer_than_the_surface_and_describe_it() -> None:
    surface = build_surface(sphere(0.5), CONFIG)
    landmarks = build_landmarks(build_patches(surface, CONFIG), CONFIG)
    # A grid of two voxels, in two dimensions of a surface.
    assert len(landmarks) == pytest.approx(len(surface) / 4, rel=0.15)
    np.testing.assert_allclose(np.linalg.norm(landmarks.features, axis=1), 1, atol=1e-5)
    # One place of a ball is like the next: away from the rim all features agree.
    inner = np.linalg.norm(landmarks.points[:, :2], axis=1) < 0.1
    assert inner.sum() > 5
    assert (landmarks.features[inner] @ landmarks.features[inner].mean(axis=0)).min() > 0.98


def test_sampling_is_without_replacement_and_the_same_for_a_seed() -> None:
    rows = sample(1000, 100, 7)
    assert len(set(rows.tolist())) == 100
    assert (np.diff(rows) > 0).all()
    np.testing.assert_array_equal(rows, sample(1000, 100, 7))
    assert not np.array_equal(rows, sample(1000, 100, 8))
    np.testing.assert_array_equal(sample(50, 100, 7), np.arange(50))


def landmarks_of(features: NDArray[np.floating], first: int = 0) -> Landmarks:
    """Landmarks whose points say which they are."""
    n = first + np.arange(len(features), dtype=np.float32)
    points = np.column_stack((n, n, n))
    unit = features / np.linalg.norm(features, axis=1, keepdims=True)
    return Landmarks(points, unit.astype(np.float32), np.zeros(len(points)))


def test_mutual_matches_are_those_of_all_pairs() -> None:
    rng = np.random.default_rng(0)
    target, source = landmarks_of(rng.normal(size=(900, 33))), landmarks_of(rng.normal(size=(1100, 33)))
    cosine = source.features @ target.features.T
    forward, backward = cosine.argmax(axis=1), cosine.argmax(axis=0)
    expected = {(int(forward[i]), i) for i in range(1100) if backward[forward[i]] == i}
    assert 100 < len(expected) < GLOBAL_MATCHES
    found = match_global(target, source, CONFIG)
    assert set(zip(found.target_row.tolist(), found.source_row.tolist(), strict=True)) == expected
    np.testing.assert_allclose(found.similarity, cosine[found.source_row, found.target_row], atol=1e-6)
    assert (np.diff(found.similarity) <= 0).all(), "the most similar first"
    np.testing.assert_array_equal(found.source, source.points[found.source_row])
    np.testing.assert_array_equal(found.target, target.points[found.target_row])


def test_matches_in_one_direction_are_sampled() -> None:
    rng = np.random.default_rng(0)
    target, source = landmarks_of(rng.normal(size=(300, 33))), landmarks_of(rng.normal(size=(900, 33)))
    config = GeometricConfig(mutual=False, sample_k=200)
    found = match_global(target, source, config, seed=3)
    assert len(found) == 200
    np.testing.assert_array_equal(found.source_row, sample(900, 200, 3))
    nearest = (source.features[found.source_row] @ target.features.T).argmax(axis=1)
    np.testing.assert_array_equal(found.target_row, nearest)


@pytest.mark.parametrize(("targets", "sources"), [(0, 5), (5, 0), (0, 0)])
def test_no_landmarks_have_no_matches(targets: int, sources: int) -> None:
    features = np.random.default_rng(0).normal(size=(5, 33))
    empty = match_global(landmarks_of(features[:targets]), landmarks_of(features[:sources]), CONFIG)
    assert (len(empty), empty.target.shape) == (0, (0, 3))


def test_salient_landmarks_are_those_least_like_all() -> None:
    """5,000 alike, 100 others: the others are among the 4,000 that take part."""
    rng = np.random.default_rng(0)
    features = np.zeros((5100, 33))
    features[:, 0] = 1
    others = rng.permutation(5100)[:100]
    features[others] = rng.normal(size=(100, 33))
    features += rng.normal(0, 0.01, features.shape)
    chosen = salient(landmarks_of(features).features)
    assert len(set(chosen.tolist())) == 4000
    assert set(others.tolist()) <= set(chosen.tolist())
    assert (np.diff(chosen) > 0).all()


def test_features_do_not_change_with_the_view(studio: Studio) -> None:
    """The same surface, turned and shifted, has the same features to the grid's accuracy."""
    surface = build_surface(studio.frame(looking()).points(), CONFIG)
    landmarks = build_landmarks(surface, CONFIG)
    turned = motion((0, 0, 90), (0, 0, 0))
    points = apply(turned, surface.points).astype(np.float32)
    normals = apply(turned, surface.normals).astype(np.float32)
    other = build_landmarks(type(surface)(points, normals), CONFIG)
    # A quarter turn about the view maps the grid to itself, and each landmark to one of the other set.
    distance_m, partner = cKDTree(other.points).query(apply(turned, landmarks.points))
    same = distance_m < 1e-3
    assert same.mean() > 0.8
    cosine = np.einsum("ni,ni->n", landmarks.features[same], other.features[partner[same]])
    assert np.median(cosine) > 0.999
