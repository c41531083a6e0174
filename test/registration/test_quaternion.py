# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rotations, quaternions, and what passes for a rigid transform. See test_message_refusals.py too."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vigg_ros.bench.datasets.number_files import nearest_rigid
from vigg_ros.registration.errors import DataError
from vigg_ros.registration.rigid import (
    is_rigid,
    quaternions_from_rotations,
    rigid_from_quaternion,
    rotation_from_quaternion,
)
from vigg_ros_testing.registration_samples import random_motion

ANGLES = st.floats(-math.pi, math.pi)


@given(ANGLES, ANGLES, ANGLES)
def test_quaternions_are_those_of_scipy(x: float, y: float, z: float) -> None:
    R = Rotation.from_rotvec((x, y, z)).as_matrix()
    q = quaternions_from_rotations(R[None])[0]
    expected = Rotation.from_matrix(R).as_quat()
    assert min(np.abs(q - expected).max(), np.abs(q + expected).max()) < 1e-12
    assert q[3] >= 0
    assert abs(np.linalg.norm(q) - 1) < 1e-15
    np.testing.assert_allclose(rotation_from_quaternion(*q), R, atol=1e-15)


@pytest.mark.parametrize("axis", [(1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0), (0.6, 0.8, 0), (-0.6, 0, 0.8)])
@pytest.mark.parametrize("short_of_half_turn", [0.0, 1e-12, 1e-9, 1e-6])
def test_half_turns_keep_their_digits(axis: tuple[float, ...], short_of_half_turn: float) -> None:
    R = Rotation.from_rotvec(np.array(axis) * (math.pi - short_of_half_turn)).as_matrix()
    np.testing.assert_allclose(rotation_from_quaternion(*quaternions_from_rotations(R[None])[0]), R, atol=1e-15)


@pytest.mark.parametrize(
    ("position_m", "quaternion", "code"),
    [
        ((math.nan, 0, 0), (0, 0, 0, 1), "BAD_POSITION"),
        ((0, 0, math.inf), (0, 0, 0, 1), "BAD_POSITION"),
        ((0, 0, 0), (0, 0, 0, 0), "BAD_QUATERNION"),
        ((0, 0, 0), (0, math.nan, 0, 1), "BAD_QUATERNION"),
    ],
)
def test_what_is_no_pose_is_refused(position_m: tuple[float, ...], quaternion: tuple[float, ...], code: str) -> None:
    with pytest.raises(DataError) as caught:
        rigid_from_quaternion(position_m, quaternion)
    assert caught.value.code == code


@pytest.mark.parametrize("seed", range(20))
def test_a_transform_written_with_three_digits_is_rigid_and_stands_for_the_exact_one(seed: int) -> None:
    exact = random_motion(np.random.default_rng(seed))
    rounded = np.round(exact, 3)
    assert is_rigid(rounded)
    nearest = nearest_rigid(rounded)
    assert nearest is not None
    np.testing.assert_allclose(nearest[:3, :3] @ nearest[:3, :3].T, np.eye(3), atol=1e-14)
    # Nine entries, each off by at most 0.0005, and no farther from the nearest rotation than from the exact one.
    assert np.linalg.norm(nearest[:3, :3] - exact[:3, :3]) < 2 * 3 * 0.0005
    np.testing.assert_array_equal(nearest[:, 3], rounded[:, 3])


SHEARED = np.eye(4)
SHEARED[0, 1] = 0.003
FAR = np.eye(4)
FAR[0, 3] = np.inf
NO_BOTTOM = np.eye(4)
NO_BOTTOM[3, 0] = 0.01


@pytest.mark.parametrize(
    "T",
    [SHEARED, FAR, NO_BOTTOM, np.eye(3), np.zeros((4, 4)), np.full((4, 4), np.nan), np.diag((1e300, 1, 1, 1))]
    + [np.diag((1.0, 1, -1, 1)), np.diag((1.0, 1.002, 1, 1)), 2 * np.eye(4)],
)
def test_what_is_not_rigid_is_told(T: np.ndarray) -> None:
    assert not is_rigid(T)
    assert nearest_rigid(T) is None
