# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of motions and pairs of frames, worked out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given

from vigg_ros.report.trajectory_errors import (
    Spread,
    neighbours,
    one_second_apart,
    rotation_error_deg,
    translation_error_m,
)
from vigg_ros_testing.trajectory_samples import SECOND, motions, pose, winding


@pytest.mark.parametrize("angle_deg", [1e-9, 0.5, 30.0, 90.0, 179.999, 180.0])
def test_the_rotation_error_is_the_angle_between(angle_deg):
    T_a, T_b = pose(1, 2, 3, yaw_deg=20), pose(yaw_deg=20 + angle_deg)
    # 1e-13 deg is the last digit of an angle of 20 deg.
    assert rotation_error_deg(T_a, T_b) == pytest.approx(angle_deg, abs=1e-13, rel=1e-9)


def test_equal_motions_have_no_error():
    T = winding(3)[2]
    assert rotation_error_deg(T, T) < 1e-13
    assert translation_error_m(T, T) == 0


def test_the_translation_error_is_the_distance():
    assert translation_error_m(pose(1, 1, 1, yaw_deg=70), pose(4, 5, 1)) == 5


@given(motions(), motions(), motions())
def test_errors_of_motions_do_not_depend_on_the_world_nor_on_the_order(T_a, T_b, T_world):
    rotation, translation = rotation_error_deg(T_a, T_b), translation_error_m(T_a, T_b)
    assert rotation_error_deg(T_b, T_a) == pytest.approx(rotation, abs=1e-9)
    assert rotation_error_deg(T_world @ T_a, T_world @ T_b) == pytest.approx(rotation, abs=1e-5)
    assert translation_error_m(T_world @ T_a, T_world @ T_b) == pytest.approx(translation, abs=1e-9)


def test_a_spread_holds_median_p95_maximum_and_rmse():
    spread = Spread.of(np.arange(101.0))
    assert (spread.count, spread.median, spread.p95, spread.maximum) == (101, 50, 95, 100)
    # Mean of the squares 0..100: 100 * 101 * 201 / 6 / 101.
    assert spread.rmse == pytest.approx(math.sqrt(3350))


def test_no_values_have_no_spread():
    spread = Spread.of(np.empty(0))
    assert spread.count == 0
    assert math.isnan(spread.median)
    assert math.isnan(spread.rmse)


def test_neighbours_are_frames_between_which_nothing_is_missing():
    known = np.array([True, True, False, True, False, True, True, True])
    # Rows among the known ones: 0 1 . 2 . 3 4 5
    assert neighbours(known).tolist() == [[0, 1], [3, 4], [4, 5]]


def test_one_second_later_is_the_nearest_frame_within_a_tenth():
    stamps_ns = np.array([0, 400, 990, 1020, 1450, 2800]) * 1_000_000
    # 0 -> 990, 400 -> 1450; 990 and 1020 have nothing near 1990 and 2020, 1450 nothing near 2450.
    assert one_second_apart(stamps_ns).tolist() == [[0, 2], [1, 4]]
    assert one_second_apart(np.array([0, 900_000_000, 1_200_000_000])).tolist() == [[0, 1]]
    assert one_second_apart(np.array([0, 899_999_999, 1_200_000_000])).size == 0


def test_the_last_second_of_a_path_has_no_partner():
    assert one_second_apart(np.arange(12) * SECOND // 10).tolist() == [[0, 10], [1, 11]]
    assert one_second_apart(np.array([0, 950_000_000])).size == 0
