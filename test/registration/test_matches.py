# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Matched points travel together."""

from dataclasses import fields

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
