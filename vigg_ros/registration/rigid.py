# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rigid motions SE(3) as (4, 4) float64, their quaternions (x, y, z, w), and their weighted least-squares fit."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vigg_ros.registration.errors import DataError

ORTHONORMAL_TOLERANCE = 2e-3
"""How far an entry of R R^T may be from the identity's. Rotations come from files with three digits and more:
entries that are off by 0.0005 leave it at most 2 sqrt(3) * 0.0005 = 0.0017 away."""

COLLINEAR_RATIO = 1e-4
"""Second over first singular value of the cross-covariance; below it the rotation about a line is free.

It is a ratio of variances: a set 1 m long is refused when it is thinner than 1 cm.
"""

SPOT_M2 = 1e-12
ROUNDING = 1e-13
"""Second moments of points on one spot: of a micrometre, or of some hundred roundings of the extent squared."""


def quaternions_from_rotations(R: NDArray[np.floating]) -> NDArray[np.float64]:
    """The unit quaternions (N, 4) with w >= 0 of rotations (N, 3, 3)."""
    return np.asarray(Rotation.from_matrix(R).as_quat(canonical=True))


def rotation_from_quaternion(x: float, y: float, z: float, w: float) -> NDArray[np.float64]:
    """The rotation (3, 3) of a quaternion of any length. Raises DataError if it is zero or not finite."""
    norm = math.hypot(x, y, z, w)
    if not math.isfinite(norm) or norm < 1e-6:
        raise DataError(
            "BAD_QUATERNION", found=f"quaternion ({x}, {y}, {z}, {w})",
            expected="a finite one of length 1", remedy="check the publisher of this pose; no rotation is (0, 0, 0, 1)",
        )
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def rigid_from_quaternion(position_m: Sequence[float], quaternion: Sequence[float]) -> NDArray[np.float64]:
    """T (4, 4) of a position (3,) and a quaternion (4,) of any length. Raises DataError where they are none."""
    if not all(map(math.isfinite, position_m)):
        raise DataError(
            "BAD_POSITION", found=f"position {tuple(position_m)}",
            expected="finite metres", remedy="check the publisher of this pose",
        )
    T = np.eye(4)
    T[:3, :3] = rotation_from_quaternion(*quaternion)
    T[:3, 3] = position_m
    return T


def is_rotation(R: NDArray[np.float64]) -> bool:
    """Whether a matrix (3, 3) is a rotation, but for the rounding of ORTHONORMAL_TOLERANCE."""
    if not np.abs(R).max() < 2:  # nor does NaN pass, and nothing overflows below
        return False
    error = np.abs(R @ R.T - np.eye(3)).max()
    return bool(error <= ORTHONORMAL_TOLERANCE and np.linalg.det(R) > 0)


def is_rigid(T: NDArray[np.float64]) -> bool:
    """Whether an array is a rigid transform (4, 4), but for rounding."""
    if T.shape != (4, 4) or not np.isfinite(T).all():
        return False
    return is_rotation(T[:3, :3]) and np.allclose(T[3], (0, 0, 0, 1))


def transform(T_target_source: NDArray[np.float64], points: NDArray[np.floating]) -> NDArray[np.float64]:
    """Points (N, 3) of the source frame in the target frame."""
    return points @ T_target_source[:3, :3].T + T_target_source[:3, 3]


def inverse(T_target_source: NDArray[np.float64]) -> NDArray[np.float64]:
    """T_source_target."""
    R_source_target = T_target_source[:3, :3].T
    T_source_target = np.eye(4)
    T_source_target[:3, :3] = R_source_target
    T_source_target[:3, 3] = -R_source_target @ T_target_source[:3, 3]
    return T_source_target


def angle_rad(R: NDArray[np.float64]) -> float:
    """Rotation angle of (3, 3), precise near 0: from sine and cosine, not by acos of the trace."""
    sine = 0.5 * math.hypot(R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1])
    return math.atan2(sine, 0.5 * (float(np.trace(R)) - 1.0))


def weighted_svd(
    target: NDArray[np.floating], source: NDArray[np.floating], weight: NDArray[np.floating]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """T_target_source minimising sum weight * |target - T source|^2 (paper eq. 12; Kabsch, Umeyama).

    target, source: (N, 3), metres; weight: (..., N), not negative: one fit for each row of weights.
    Returns T (..., 4, 4) with det(R) = +1, and whether it is determined (...,): false for fewer than
    three points and for points on a line. Coplanar points are fine.
    """
    weight = np.asarray(weight, np.float64)
    if target.shape[0] == 0:
        return np.broadcast_to(np.eye(4), (*weight.shape[:-1], 4, 4)).copy(), np.zeros(weight.shape[:-1], bool)
    # About the middle of all points the moments keep their precision far from the origin.
    centre_target, centre_source = target.mean(axis=0), source.mean(axis=0)
    x, y = target - centre_target, source - centre_source
    total = weight.sum(axis=-1)
    share = weight / np.where(total > 0, total, 1)[..., None]
    mean_x, mean_y = share @ x, share @ y
    products = (x[:, :, None] * y[:, None, :]).reshape(-1, 9)
    cross = (share @ products).reshape(*total.shape, 3, 3) - mean_x[..., :, None] * mean_y[..., None, :]
    U, singular, Vt = np.linalg.svd(cross)
    # A reflection would fit coplanar or noisy points as well; flip the weakest axis instead.
    U[..., :, 2] *= np.sign(np.linalg.det(U) * np.linalg.det(Vt))[..., None]
    T = np.zeros((*total.shape, 4, 4))
    T[..., :3, :3] = U @ Vt
    moved = (T[..., :3, :3] @ (mean_y + centre_source)[..., None])[..., 0]
    T[..., :3, 3] = mean_x + centre_target - moved
    T[..., 3, 3] = 1.0
    # Moments about the common middle cancel to rounding, not to zero, where all weight is on one spot.
    spot = max(SPOT_M2, ROUNDING * float(np.abs(x).max()) * float(np.abs(y).max()))
    determined = (singular[..., 1] > COLLINEAR_RATIO * singular[..., 0]) & (singular[..., 0] > spot) & (total > 0)
    return T, determined & (np.count_nonzero(weight, axis=-1) >= 3)
