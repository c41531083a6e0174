# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses with their covariance: composed in a chain of keyframes, and the velocity between two of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vigg_ros.registration.rigid import inverse
from vigg_ros.sensors.header import NS_PER_S

MAX_INTERVAL_S = 1.0
"""The mean velocity over a longer time says little about the velocity now."""


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
        turn = np.kron(np.eye(2), R_parent_child)
        covariance = lever @ self.covariance @ lever.T + turn @ child.covariance @ turn.T
        return UncertainPose(_orthonormal(self.T_parent_child @ child.T_parent_child), covariance)


@dataclass(frozen=True, slots=True)
class KeyframePose:
    """A frame in a keyframe of its session."""

    stamp_ns: int
    session: int
    keyframe_ns: int
    """The stamp of the keyframe; the frame's own where it is one itself."""
    pose: UncertainPose
    """In that keyframe."""


@dataclass(frozen=True, slots=True)
class Twist:
    """Linear (m/s) and angular (rad/s) velocity (6,) in the moving frame, with its covariance (6, 6)."""

    velocity: NDArray[np.float64]
    covariance: NDArray[np.float64]


def twist_between(before: KeyframePose | None, now: KeyframePose) -> Twist | None:
    """The constant velocity that leads from one pose to the next; None where nothing ties them together.

    That is so at the start, after an interval of more than MAX_INTERVAL_S, and where their keyframes differ
    without one being the other's: their poses then differ by drift too.
    """
    if before is None or before.session != now.session:
        return None
    interval_s = (now.stamp_ns - before.stamp_ns) / NS_PER_S
    if not 0 < interval_s <= MAX_INTERVAL_S:
        return None
    if before.stamp_ns == now.keyframe_ns:  # the frame before has become the keyframe
        start = UncertainPose.identity()
    elif before.keyframe_ns == now.keyframe_ns:
        start = before.pose
    else:
        return None
    return _twist(start, now.pose, interval_s)


def _twist(before: UncertainPose, now: UncertainPose, interval_s: float) -> Twist:
    motion = se3_log(inverse(before.T_parent_child) @ now.T_parent_child)
    # Both errors are along the keyframe's axes; a twist is told along the frame's own.
    turn = np.kron(np.eye(2), now.T_parent_child[:3, :3].T)
    covariance = turn @ (before.covariance + now.covariance) @ turn.T
    return Twist(motion / interval_s, covariance / interval_s**2)


def se3_log(T: NDArray[np.float64]) -> NDArray[np.float64]:
    """The twist (6,), linear then angular, whose motion over unit time is T (4, 4)."""
    rotation = Rotation.from_matrix(T[:3, :3]).as_rotvec()
    angle = float(np.linalg.norm(rotation))
    W = _skew(rotation)
    # (1 - (angle / 2) cot(angle / 2)) / angle^2, by its series where the quotient would lose its digits
    half = angle / 2
    factor = 1 / 12 + angle**2 / 720 if angle < 1e-3 else (1 - half / np.tan(half)) / angle**2
    linear = (np.eye(3) - W / 2 + factor * W @ W) @ T[:3, 3]
    return np.concatenate((linear, rotation))


def _skew(v: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def _orthonormal(T_parent_child: NDArray[np.float64]) -> NDArray[np.float64]:
    """The nearest rotation, so that rounding does not grow along a chain of thousands."""
    U, _, Vt = np.linalg.svd(T_parent_child[:3, :3])
    out = T_parent_child.copy()
    out[:3, :3] = U @ Vt
    return out
