# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far poses are from the truth; for a trajectory never without its coverage and its alignment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.evaluation.trajectory import Alignment, Trajectory, align, interpolate
from vigg_ros.registration.rigid import angle_rad, inverse

SECOND_NS = 1_000_000_000
SECOND_SLACK_NS = 100_000_000
"""Frames count as one second apart within this; slower cameras than 5 Hz may have none."""

MIN_PATH_M = 0.1
"""Drift as a share of a shorter path says nothing."""


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
        return {
            "median": self.median,
            "p95": self.p95,
            "max": self.maximum,
            "rmse": self.rmse,
            "count": self.count,
        }


@dataclass(frozen=True, slots=True)
class Errors:
    """Translation and rotation errors (N,) of the same poses or pairs of poses."""

    stamps_ns: NDArray[np.int64]
    """(N,); of a pair, the later stamp."""
    translation_m: NDArray[np.float64]
    rotation_deg: NDArray[np.float64]

    @classmethod
    def between(
        cls, stamps_ns: NDArray[np.int64], T_a: NDArray[np.float64], T_b: NDArray[np.float64]
    ) -> Errors:
        """The errors between motions (N, 4, 4) and others."""
        pairs = list(zip(T_a, T_b, strict=True))
        translation_m = np.array([translation_error_m(*pair) for pair in pairs])
        rotation_deg = np.array([rotation_error_deg(*pair) for pair in pairs])
        return cls(stamps_ns, translation_m, rotation_deg)

    @classmethod
    def pool(cls, parts: Sequence[Errors]) -> Errors:
        """All errors of several sessions, none weighted."""
        return cls(
            np.concatenate([np.empty(0, np.int64), *(part.stamps_ns for part in parts)]),
            np.concatenate([np.empty(0), *(part.translation_m for part in parts)]),
            np.concatenate([np.empty(0), *(part.rotation_deg for part in parts)]),
        )

    def as_dict(self) -> dict[str, Any]:
        """For metrics.json."""
        return {
            "translation_m": Spread.of(self.translation_m).as_dict(),
            "rotation_deg": Spread.of(self.rotation_deg).as_dict(),
        }


@dataclass(frozen=True, slots=True)
class Accuracy:
    """What is known of a trajectory's errors, and of how much of it that is known."""

    received: int
    """Frames received."""
    answered: int
    """Frames that got a pose."""
    alignment: str
    """How the trajectories were aligned; empty where nothing could be compared."""
    absolute: Errors
    """ATE: of each answered frame whose true pose is known, after alignment."""
    consecutive: Errors
    """RPE: of the motion from one answered frame to the next."""
    per_second: Errors
    """RPE: of the motion over one second."""
    path_m: float
    """Length of the true path through the compared frames."""
    end_error_m: float
    """TE of the motion from the first to the last compared frame."""

    @property
    def coverage(self) -> float:
        """Frames answered over frames received; 0 without frames."""
        return self.answered / self.received if self.received else 0.0

    @property
    def compared(self) -> int:
        """Answered frames whose true pose is known."""
        return len(self.absolute.stamps_ns)

    @property
    def drift_percent(self) -> float:
        """The error at the end of the path, in percent of the path; NaN for paths under MIN_PATH_M."""
        return 100 * self.end_error_m / self.path_m if self.path_m >= MIN_PATH_M else float("nan")

    def as_dict(self) -> dict[str, Any]:
        """For metrics.json; NaN where nothing is known."""
        return {
            "frames_received": self.received,
            "frames_answered": self.answered,
            "coverage": self.coverage,
            "frames_compared": self.compared,
            "alignment": self.alignment,
            "absolute": self.absolute.as_dict(),
            "relative_consecutive": self.consecutive.as_dict(),
            "relative_1s": self.per_second.as_dict(),
            "path_m": self.path_m,
            "end_error_m": self.end_error_m,
            "drift_percent": self.drift_percent,
        }


@dataclass(frozen=True, slots=True)
class SessionMetrics:
    """One session: a trajectory with one odometry frame."""

    session: int
    alignment: Alignment | None
    """None where fewer than two frames could be compared."""
    accuracy: Accuracy


