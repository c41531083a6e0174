# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a sensor saw along its lines of sight, in views made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from vigg_ros.acceptance.agreement import agreement
from vigg_ros.registration import Camera
from vigg_ros.registration.visibility import DepthView, ScanView

CAMERA = Camera(width_px=4, height_px=3, fx_px=2.0, fy_px=2.0, cx_px=1.5, cy_px=1.0)


def test_behind_a_depth_image() -> None:
    depth_m = np.full((3, 4), 2.0, np.float32)
    depth_m[1, 3] = 0.0
    view = DepthView(CAMERA, depth_m)
    points = np.array(
        [
            (0.0, 0, 2.5),  # half a metre behind the surface
            (0.0, 0, 1.25),  # seen through
            (1.5, 0, 2.0),  # in the pixel without depth: u = 3
            (9.0, 0, 2.0),  # beside the image
            (0.0, 0, -2.0),  # behind the camera
        ]
    )
    np.testing.assert_allclose(view.behind(points), [0.5, -0.75, np.nan, np.nan, np.nan])


def test_behind_a_scan() -> None:
    """Ahead one wall at 10 m; to the left an edge, 5 and 9 m in one cell; nowhere else anything."""
    view = ScanView.of(np.array([(10, 0, 0), (10.2, 0, 0), (0, 5, 0), (0, 9, 0)], np.float32))
    points = np.array(
        [
            (12.0, 0.05, 0.05),  # behind the wall
            (7.0, 0.05, 0.05),  # before it
            (10.1, 0.05, 0.05),  # on it
            (0.05, 7.0, 0.05),  # the edge says nothing
            (-6.0, 0.0, 0.0),  # nothing was measured there
            (0.0, 0.0, 4.0),
        ]
    )
    np.testing.assert_allclose(view.behind(points), [1.8, -3.0, 0, np.nan, np.nan, np.nan], atol=2e-3)


def test_agreement_counts_shares_of_all_points() -> None:
    behind_m = np.array([0.0, 0.1, -0.1, 0.3, -0.3, -0.4, np.nan, np.nan, np.nan, np.nan])
    shares = agreement(behind_m, np.full(10, 0.1))
    assert (shares.overlap, shares.in_front, shares.hidden) == pytest.approx((0.3, 0.2, 0.1))
    assert shares.consistency == pytest.approx(0.3 / 0.6)
    assert shares.conflict == pytest.approx(0.2 / 0.5)
    assert shares.balance == pytest.approx(0.0)


def test_nothing_seen_is_no_agreement() -> None:
    for behind_m in (np.empty(0), np.full(5, np.nan)):
        shares = agreement(behind_m, np.full(len(behind_m), 0.1))
        assert (shares.overlap, shares.consistency, shares.conflict, shares.balance) == (0, 0, 0, 0)
