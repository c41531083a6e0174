# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Lines of sight of a scanner, against surfaces around it in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from vigg_ros.acceptance.agreement import Agreement, agreement
from vigg_ros.registration.visibility import ScanView

Array = NDArray[np.float64]


def directions(step_deg: float) -> Array:
    """Unit vectors all around, between 89.5 deg below and above the horizon."""
    azimuth, elevation = np.deg2rad(
        np.meshgrid(np.arange(-180, 180, step_deg) + 0.1, np.arange(-89.5, 89.6, step_deg))
    )
    level = np.cos(elevation)
    return np.stack((np.cos(azimuth) * level, np.sin(azimuth) * level, np.sin(elevation)), axis=-1).reshape(-1, 3)


def view_of(points: Array) -> ScanView:
    return ScanView.of(points.astype(np.float32))


def box_ranges(rays: Array, half_size_m: tuple[float, float, float]) -> Array:
    """How far the walls of a box around the scanner are along unit rays (N, 3)."""
    with np.errstate(divide="ignore"):
        return np.asarray((np.asarray(half_size_m) / np.abs(rays)).min(axis=1))


def test_inside_a_sphere_the_distance_behind_is_that_of_the_radii() -> None:
    rays = directions(0.5)
    view = view_of(10 * rays)
    for radius_m in (0.5, 8.0, 10.0, 12.5):
        # Float32 ranges of 10 m are exact to a micrometre.
        np.testing.assert_allclose(view.behind(radius_m * rays), radius_m - 10, atol=5e-6)


def test_inside_a_box_the_distance_behind_is_that_along_the_ray() -> None:
    rays = directions(0.5)
    ranges_m = box_ranges(rays, (10.0, 6.0, 5.0))
    view = view_of(ranges_m[:, None] * rays)
    for share in (0.5, 1.0, 1.4):
        behind = view.behind((share * ranges_m)[:, None] * rays)
        # Within a cell of 1 deg, seen diagonally, a range changes by 1.4 x 0.0175 x tan(incidence); the walls
        # meet the rays at 67 deg at most (in the corners): 6 % of the range.
        assert (np.abs(behind - (share - 1) * ranges_m) <= 0.06 * ranges_m).all()


def test_a_wall_on_one_side_says_nothing_of_the_other() -> None:
    rays = directions(0.5)
    towards = rays[:, 0] > 0.5
    view = view_of(10 / rays[towards, :1] * rays[towards])
    assert np.isfinite(view.behind(9 * rays[rays[:, 0] > 0.52])).all()
    assert np.isnan(view.behind(9 * rays[rays[:, 0] < 0.48])).all()


def test_between_the_ranges_of_a_cell_lies_its_surface() -> None:
    ray = directions(90)[:1]
    view = view_of(np.vstack((10.0 * ray, 11.5 * ray)))
    behind = view.behind(np.array([[9.0], [10.0], [10.7], [11.5], [13.0]]) * ray)
    np.testing.assert_allclose(behind, (-1.0, 0.0, 0.0, 0.0, 1.5), atol=5e-6)


def test_a_cell_with_an_edge_in_it_says_nothing() -> None:
    ray = directions(90)[:1]
    view = view_of(np.vstack((5.0 * ray, 20.0 * ray)))
    assert np.isnan(view.behind(np.array([[1.0], [5.0], [20.0], [30.0]]) * ray)).all()


def test_where_nothing_was_measured_there_is_neither_surface_nor_free_space() -> None:
    view = view_of(np.empty((0, 3)))
    assert np.isnan(view.behind(directions(10))).all()


@pytest.mark.parametrize("point", [(-10, 0, 0), (-10, -0.01, 0), (-10, 0.01, 0), (0, 0, 10), (0, 0, -10)])
def test_the_seam_behind_and_the_poles_belong_to_the_view(point: tuple[float, float, float]) -> None:
    at = np.array([point], float)
    np.testing.assert_allclose(view_of(at).behind(1.2 * at), 2.0, atol=5e-6)


def test_agreement_counts_shares_of_all_points_and_nan_for_nothing() -> None:
    behind_m = np.array([0.0, 0.05, -0.05, -3.0, 2.0, 2.0, np.nan, np.nan])
    shares = agreement(behind_m, np.full(8, 0.1))
    assert shares == Agreement(overlap=3 / 8, in_front=1 / 8, hidden=2 / 8)
    assert shares.consistency == 3 / 6
    assert shares.conflict == 1 / 4
    assert shares.balance == 0


def test_without_points_nothing_agrees_or_contradicts() -> None:
    nothing = agreement(np.empty(0), np.empty(0))
    assert nothing == Agreement(0.0, 0.0, 0.0)
    assert (nothing.consistency, nothing.conflict) == (0.0, 0.0)
