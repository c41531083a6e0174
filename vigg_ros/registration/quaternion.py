# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rotation matrices and quaternions, everywhere in the order of geometry_msgs: x, y, z, w."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import DataError


def quaternion_from_rotation(R: NDArray[np.floating]) -> tuple[float, float, float, float]:
    """The unit quaternion with w >= 0 of a rotation (3, 3)."""
    x, y, z, w = quaternions_from_rotations(np.asarray(R)[None])[0].tolist()
    return x, y, z, w


def quaternions_from_rotations(R: NDArray[np.floating]) -> NDArray[np.float64]:
    """The unit quaternions (N, 4) with w >= 0 of rotations (N, 3, 3).

    Each of the four rows of products q_i * q (Shepperd, 1978) is a multiple of q; the longest one keeps
    its digits at every angle, 180 degrees included.
    """
    m = np.asarray(R, dtype=np.float64)
    products = np.zeros((len(m), 4, 4))
    trace = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    for i in range(3):
        products[:, i, i] = 1 + (2 * m[:, i, i] - trace)
    products[:, 3, 3] = 1 + trace
    for i, j in ((0, 1), (0, 2), (1, 2)):
        products[:, i, j] = products[:, j, i] = m[:, i, j] + m[:, j, i]
    for i, (j, k) in enumerate(((2, 1), (0, 2), (1, 0))):
        products[:, i, 3] = products[:, 3, i] = m[:, j, k] - m[:, k, j]
    longest = np.argmax(np.diagonal(products, axis1=1, axis2=2), axis=1)
    rows = products[np.arange(len(m)), longest]
    length = np.linalg.norm(rows, axis=1) * np.copysign(1.0, rows[:, 3])
    return np.asarray(rows / length[:, None])


def rotation_from_quaternion(x: float, y: float, z: float, w: float) -> NDArray[np.float64]:
    """The rotation (3, 3) of a quaternion of any length. Raises DataError if it is zero or not finite."""
    norm = math.hypot(x, y, z, w)
    if not math.isfinite(norm) or norm < 1e-6:
        raise DataError(
            "BAD_QUATERNION",
            found=f"quaternion ({x}, {y}, {z}, {w})",
            expected="a finite one of length 1",
            remedy="check the publisher of this pose; no rotation is (0, 0, 0, 1)",
        )
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
