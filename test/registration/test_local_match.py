# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Visual-guided geometric matching: the error distribution is that of the noise, the zone as wide as it says."""

import math
from unittest.mock import Mock

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from vigg_ros.registration.geometric import Landmarks
from vigg_ros.registration.local_match import (
    LocalMatcher,
    error_distribution,
    guided_fit,
    max_zone_radius_m,
    refit,
    search_zone_m2,
)
from vigg_ros.registration.matches import Matches, no_matches
from vigg_ros.registration.options import LocalMatchConfig
from vigg_ros_testing.registration_samples import apply, errors, matches_of, motion

T_TRUE = motion((5, -10, 20), (0.2, -0.1, 0.3))


def noisy_matches(sigma_m: float, count: int, seed: int = 0) -> Matches:
    """Matches whose targets are off by Gaussian noise of sigma on each axis."""
    rng = np.random.default_rng(seed)
    source = rng.uniform(-1, 1, (count, 3))
    return matches_of(apply(T_TRUE, source) + rng.normal(0, sigma_m, source.shape), source)


def test_eq_7_and_8_by_hand() -> None:
    """Distances 0.3, 0.4 and 0 are below t = 0.5; 0.5 itself and 2 are not: sigma^2 = (0.09 + 0.16) / 3 / 3."""
    source = np.zeros((5, 3))
    target = np.array([(0.3, 0, 0), (0, 0.4, 0), (0, 0, 0), (0, 0, 0.5), (2, 0, 0)])
    found = error_distribution(matches_of(target, source), np.eye(4), 0.5)
    assert found.inliers.tolist() == [True, True, True, False, False]
    assert found.variance_m2 == pytest.approx(0.25 / 9)
    # Fewer than three are no prior.
    few = error_distribution(noisy_matches(0.01, 2), T_TRUE, 0.1)
    assert (few.variance_m2, np.count_nonzero(few.inliers)) == (math.inf, 2)


@pytest.mark.parametrize("gamma_squared", [2.0, 5.0, 10.0, 20.0])
def test_the_zone_holds_the_share_that_chi_square_says(gamma_squared: float) -> None:
    """Squared distances over sigma^2 follow chi2 with 3 degrees of freedom, so gamma^2 = 10 holds 98.1 %."""
    count = 4000
    matches = noisy_matches(0.01, count)
    zone_m2 = search_zone_m2(error_distribution(matches, T_TRUE, 0.1).variance_m2, gamma_squared)
    share = np.mean(matches.distances(T_TRUE) ** 2 <= zone_m2)
    expected = stats.chi2(3).cdf(gamma_squared)
    # Binomial, and the same again for the estimate of the variance; 4 deviations.
    assert share == pytest.approx(expected, abs=4 * math.sqrt(2 * expected * (1 - expected) / count))


def test_no_zone_is_wider_than_the_index_was_built_for() -> None:
    config = LocalMatchConfig(gamma_squared=10.0)
    # Pseudo-inliers lie within t = 0.1: sigma^2 < 0.01 / 3, radius < sqrt(10 * 0.01 / 3) = 0.18257.
    assert max_zone_radius_m(0.1, config) == pytest.approx(0.182574, abs=1e-6)
    edge = matches_of(np.tile((0.0999999, 0, 0), (9, 1)), np.zeros((9, 3)))
    widest_m2 = search_zone_m2(error_distribution(edge, np.eye(4), 0.1).variance_m2, config.gamma_squared)
    assert math.sqrt(widest_m2) == pytest.approx(max_zone_radius_m(0.1, config), rel=1e-3)
    assert math.sqrt(widest_m2) <= max_zone_radius_m(0.1, config)


def landmarks(points: NDArray[np.floating], seed: int | None = None) -> Landmarks:
    """Landmarks with random features, or all with the same one."""
    features = np.ones((len(points), 33))
    if seed is not None:
        features = np.random.default_rng(seed).normal(size=features.shape)
    features /= np.linalg.norm(features, axis=1, keepdims=True)
    return Landmarks(points.astype(np.float32), features.astype(np.float32), np.zeros(len(points)))


def test_an_empty_zone_drops_the_point() -> None:
    target = landmarks(np.array([(0, 0, 2), (1, 0, 2), (2, 0, 2)]))
    source = landmarks(np.array([(0.04, 0, 2), (1.06, 0, 2), (2, 0.049, 2), (3, 0, 2)]))
    found = LocalMatcher(target, 0.2).match(source, np.eye(4), 0.05)
    assert (found.source_row.tolist(), found.target_row.tolist()) == ([0, 2], [0, 2])
    np.testing.assert_allclose(found.target, target.points[[0, 2]], atol=1e-6)
    np.testing.assert_allclose(found.source, source.points[[0, 2]], atol=1e-6)
    np.testing.assert_allclose(found.similarity, [1, 1], atol=1e-6)


