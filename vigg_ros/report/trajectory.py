# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Trajectories: poses between poses, and one trajectory laid onto another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vigg_ros.registration.errors import DataError
from vigg_ros.registration.rigid import weighted_svd

MAX_GAP_INTERVALS = 1.5
"""A gap of so many median intervals is jitter of the source's clock; at twice the interval a pose is missing."""

MAX_GAP_RANGE_NS = (100_000_000, 500_000_000)
"""Within the least, a hand does not get far whatever the rate; beyond the most, a sensor may have been anywhere."""

BY_POSITIONS = "SE(3) alignment of the positions, without scale"
BY_ORIENTATIONS = "SE(3) alignment by the orientations (the positions lie on a line), without scale"


@dataclass(frozen=True, slots=True)
class Trajectory:
    """N poses of a sensor in one world frame."""

    stamps_ns: NDArray[np.int64]
    """(N,), strictly ascending."""
    T_world_sensor: NDArray[np.float64]
    """(N, 4, 4): p_world = T_world_sensor @ p_sensor, metres."""

    def __post_init__(self) -> None:
        stamps, poses = self.stamps_ns, self.T_world_sensor
        if stamps.ndim != 1 or stamps.dtype != np.int64 or poses.shape != (len(stamps), 4, 4):
            raise DataError(
                "TRAJECTORY_SHAPE",
                found=f"stamps of shape {stamps.shape} and type {stamps.dtype}, poses of shape {poses.shape}",
                expected="stamps (N,) int64 and poses (N, 4, 4)",
                remedy="pass one pose for each stamp, in nanoseconds",
            )
        if not (np.diff(stamps) > 0).all() or not np.isfinite(poses).all():
            raise DataError(
                "TRAJECTORY_ORDER",
                found="stamps that do not ascend, or numbers that are not finite",
                expected="strictly ascending stamps and finite poses",
                remedy="build it with Trajectory.of, which sorts",
            )

    @classmethod
    def of(cls, stamps_ns: Any, T_world_sensor: Any) -> Trajectory:
        """A trajectory of poses in any order; of poses with equal stamps the first one counts."""
        stamps = np.asarray(stamps_ns, np.int64).reshape(-1)
        poses = np.asarray(T_world_sensor, np.float64).reshape(-1, 4, 4)
        stamps, rows = np.unique(stamps, return_index=True)
        return cls(stamps, poses[rows])

    def __len__(self) -> int:
        return len(self.stamps_ns)

    @property
    def positions(self) -> NDArray[np.float64]:
        """(N, 3), metres, in the world frame."""
        return self.T_world_sensor[:, :3, 3]

    @property
    def length_m(self) -> float:
        """Sum of the straight lines from pose to pose."""
        return float(np.linalg.norm(np.diff(self.positions, axis=0), axis=1).sum())

    def select(self, rows: NDArray[Any]) -> Trajectory:
        """Some of the poses, by mask or ascending index."""
        return Trajectory(self.stamps_ns[rows], self.T_world_sensor[rows])

    def moved(self, T_other_world: NDArray[np.float64]) -> Trajectory:
        """The same poses as seen from another frame."""
        return Trajectory(self.stamps_ns, T_other_world @ self.T_world_sensor)


def max_gap_ns(trajectory: Trajectory) -> float:
    """How far apart two poses may be with something known between them: by the trajectory's own rate.

    MAX_GAP_INTERVALS times its median interval, but within MAX_GAP_RANGE_NS: at 15 Hz and more 0.1 s, at 10 Hz
    0.15 s, at 3 Hz and less 0.5 s.
    """
    interval_ns = np.median(np.diff(trajectory.stamps_ns)) if len(trajectory) > 1 else 0
    return float(np.clip(MAX_GAP_INTERVALS * interval_ns, *MAX_GAP_RANGE_NS))


