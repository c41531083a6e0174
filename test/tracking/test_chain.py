# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses in a chain, with covariances by hand and by Monte Carlo."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vigg_ros.tracking.chain import UncertainPose

Pose = NDArray[np.float64]


def pose(rotation_deg, translation_m):
    T_parent_child = np.eye(4)
    T_parent_child[:3, :3] = Rotation.from_rotvec(rotation_deg, degrees=True).as_matrix()
    T_parent_child[:3, 3] = translation_m
    return T_parent_child


def covariance(rng, sigma=0.01):
    """A full one of about sigma on each axis."""
    root = rng.normal(0, sigma / np.sqrt(6), (6, 6))
    return root @ root.T


def disturbed(T, steps):
    """The pose (N, 4, 4) with errors (N, 6) as geometry_msgs means them: t + dt, exp(dr) R."""
    out = np.tile(T, (len(steps), 1, 1))
    out[:, :3, 3] += steps[:, :3]
    out[:, :3, :3] = Rotation.from_rotvec(steps[:, 3:]).as_matrix() @ T[:3, :3]
    return out


def test_the_parent_itself_is_known_exactly():
    start = UncertainPose.identity()
    child = UncertainPose(pose((10, 20, 30), (1, 2, 3)), covariance(np.random.default_rng(0)))
    for both in (start.compose(child), child.compose(start)):
        np.testing.assert_allclose(both.T_parent_child, child.T_parent_child, atol=1e-15)
        np.testing.assert_allclose(both.covariance, child.covariance, atol=1e-18)


def test_poses_compose():
    """A quarter turn about z takes the child's x to the parent's y."""
    first = UncertainPose(pose((0, 0, 90), (1, 0, 0)), np.zeros((6, 6)))
    second = UncertainPose(pose((0, 0, 90), (2, 0, 0)), np.zeros((6, 6)))
    both = first.compose(second)
    np.testing.assert_allclose(both.T_parent_child, pose((0, 0, 180), (1, 2, 0)), atol=1e-12)
    assert not both.covariance.any()


def test_a_turn_at_the_start_moves_the_end_of_a_long_arm():
    """0.01 rad about z with an arm of 2 m along x: 2 cm along y, fully correlated with the turn."""
    turned = np.zeros((6, 6))
    turned[5, 5] = 0.01**2
    first = UncertainPose(np.eye(4), turned)
    both = first.compose(UncertainPose(pose((0, 0, 0), (2, 0, 0)), np.zeros((6, 6)))).covariance
    expected = np.zeros((6, 6))
    expected[5, 5], expected[1, 1], expected[1, 5], expected[5, 1] = 1e-4, 4e-4, 2e-4, 2e-4
    np.testing.assert_allclose(both, expected, atol=1e-15)


def test_the_child_s_errors_turn_with_the_parent():
    """Off by 1 cm along its own x, and by 0.02 rad about it; its parent sees that along and about y."""
    own = np.diag((1e-4, 0, 0, 4e-4, 0, 0))
    first = UncertainPose(pose((0, 0, 90), (5, 6, 7)), np.zeros((6, 6)))
    both = first.compose(UncertainPose(np.eye(4), own)).covariance
    np.testing.assert_allclose(both, np.diag((0, 1e-4, 0, 0, 4e-4, 0)), atol=1e-15)


@pytest.mark.parametrize("seed", range(3))
def test_the_covariance_is_that_of_many_disturbed_chains(seed):
    rng = np.random.default_rng(seed)
    parts = [
        UncertainPose(pose(tuple(rng.normal(0, 60, 3)), tuple(rng.normal(0, 2, 3))), covariance(rng)) for _ in range(2)
    ]
    both = parts[0].compose(parts[1])
    count = 40_000
    first, second = (
        disturbed(part.T_parent_child, rng.multivariate_normal(np.zeros(6), part.covariance, count)) for part in parts
    )
    ends = first @ second
    off = np.column_stack(
        (
            ends[:, :3, 3] - both.T_parent_child[:3, 3],
            Rotation.from_matrix(ends[:, :3, :3] @ both.T_parent_child[:3, :3].T).as_rotvec(),
        )
    )
    found = off.T @ off / count
    # Relative to the deviations, an entry is known to 1 / sqrt(40,000) = 0.5 %, here four of that; terms of
    # second order are 0.01 of the first.
    scale = np.sqrt(np.outer(np.diag(both.covariance), np.diag(both.covariance)))
    np.testing.assert_allclose(found / scale, both.covariance / scale, atol=0.03)


def test_a_long_chain_stays_a_rotation_and_its_covariance_grows():
    step = UncertainPose(pose((0.3, 1, -0.7), (0.1, 0.02, 0)), np.diag((1e-6,) * 6))
    here, sizes = UncertainPose.identity(), []
    for _ in range(5000):
        here = here.compose(step)
        sizes.append(np.linalg.eigvalsh(here.covariance).max())
    R = here.T_parent_child[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1)
    # Rotations add up: 5,000 steps of 1e-6 on each axis.
    np.testing.assert_allclose(np.diag(here.covariance)[3:], 5000e-6, rtol=1e-6)
    assert sizes[-1] > sizes[len(sizes) // 2] > sizes[0]
