# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Matched points travel together."""

from dataclasses import fields, replace

import numpy as np
import pytest

from vigg_ros.registration.matches import Matches, concatenate, no_matches
from vigg_ros_testing.registration_samples import matches_of, motion


def numbered(*numbers: int) -> Matches:
    """Matches whose every entry says which match it belongs to."""
    n = np.array(numbers, int)
    points = np.tile(n[:, None], 3)
    return Matches(points + 0.1, points + 0.2, n / 100, n + 1000, n + 2000, n / 1000)


def assert_numbered(matches: Matches, *numbers: int) -> None:
    for field in fields(Matches):
        np.testing.assert_array_equal(getattr(matches, field.name), getattr(numbered(*numbers), field.name))


@pytest.mark.parametrize(
    ("rows", "kept"),
    [
        (np.array([True, False, True, False]), [5, 7]),
        (np.array([3, 0, 0]), [8, 5, 5]),
        (slice(1, 3), [6, 7]),
        (np.zeros(4, bool), []),
    ],
    ids=["mask", "rows", "slice", "none"],
)
def test_select_keeps_all_arrays_together(rows: np.ndarray | slice, kept: list[int]) -> None:
    assert_numbered(numbered(5, 6, 7, 8).select(rows), *kept)


def test_concatenate_appends() -> None:
    assert_numbered(concatenate(numbered(1, 2), numbered(7)), 1, 2, 7)
    assert_numbered(concatenate(no_matches(), numbered(7)), 7)
    assert len(no_matches()) == 0


def test_distances_by_hand() -> None:
    points = np.array([(0, 0, 0), (1, 1, 1)], float)
    matches = matches_of(points, points)
    # A shift by (3, 4, 0); and with a quarter turn about z, (1, 1, 1) goes to (-1, 1, 1), 2 m off.
    np.testing.assert_allclose(matches.distances(motion((0, 0, 0), (3, 4, 0))), [5, 5])
    np.testing.assert_allclose(matches.distances(motion((0, 0, 90), (0, 0, 0))), [0, 2], atol=1e-12)


def radii(distance_m: float, sigma_m: float, threshold_m: float = 0.1) -> float:
    """Of a match so far away, seen from the target a metre nearer than from the source."""
    target, source = np.array([(0, 0, distance_m)]), np.array([(0, 0, distance_m + 1)])
    (radius_m,) = replace(matches_of(target, source), sigma_m=np.array([sigma_m])).radii_m(threshold_m)
    return float(radius_m)


@pytest.mark.parametrize(
    ("distance_m", "sigma_m", "radius_m"),
    [
        (0.4, 0.001, np.hypot(0.02, 0.003)),  # close: a twentieth of the distance
        (2.0, 0.001, np.hypot(0.1, 0.003)),
        (5.0, 0.05, np.hypot(0.1, 0.15)),  # three standard deviations
        (9.0, 0.5, 0.3),  # never more than three thresholds
        (0.4, 0.0, 0.1),  # without noise it is the paper's
    ],
)
def test_how_far_the_points_of_a_match_may_lie_apart(distance_m: float, sigma_m: float, radius_m: float) -> None:
    assert radii(distance_m, sigma_m) == pytest.approx(radius_m)


def test_matches_agree_within_their_own_radius() -> None:
    """Both 15 cm off: the noisy one may be, the sure one not."""
    points = np.array([(0, 0, 4.0), (0, 0, 4.0)])
    matches = replace(matches_of(points + (0.15, 0, 0), points), sigma_m=np.array([0.05, 0.005]))
    np.testing.assert_array_equal(matches.agree(np.eye(4), 0.1), [True, False])
    assert no_matches().agree(np.eye(4), 0.1).shape == (0,)
