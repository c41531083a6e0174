# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Velocity between two poses that were registered against the same keyframe."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vigg_ros.registration.rigid import inverse
from vigg_ros.sensors.header import NS_PER_S
from vigg_ros.tracking.chain import UncertainPose

MAX_INTERVAL_S = 1.0
"""The mean velocity over a longer time says little about the velocity now."""


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
    turn = np.zeros((6, 6))
    turn[:3, :3] = turn[3:, 3:] = now.T_parent_child[:3, :3].T
    covariance = turn @ (before.covariance + now.covariance) @ turn.T
    return Twist(motion / interval_s, covariance / interval_s**2)


def se3_log(T: NDArray[np.float64]) -> NDArray[np.float64]:
    """The twist (6,), linear then angular, whose motion over unit time is T (4, 4)."""
    rotation = Rotation.from_matrix(T[:3, :3]).as_rotvec()
    angle = float(np.linalg.norm(rotation))
    W = np.array(
        [[0, -rotation[2], rotation[1]], [rotation[2], 0, -rotation[0]], [-rotation[1], rotation[0], 0]]
    )
    # (1 - (angle / 2) cot(angle / 2)) / angle^2, by its series where the quotient would lose its digits
    half = angle / 2
    factor = 1 / 12 + angle**2 / 720 if angle < 1e-3 else (1 - half / np.tan(half)) / angle**2
    linear = (np.eye(3) - W / 2 + factor * W @ W) @ T[:3, 3]
    return np.concatenate((linear, rotation))
