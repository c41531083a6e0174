# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rigid motions and quaternions: angles to the last digit, and fits whose answer is known."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vigg_ros.bench.datasets.number_files import nearest_rigid
from vigg_ros.registration.rigid import (
    angle_rad,
    inverse,
    is_rigid,
    quaternions_from_rotations,
    rotation_from_quaternion,
    transform,
    weighted_svd,
)
from vigg_ros_testing.registration_samples import apply, errors, motion, random_motion

TETRAHEDRON = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)


def test_transform_and_inverse_by_hand() -> None:
    # A quarter turn about z takes x to y; the target's (10, 20, 30) is where the source's origin lies.
    T_target_source = motion((0, 0, 90), (10, 20, 30))
    source, target = np.array([(1.0, 0, 0), (0, 2, 5)]), np.array([(10.0, 21, 30), (8, 20, 35)])
    np.testing.assert_allclose(transform(T_target_source, source), target, atol=1e-12)
    np.testing.assert_allclose(transform(inverse(T_target_source), target), source, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-9, 1e-4, 0.3, 1.5, 3.0, math.pi - 1e-4, math.pi - 1e-9, math.pi])
def test_angle_is_precise_everywhere(angle: float) -> None:
    axis = np.array((2.0, -1.0, 2.0)) / 3
    found = angle_rad(Rotation.from_rotvec(angle * axis).as_matrix())
    # Entries of R carry an error of 1e-16, sine and cosine some of them. By acos of the trace, 1e-9 gives 0.
    assert found == pytest.approx(angle, abs=1e-15, rel=1e-6)


@pytest.mark.parametrize("points", [TETRAHEDRON, SQUARE, TETRAHEDRON[:3]], ids=["solid", "coplanar", "three"])
def test_an_exact_motion_is_found(points: np.ndarray) -> None:
    for seed in range(20):
        T_true = random_motion(np.random.default_rng(seed))
        T_found, determined = weighted_svd(apply(T_true, points), points, np.ones(len(points)))
        assert determined
        np.testing.assert_allclose(T_found, T_true, atol=1e-12)


def test_a_reflection_is_answered_with_a_rotation() -> None:
    mirrored = TETRAHEDRON * (1, 1, -1)
    T_found, determined = weighted_svd(mirrored, TETRAHEDRON, np.ones(4))
    assert determined
    assert np.linalg.det(T_found[:3, :3]) == pytest.approx(1)
    # No rotation fits better: try many around the one found, each with its own best translation.

    def cost(R: np.ndarray) -> float:
        centred = TETRAHEDRON - TETRAHEDRON.mean(axis=0)
        return float(((mirrored - mirrored.mean(axis=0) - centred @ R.T) ** 2).sum())

    turns = Rotation.random(2000, random_state=0).as_matrix()
    nudged = Rotation.from_rotvec(0.05 * turns[:, 0]).as_matrix() @ T_found[:3, :3]
    assert min(map(cost, (*turns, *nudged))) > cost(T_found[:3, :3])


@pytest.mark.hostile("Scene: degenerate SVD, det = +1 always")
def test_noise_about_a_plane_never_turns_into_a_mirror() -> None:
    for seed in range(100):
        rng = np.random.default_rng(seed)
        source = SQUARE + rng.normal(0, 0.05, SQUARE.shape)
        target = SQUARE @ random_motion(rng)[:3, :3].T + rng.normal(0, 0.05, SQUARE.shape)
        T_found, _ = weighted_svd(target, source, np.ones(4))
        assert np.linalg.det(T_found[:3, :3]) == pytest.approx(1, abs=1e-9)


def test_the_weights_are_those_of_least_squares() -> None:
    """A weight of 3 is a point given three times; a weight of 0 is a point left out."""
    rng = np.random.default_rng(3)
    source, target = rng.normal(size=(2, 6, 3))
    weighted, _ = weighted_svd(target, source, np.array([3, 1, 1, 1, 2, 0], float))
    rows = [0, 0, 0, 1, 2, 3, 4, 4]
    repeated, _ = weighted_svd(target[rows], source[rows], np.ones(8))
    np.testing.assert_allclose(weighted, repeated, atol=1e-12)
    unweighted, _ = weighted_svd(target, source, np.ones(6))
    assert errors(weighted, unweighted)[0] > 1