def interpolate(trajectory: Trajectory, stamps_ns: NDArray[np.int64]) -> tuple[Trajectory, NDArray[np.bool_]]:
    """The poses at the strictly ascending stamps (M,) where they are known, and which are known (M,).

    A pose at a stamp is taken as it is. Between two that are at most ``max_gap_ns`` apart, positions are
    linear and rotations follow the shortest arc (slerp). Nothing is known elsewhere.
    """
    if len(trajectory) == 0:
        return trajectory, np.zeros(len(stamps_ns), bool)
    last = len(trajectory) - 1
    after = np.searchsorted(trajectory.stamps_ns, stamps_ns)
    is_exact = trajectory.stamps_ns[np.minimum(after, last)] == stamps_ns
    before = np.where(is_exact, after, after - 1)
    is_inside = (before >= 0) & (after <= last)
    before, after = np.maximum(before, 0), np.minimum(after, last)
    gap_ns = trajectory.stamps_ns[after] - trajectory.stamps_ns[before]
    known = is_inside & (gap_ns <= max_gap_ns(trajectory))
    before, after, gap_ns, stamps_ns = before[known], after[known], gap_ns[known], stamps_ns[known]
    share = (stamps_ns - trajectory.stamps_ns[before]) / np.maximum(gap_ns, 1)
    poses = _between(trajectory.T_world_sensor[before], trajectory.T_world_sensor[after], share)
    return Trajectory(stamps_ns, poses), known


def _between(
    T_world_a: NDArray[np.float64], T_world_b: NDArray[np.float64], share: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Poses (M, 4, 4) at the shares (M,) of the way from a to b."""
    poses = T_world_a.copy()
    on_the_way = np.flatnonzero(share > 0)
    if len(on_the_way):
        a, b, s = T_world_a[on_the_way], T_world_b[on_the_way], share[on_the_way, None]
        R_world_a = Rotation.from_matrix(a[:, :3, :3])
        turn = (R_world_a.inv() * Rotation.from_matrix(b[:, :3, :3])).as_rotvec()
        poses[on_the_way, :3, :3] = (R_world_a * Rotation.from_rotvec(s * turn)).as_matrix()
        poses[on_the_way, :3, 3] = (1 - s) * a[:, :3, 3] + s * b[:, :3, 3]
    return poses


@dataclass(frozen=True, slots=True)
class Alignment:
    """A rigid motion (no scale) that lays an estimated trajectory onto the true one."""

    T_truth_estimate: NDArray[np.float64]
    """(4, 4): p in the truth's world from p in the estimate's world."""
    words: str
    """For the sentence "after ...", wherever an aligned figure is given."""


def align(truth: Trajectory, estimate: Trajectory) -> Alignment:
    """The alignment of two trajectories with the same stamps, at least one.

    By least squares on the positions (``rigid.weighted_svd``). Fewer than three positions, or positions
    on a line, leave a rotation free: then the rotation is the mean of what the orientations say, and the
    translation takes the mean position onto the mean position.
    """
    weight = np.ones(len(truth))
    T_truth_estimate, determined = weighted_svd(truth.positions, estimate.positions, weight)
    if determined:
        return Alignment(T_truth_estimate, BY_POSITIONS)
    R = mean_rotation(truth, estimate)
    T_truth_estimate = np.eye(4)
    T_truth_estimate[:3, :3] = R
    T_truth_estimate[:3, 3] = truth.positions.mean(axis=0) - R @ estimate.positions.mean(axis=0)
    return Alignment(T_truth_estimate, BY_ORIENTATIONS)


def mean_rotation(truth: Trajectory, estimate: Trajectory) -> NDArray[np.float64]:
    """R_truth_estimate (3, 3) that takes the orientations of one trajectory nearest to the other's.

    The chordal mean; both have the same stamps, at least one.
    """
    R_truth, R_estimate = truth.T_world_sensor[:, :3, :3], estimate.T_world_sensor[:, :3, :3]
    U, _, Vt = np.linalg.svd((R_truth @ np.swapaxes(R_estimate, 1, 2)).sum(axis=0))
    flip = np.diag((1.0, 1.0, np.sign(np.linalg.det(U @ Vt))))
    return np.asarray(U @ flip @ Vt)