@dataclass(frozen=True, slots=True)
class TrajectoryMetrics:
    """Sessions, each aligned by itself, and all of them together."""

    sessions: tuple[SessionMetrics, ...]
    pooled: Accuracy

    @classmethod
    def of(cls, sessions: Sequence[SessionMetrics]) -> TrajectoryMetrics:
        """Pools errors, not averages of them; paths and the errors at their ends are summed."""
        parts = [session.accuracy for session in sessions]
        alignments = list(dict.fromkeys(part.alignment for part in parts if part.alignment))
        several = ", each session by itself" if len(parts) > 1 and alignments else ""
        pooled = Accuracy(
            received=sum(part.received for part in parts),
            answered=sum(part.answered for part in parts),
            alignment=" or ".join(alignments) + several,
            absolute=Errors.pool([part.absolute for part in parts]),
            consecutive=Errors.pool([part.consecutive for part in parts]),
            per_second=Errors.pool([part.per_second for part in parts]),
            path_m=sum(part.path_m for part in parts),
            end_error_m=sum(part.end_error_m for part in parts),
        )
        return cls(tuple(sessions), pooled)

    def as_dict(self) -> dict[str, Any]:
        """For metrics.json."""
        sessions = [{"session": one.session, **one.accuracy.as_dict()} for one in self.sessions]
        return {**self.pooled.as_dict(), "sessions": sessions}


def measure_session(
    session: int, estimate: Trajectory, truth: Trajectory, *, received: int
) -> SessionMetrics:
    """Compare the answered frames of a session with the truth, where it is known.

    A single frame is not compared: aligned, it has no error.
    """
    known_truth, known = interpolate(truth, estimate.stamps_ns)
    compared = estimate.select(known)
    if len(compared) < 2:
        nothing = Errors.pool([])
        accuracy = Accuracy(received, len(estimate), "", nothing, nothing, nothing, 0.0, 0.0)
        return SessionMetrics(session, None, accuracy)
    alignment = align(known_truth, compared)
    aligned = compared.moved(alignment.T_truth_estimate)
    last = len(compared) - 1
    accuracy = Accuracy(
        received=received,
        answered=len(estimate),
        alignment=alignment.words,
        absolute=Errors.between(compared.stamps_ns, known_truth.T_world_sensor, aligned.T_world_sensor),
        consecutive=relative_errors(known_truth, compared, neighbours(known)),
        per_second=relative_errors(known_truth, compared, one_second_apart(compared.stamps_ns)),
        path_m=known_truth.length_m,
        end_error_m=float(relative_errors(known_truth, compared, np.array([[0, last]])).translation_m[0]),
    )
    return SessionMetrics(session, alignment, accuracy)


def relative_errors(truth: Trajectory, estimate: Trajectory, pairs: NDArray[np.int64]) -> Errors:
    """Errors of the motions between pairs (M, 2) of rows, earlier first; equal stamps in both."""
    motions = [
        np.array([inverse(poses[first]) @ poses[second] for first, second in pairs]).reshape(-1, 4, 4)
        for poses in (truth.T_world_sensor, estimate.T_world_sensor)
    ]
    return Errors.between(estimate.stamps_ns[pairs[:, 1]], *motions)


def neighbours(known: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Pairs (M, 2) of successive frames that are both known, as rows among the known ones."""
    first = np.flatnonzero(np.diff(np.flatnonzero(known)) == 1)
    return np.column_stack((first, first + 1))


def one_second_apart(stamps_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Pairs (M, 2) of rows of ascending stamps (N,) that lie one second apart, or nearly."""
    wanted_ns = stamps_ns + SECOND_NS
    after = np.searchsorted(stamps_ns, wanted_ns)
    # The last second of a path has no partners: its end would stand in for them, and be too near.
    wanted_ns, after = wanted_ns[after < len(stamps_ns)], after[after < len(stamps_ns)]
    is_nearer = wanted_ns - stamps_ns[after - 1] < stamps_ns[after] - wanted_ns
    second = after - is_nearer
    first = np.flatnonzero(np.abs(stamps_ns[second] - wanted_ns) <= SECOND_SLACK_NS)
    return np.column_stack((first, second[first]))