DEGENERATE = {
    "two points": TETRAHEDRON[:2],
    "one point": TETRAHEDRON[:1],
    "none": TETRAHEDRON[:0],
    "identical": np.tile((1.0, 2.0, 3.0), (5, 1)),
    "on a line": np.outer((0, 1, 2, 5), (1, 2, 3)) + (3.0, 0, 0),
    # 1 mm over 5 m, far below the 1:100 that COLLINEAR_RATIO asks for
    "nearly on a line": np.array([(0, 0, 0), (1, 1e-3, 0), (2, 0, 1e-3), (5, 0, 0)]),
}


@pytest.mark.hostile("Scene: degenerate SVD, det = +1 always")
@pytest.mark.parametrize("points", DEGENERATE.values(), ids=DEGENERATE)
def test_degenerate_points_determine_nothing(points: np.ndarray) -> None:
    for seed in range(20):
        T_true = random_motion(np.random.default_rng(seed))
        T_found, determined = weighted_svd(apply(T_true, points), points, np.linspace(0.5, 1, len(points)))
        assert not determined
        assert np.isfinite(T_found).all()
        assert np.linalg.det(T_found[:3, :3]) == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize("weighted", ["none", "two", "one spot", "a line"])
def test_weights_on_too_little_determine_nothing(weighted: str) -> None:
    """Where the other points are many and far, their rounding must not pass for a shape."""
    rng = np.random.default_rng(0)
    points = rng.normal(0, 30, (50, 3))
    points[2:6] = points[2]
    points[6:10] = points[6] + np.outer((0, 0.1, 0.2, 0.5), (0.6, 0.8, 0))
    rows = {"none": slice(0), "two": slice(0, 2), "one spot": slice(2, 6), "a line": slice(6, 10)}[weighted]
    for _ in range(100):
        weight = np.zeros(50)
        weight[rows] = rng.uniform(0.1, 1, len(points[rows]))
        _, determined = weighted_svd(apply(random_motion(rng), points), points, weight)
        assert not determined


def test_a_batch_is_one_fit_for_each_row_of_weights() -> None:
    rng = np.random.default_rng(1)
    source, target = rng.normal(size=(2, 12, 3))
    weight = rng.uniform(size=(4, 5, 12)) * (rng.uniform(size=(4, 5, 12)) < 0.4)
    T_batch, determined = weighted_svd(target, source, weight)
    assert T_batch.shape == (4, 5, 4, 4)
    for i in np.ndindex(4, 5):
        T_one, one = weighted_svd(target, source, weight[i])
        np.testing.assert_allclose(T_batch[i], T_one, atol=1e-12)
        assert determined[i] == one


def test_far_from_the_origin_nothing_is_lost() -> None:
    """A clique of 20 cm, 1 km from the origin: float64 leaves 1e-13 m there, and 0.2 m turns it into 1e-12 rad."""
    T_true = motion((10, 20, 30), (1, 2, 3))
    source = 0.2 * TETRAHEDRON + (1000, -500, 30)
    T_found, determined = weighted_svd(apply(T_true, source), source, np.ones(4))
    assert determined
    np.testing.assert_allclose(apply(T_found, source), apply(T_true, source), atol=1e-9)


ANGLES = st.floats(-math.pi, math.pi)


@given(ANGLES, ANGLES, ANGLES)
def test_quaternions_are_those_of_scipy(x: float, y: float, z: float) -> None:
    R = Rotation.from_rotvec((x, y, z)).as_matrix()
    q = np.array(quaternions_from_rotations(R[None])[0])
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


@pytest.mark.parametrize(
    "T",
    [np.eye(3), np.zeros((4, 4)), np.full((4, 4), np.nan), np.diag((1e300, 1, 1, 1)), 2 * np.eye(4)]
    + [np.diag((1.0, 1, -1, 1)), np.diag((1.0, 1.002, 1, 1))]
    # A shear, a place at infinity, and a bottom row that is none.
    + [
        np.where(np.arange(16) == at, x, np.eye(4).ravel()).reshape(4, 4)
        for at, x in ((1, 3e-3), (3, np.inf), (12, 0.01))
    ],
)
def test_what_is_not_rigid_is_told(T: np.ndarray) -> None:
    assert not is_rigid(T)
    assert nearest_rigid(T) is None
