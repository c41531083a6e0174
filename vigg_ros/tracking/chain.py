# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses in a chain: a keyframe in the odometry frame, a frame in the keyframe."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class UncertainPose:
    """A frame in a parent frame, with the covariance of geometry_msgs/PoseWithCovariance.

    covariance (6, 6): translation (m), then rotation (rad), both along the parent's axes: t + dt, exp(dr) R.
    """

    T_parent_child: NDArray[np.float64]
    covariance: NDArray[np.float64]

    @classmethod
    def identity(cls) -> UncertainPose:
        """The parent itself, known exactly."""
        return cls(np.eye(4), np.zeros((6, 6)))

    def compose(self, child: UncertainPose) -> UncertainPose:
        """A pose in the child as a pose in the parent; their errors are independent."""
        R_parent_child = self.T_parent_child[:3, :3]
        arm = R_parent_child @ child.T_parent_child[:3, 3]
        # A small rotation dr of the child's frame moves the end of the arm by dr x arm.
        lever = np.eye(6)
        lever[:3, 3:] = -_skew(arm)
        turn = np.zeros((6, 6))
        turn[:3, :3] = turn[3:, 3:] = R_parent_child
        covariance = lever @ self.covariance @ lever.T + turn @ child.covariance @ turn.T
        return UncertainPose(_orthonormal(self.T_parent_child @ child.T_parent_child), covariance)


def _skew(v: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def _orthonormal(T_parent_child: NDArray[np.float64]) -> NDArray[np.float64]:
    """The nearest rotation, so that rounding does not grow along a chain of thousands."""
    U, _, Vt = np.linalg.svd(T_parent_child[:3, :3])
    out = T_parent_child.copy()
    out[:3, :3] = U @ Vt
    return out
