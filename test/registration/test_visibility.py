# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a sensor saw along its lines of sight, against surfaces in closed form."""

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from vigg_ros.acceptance.agreement import Agreement, agreement
from vigg_ros.registration import Camera
from vigg_ros.registration.geometry import DepthMap, ScanView

Array = NDArray[np.float64]

CAMERA = Camera(width_px=4, height_px=3, fx_px=2.0, fy_px=2.0, cx_px=1.5, cy_px=1.0)


def test_behind_a_depth_image() -> None:
    depth_m = np.full((3, 4), 2.0, np.float32)
    depth_m[1, 3] = 0.0
    points = np.array(
        [
            (0.0, 0, 2.5),  # half a metre behind the surface
            (0.0, 0, 1.25),  # seen through
            (1.5, 0, 2.0),  # in the pixel without depth: u = 3
            (9.0, 0, 2.0),  # beside the image
            (0.0, 0, -2.0),  # behind the camera
        ]
    )
    np.testing.assert_allclose(DepthMap(CAMERA, depth_m).behind(points), [0.5, -0.75, np.nan, np.nan, np.nan])


def directions(step_deg: float) -> Array:
    """Unit vectors all around, between 89.5 deg below and above the horizon."""
    azimuth, elevation = np.deg2rad(np.meshgrid(np.arange(-180, 180, step_deg) + 0.1, np.arange(-89.5, 89.6, step_deg)))
    level = np.cos(elevation)
    return np.stack((np.cos(azimuth) * level, np.sin(azimuth) * level, np.sin(elevation)), axis=-1).reshape(-1, 3)


def view_of(points: ArrayLike) -> ScanView:
    return ScanView.of(np.asarray(points, np.float32))


RAYS = directions(0.5)


def test_inside_a_sphere_the_distance_behind_is_that_of_the_radii() -> None:
    view = view_of(10 * RAYS)
    for radius_m in (0.5, 8.0, 10.0, 12.5):
        # Float32 ranges of 10 m are exact to a micrometre.
        np.testing.assert_allclose(view.behind(radius_m * RAYS), radius_m - 10, atol=5e-6)


def test_inside_a_box_the_distance_behind_is_that_along_the_ray() -> None:
    with np.errstate(divide="ignore"):
        ranges_m = np.asarray(((10.0, 6.0, 5.0) / np.abs(RAYS)).min(axis=1))
    view = view_of(ranges_m[:, None] * RAYS)
    for share in (0.5, 1.0, 1.4):
        behind_m = view.behind((share * ranges_m)[:, None] * RAYS)
        # Within a cell of 1 deg, seen diagonally, a range changes by 1.4 x 0.0175 x tan(incidence); the walls
        # meet the rays at 67 deg at most (in the corners): 6 % of the range.
        assert (np.abs(behind_m - (share - 1) * ranges_m) <= 0.06 * ranges_m).all()


def test_a_wall_on_one_side_says_nothing_of_the_other() -> None:
    towards = RAYS[:, 0] > 0.5
    view = view_of(10 / RAYS[towards, :1] * RAYS[towards])
    assert np.isfinite(view.behind(9 * RAYS[RAYS[:, 0] > 0.52])).all()
    assert np.isnan(view.behind(9 * RAYS[RAYS[:, 0] < 0.48])).all()
    assert np.isnan(view_of(np.empty((0, 3))).behind(RAYS)).all()


@pytest.mark.parametrize(
    ("ranges_m", "behind_m"),
    [((10.0, 11.5), (-9.0, -1.0, 0.0, 0.0, 0.0, 1.5)), ((5.0, 20.0), (np.nan,) * 6)],
    ids=["between its ranges lies the surface", "a cell with an edge says nothing"],
)
def test_two_ranges_in_a_cell(ranges_m: tuple[float, float], behind_m: tuple[float, ...]) -> None:
    ray = directions(90)[:1]
    found = view_of(np.outer(ranges_m, ray)).behind(np.outer((1.0, 9.0, 10.0, 10.7, 11.5, 13.0), ray))
    np.testing.assert_allclose(found, behind_m, atol=5e-6)


def test_the_seam_behind_and_the_poles_belong_to_the_view() -> None:
    for point in np.array([(-10, 0, 0), (-10, -0.01, 0), (-10, 0.01, 0), (0, 0, 10), (0, 0, -10)]):
        np.testing.assert_allclose(view_of([point]).behind(1.2 * point[None]), 2.0, atol=5e-6)


def test_agreement_counts_shares_of_all_points() -> None:
    behind_m = np.array([0.0, 0.1, -0.1, 0.3, -0.3, -0.4, -3.0, np.nan, np.nan, np.nan])
    shares = agreement(behind_m, np.full(10, 0.1))
    assert shares == Agreement(overlap=3 / 10, in_front=3 / 10, hidden=1 / 10)
    assert (shares.consistency, shares.conflict, shares.balance) == pytest.approx((3 / 7, 3 / 6, -0.1))
    for unseen in (np.empty(0), np.full(5, np.nan)):
        nothing = agreement(unseen, np.full(len(unseen), 0.1))
        assert nothing == Agreement(0.0, 0.0, 0.0)
        assert (nothing.consistency, nothing.conflict, nothing.balance) == (0, 0, 0)