def test_the_zone_is_around_the_moved_point_and_the_feature_decides_in_it() -> None:
    rng = np.random.default_rng(0)
    source_points = rng.uniform(-1, 1, (200, 3))
    source = landmarks(source_points, seed=1)
    # Beside each moved point its own landmark at 8 cm, and one of another feature at 1 cm.
    own, other = apply(T_TRUE, source_points) + (0.08, 0, 0), apply(T_TRUE, source_points) + (0, 0.01, 0)
    points = np.concatenate((own, other)).astype(np.float32)
    strange = landmarks(source_points, seed=2)
    target = Landmarks(points, np.concatenate((source.features, strange.features)), np.zeros(len(points)))
    matcher = LocalMatcher(target, 0.2)
    wide = matcher.match(source, T_TRUE, 0.085)
    assert (wide.target_row == wide.source_row).mean() > 0.99, "a strange feature beats the own one by chance only"
    narrow = matcher.match(source, T_TRUE, 0.02)
    assert np.mean(narrow.target_row == narrow.source_row + 200) > 0.95


def test_refit_leaves_outliers_out() -> None:
    rng = np.random.default_rng(0)
    source = rng.uniform(-1, 1, (100, 3))
    target = apply(T_TRUE, source)
    target[60:] += rng.uniform(0.2, 0.5, (40, 3))
    start = motion((0, 0, 0.5), (0.02, 0, 0)) @ T_TRUE
    found = refit(matches_of(target, source), start, 0.1)
    # 60 exact matches, and none of the others within the threshold: exact.
    np.testing.assert_allclose(found, T_TRUE, atol=1e-9)
    all_of_them = refit(matches_of(target, source), start, 10.0)
    assert errors(all_of_them, T_TRUE)[1] > 0.02


def test_guided_fit_corrects_what_the_prior_left_over() -> None:
    """A prior of few and noisy matches finds the motion to centimetres; the landmarks say it to a millimetre."""
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (1500, 3))
    source, target = landmarks(points, seed=1), landmarks(apply(T_TRUE, points), seed=1)
    prior = noisy_matches(0.02, 20, seed=3)
    start = motion((0.5, 0.5, -0.5), (0.02, -0.02, 0.02)) @ T_TRUE
    config = LocalMatchConfig()
    matcher = LocalMatcher(target, max_zone_radius_m(0.1, config))
    found = guided_fit(matcher, source, prior, start, 0.1, config)
    assert errors(found, T_TRUE)[1] < 0.001 < errors(start, T_TRUE)[1]
    assert errors(found, T_TRUE)[0] < 0.1
    # Without a prior, or rounds (the paper's ablation), or where all lies on a line, the motion stays as it came.
    line = np.outer(np.linspace(0, 1, 20), (0.6, 0.8, 0))
    moved = apply(start, line)
    found = guided_fit(
        LocalMatcher(landmarks(moved), 0.2), landmarks(line), matches_of(moved, line), start, 0.1, config
    )
    np.testing.assert_array_equal(found, start)
    for matches, options in ((no_matches(), config), (prior, LocalMatchConfig(iterations=0))):
        np.testing.assert_array_equal(guided_fit(matcher, source, matches, start, 0.1, options), start)


@pytest.mark.parametrize("fixed_zone_m", [0.0, 0.2], ids=["eq. 10", "fixed"])
def test_the_zone_does_not_grow(fixed_zone_m: float) -> None:
    """The prior fits at the start to 2 mm, and after a pull aside to 3 cm; the zone stays that of the start."""
    source = landmarks(np.random.default_rng(0).uniform(-1, 1, (300, 3)))
    aside = apply(motion((0, 0, 0), (0.03, 0, 0)) @ T_TRUE, source.points)
    prior, matcher = noisy_matches(0.002, 20, seed=3), Mock()
    matcher.match.return_value = matches_of(aside, source.points)
    config = LocalMatchConfig(fixed_zone_m=fixed_zone_m)
    guided_fit(matcher, source, prior, T_TRUE, 0.1, config)
    radius_m = fixed_zone_m or math.sqrt(10 * error_distribution(prior, T_TRUE, 0.1).variance_m2)
    assert [call.args[2] for call in matcher.match.call_args_list] == pytest.approx([radius_m] * 3)
    assert radius_m <= max_zone_radius_m(0.1, config)
