# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a motion leaves between two frames, to be made small: distances of surfaces, and of visual matches.

Two scans meet in space, by nearest points (``scan_alignment``); two depth images in the image, by projection, each
error as large as its sensor makes it (``depth_alignment``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.rigid import angle_rad

WIDE_VOXELS, NARROW_VOXELS = 4.0, 2.0
"""How far surfaces may be apart in the first rounds, which may start a few voxels off, and in the others."""

MIN_NORMAL_COSINE = 0.5
"""Surfaces that face apart by more than 60 deg are not the same surface."""

MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""

BLOCK_VOXELS = 8.0
"""Errors of depth are alike on patches of about this size; patches, not points, count as independent."""


@dataclass(frozen=True, slots=True)
class Residuals:
    """N scalar residuals: e = value - jacobian @ step."""

    value: NDArray[np.float64]
    jacobian: NDArray[np.float64]
    """(N, 6) for a translation and a rotation about the moved origin of the source."""
    weight: NDArray[np.float64]
    """(N,) over the variance, less for outliers."""
    cluster: NDArray[np.int64]
    """(N,) the patch or match that each belongs to: what errs together."""
    floor: NDArray[np.float64]
    """(N,) standard deviation that stays, however well they agree."""
    curvature: float = 1.0
    """The derivative of the weighted residuals as a share of what the weights claim: outliers answer less."""
    shared_floor: bool = False
    """Whether that is an error of a whole patch rather than of each point."""

    def __len__(self) -> int:
        return len(self.value)

    @property
    def information(self) -> NDArray[np.float64]:
        """(6, 6)"""
        return np.asarray((self.jacobian * self.weight[:, None]).T @ self.jacobian)

    @property
    def gradient(self) -> NDArray[np.float64]:
        """(6,) that the step of least squares solves ``information`` for."""
        return np.asarray(self.jacobian.T @ (self.weight * self.value))


class FrameAlignment(Protocol):
    """Two frames and their visual matches, to be aligned."""

    def surface(self, T_target_source: NDArray[np.float64], *, wide: bool = False, few: bool = False) -> Residuals:
        """Distances of the surfaces along their normals."""

    def visual(self, T_target_source: NDArray[np.float64]) -> Residuals:
        """Of the visual matches."""

    def response(self, T_target_source: NDArray[np.float64], found: Residuals) -> float:
        """How much of a shift along the normals is seen once the surfaces are paired anew: a share in (0, 1]."""

    def lever(self, T_target_source: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """(6,) how far the motion goes: metres for the translation, radians for the rotation.

        None where images cannot contradict the surfaces.
        """


def patch_of(points: NDArray[np.float32], size_m: float) -> NDArray[np.int64]:
    """The number of the patch of this size that each point (N, 3) lies on; not negative."""
    cells = np.floor(points / size_m).astype(np.int64)
    if len(cells) == 0:
        return np.empty(0, np.int64)
    cells -= cells.min(axis=0)
    return np.asarray(np.ravel_multi_index(tuple(cells.T), tuple(cells.max(axis=0) + 1)), np.int64)


def deviation(value: NDArray[np.float64], floor: float) -> float:
    """Standard deviation of values (N,), N >= 1, by their median absolute deviation, and never below the floor."""
    return MAD_TO_SIGMA * float(np.median(np.abs(value))) + floor


def cauchy(size: NDArray[np.float64], sigma: float) -> NDArray[np.float64]:
    """Weights in (0, 1] of sizes (N,), of the Cauchy distribution's scale."""
    return np.asarray(1.0 / (1.0 + (size / sigma) ** 2))


def curvature_of(size: NDArray[np.float64], sigma: float, dimensions: int) -> float:
    """Mean derivative of residuals under Cauchy weights over their mean weight, for residuals of some dimensions.

    w + (dw/du) u / d with w = 1 / (1 + u^2): weights that fall as a residual grows take back a part of what it says.
    """
    weight = cauchy(size, sigma)
    return float(np.mean(weight - 2.0 / dimensions * (1.0 - weight) * weight) / np.mean(weight))


def turned(arms: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3, 6): how a step (translation, rotation about the origin of these arms (N, 3)) moves each of their ends."""
    x, y, z = arms.T
    jacobian = np.zeros((len(arms), 3, 6))
    jacobian[:, :, :3] = np.eye(3)
    jacobian[:, 0, 4], jacobian[:, 0, 5] = z, -y
    jacobian[:, 1, 3], jacobian[:, 1, 5] = -z, x
    jacobian[:, 2, 3], jacobian[:, 2, 4] = y, -x
    return jacobian


def lever(T_target_source: NDArray[np.float64], points: NDArray[np.floating]) -> NDArray[np.float64]:
    """(6,) how far a motion goes: what it shifts a scene of such points (N, 3) by, metres, and turns it, radians."""
    angle = angle_rad(T_target_source[:3, :3])
    distance_m = float(np.median(np.linalg.norm(points, axis=1))) if len(points) else 0.0
    shifted = math.hypot(float(np.linalg.norm(T_target_source[:3, 3])), angle * distance_m)
    return np.repeat((shifted, angle), 3)


def few_rows(count: int, few: bool) -> NDArray[np.int64]:
    """The first rounds use every 4th point, but not fewer than 500: they need not be precise."""
    return np.arange(0, count, 4 if few and count > 2000 else 1)
