# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far motions and poses are from the truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.rigid import angle_rad, inverse
from vigg_ros.report.trajectory import Alignment, Trajectory, mean_rotation
from vigg_ros.sensors.header import NS_PER_S

SECOND_SLACK_NS = 100_000_000
"""Frames count as one second apart within this; slower cameras than 5 Hz may have none."""

ROTATION_ALIGNMENT = "their mean difference taken out"
"""How absolute rotations are aligned. A short or straight path says little about the rotation between two
worlds: by its positions alone, precise orientations would seem to be off by many degrees."""


def rotation_error_deg(T_a: NDArray[np.float64], T_b: NDArray[np.float64]) -> float:
    """RE: the angle between the rotations of two motions (4, 4), precise near 0."""
    return float(np.rad2deg(angle_rad(T_a[:3, :3].T @ T_b[:3, :3])))


def translation_error_m(T_a: NDArray[np.float64], T_b: NDArray[np.float64]) -> float:
    """TE: the distance between the translations of two motions (4, 4)."""
    return float(np.linalg.norm(T_a[:3, 3] - T_b[:3, 3]))


@dataclass(frozen=True, slots=True)
class Spread:
    """Errors in five numbers; NaN where there are none."""

    count: int
    median: float
    p95: float
    maximum: float
    rmse: float

    @classmethod
    def of(cls, values: NDArray[np.float64]) -> Spread:
        """The spread of values (N,)."""
        if len(values) == 0:
            return cls(0, *[float("nan")] * 4)
        median, p95 = np.percentile(values, (50, 95))
        rmse = np.sqrt(np.mean(np.square(values)))
        return cls(len(values), float(median), float(p95), float(values.max()), float(rmse))

    def as_dict(self) -> dict[str, float]:
        """For metrics.json."""
        return {"median": self.median, "p95": self.p95, "max": self.maximum, "rmse": self.rmse, "count": self.count}


@dataclass(frozen=True, slots=True)
class PoseErrors:
    """Translation and rotation errors (N,) of the same poses or pairs of poses."""

    stamps_ns: NDArray[np.int64]
    """(N,); of a pair, the later stamp."""
    translation_m: NDArray[np.float64]
    rotation_deg: NDArray[np.float64]

    @classmethod
    def between(cls, stamps_ns: NDArray[np.int64], T_a: NDArray[np.float64], T_b: NDArray[np.float64]) -> PoseErrors:
        """The errors between motions (N, 4, 4) and others."""
        pairs = list(zip(T_a, T_b, strict=True))
        translation_m = np.array([translation_error_m(*pair) for pair in pairs])
        rotation_deg = np.array([rotation_error_deg(*pair) for pair in pairs])
        return cls(stamps_ns, translation_m, rotation_deg)

    @classmethod
    def pool(cls, parts: Sequence[PoseErrors]) -> PoseErrors:
        """All errors of several sessions, none weighted."""
        nothing = cls(np.empty(0, np.int64), np.empty(0), np.empty(0))
        names = ("stamps_ns", "translation_m", "rotation_deg")
        return cls(*(np.concatenate([getattr(part, name) for part in (nothing, *parts)]) for name in names))

    def as_dict(self) -> dict[str, Any]:
        """For metrics.json."""
        return {
            "translation_m": Spread.of(self.translation_m).as_dict(),
            "rotation_deg": Spread.of(self.rotation_deg).as_dict(),
        }


def absolute_errors(truth: Trajectory, estimate: Trajectory, alignment: Alignment) -> PoseErrors:
    """Errors of the poses (N) of trajectories with equal stamps; the rotations see ROTATION_ALIGNMENT."""
    aligned = estimate.moved(alignment.T_truth_estimate).T_world_sensor
    aligned[:, :3, :3] = mean_rotation(truth, estimate) @ estimate.T_world_sensor[:, :3, :3]
    return PoseErrors.between(estimate.stamps_ns, truth.T_world_sensor, aligned)


def relative_errors(truth: Trajectory, estimate: Trajectory, pairs: NDArray[np.int64]) -> PoseErrors:
    """Errors of the motions between pairs (M, 2) of rows, earlier first; equal stamps in both."""
    motions = [
        np.array([inverse(poses[first]) @ poses[second] for first, second in pairs]).reshape(-1, 4, 4)
        for poses in (truth.T_world_sensor, estimate.T_world_sensor)
    ]
    return PoseErrors.between(estimate.stamps_ns[pairs[:, 1]], *motions)


def neighbours(known: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Pairs (M, 2) of successive frames that are both known, as rows among the known ones."""
    first = np.flatnonzero(np.diff(np.flatnonzero(known)) == 1)
    return np.column_stack((first, first + 1))


def one_second_apart(stamps_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Pairs (M, 2) of rows of ascending stamps (N,) that lie one second apart, or nearly."""
    wanted_ns = stamps_ns + NS_PER_S
    after = np.searchsorted(stamps_ns, wanted_ns)
    # The last second of a path has no partners: its end would stand in for them, and be too near.
    wanted_ns, after = wanted_ns[after < len(stamps_ns)], after[after < len(stamps_ns)]
    is_nearer = wanted_ns - stamps_ns[after - 1] < stamps_ns[after] - wanted_ns
    second = after - is_nearer
    first = np.flatnonzero(np.abs(stamps_ns[second] - wanted_ns) <= SECOND_SLACK_NS)
    return np.column_stack((first, second[first]))
