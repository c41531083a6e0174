# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The accuracy of a trajectory, never without its coverage and its alignment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vigg_ros.report.trajectory import Alignment, Trajectory, align, interpolate
from vigg_ros.report.trajectory_errors import (
    ROTATION_ALIGNMENT,
    PoseErrors,
    absolute_errors,
    neighbours,
    one_second_apart,
    relative_errors,
)

MIN_PATH_M = 0.1
"""Drift as a share of a shorter path says nothing."""


@dataclass(frozen=True, slots=True)
class Accuracy:
    """What is known of a trajectory's errors, and of how much of it that is known."""

    received: int
    """Frames received."""
    answered: int
    """Frames that got a pose."""
    alignment: str
    """How the trajectories were aligned; empty where nothing could be compared."""
    absolute: PoseErrors
    """ATE: of each answered frame whose true pose is known; the rotations see ROTATION_ALIGNMENT."""
    consecutive: PoseErrors
    """RPE: of the motion from one answered frame to the next."""
    per_second: PoseErrors
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
            "alignment_of_rotations": ROTATION_ALIGNMENT if self.compared else "",
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
            absolute=PoseErrors.pool([part.absolute for part in parts]),
            consecutive=PoseErrors.pool([part.consecutive for part in parts]),
            per_second=PoseErrors.pool([part.per_second for part in parts]),
            path_m=sum(part.path_m for part in parts),
            end_error_m=sum(part.end_error_m for part in parts),
        )
        return cls(tuple(sessions), pooled)

    def as_dict(self) -> dict[str, Any]:
        """For metrics.json."""
        sessions = [{"session": one.session, **one.accuracy.as_dict()} for one in self.sessions]
        return {**self.pooled.as_dict(), "sessions": sessions}


def measure_session(session: int, estimate: Trajectory, truth: Trajectory, *, received: int) -> SessionMetrics:
    """Compare the answered frames of a session with the truth, where it is known.

    A single frame is not compared: aligned, it has no error.
    """
    known_truth, known = interpolate(truth, estimate.stamps_ns)
    compared = estimate.select(known)
    if len(compared) < 2:
        nothing = PoseErrors.pool([])
        accuracy = Accuracy(received, len(estimate), "", nothing, nothing, nothing, 0.0, 0.0)
        return SessionMetrics(session, None, accuracy)
    alignment = align(known_truth, compared)
    ends = np.array([[0, len(compared) - 1]])
    accuracy = Accuracy(
        received=received,
        answered=len(estimate),
        alignment=alignment.words,
        absolute=absolute_errors(known_truth, compared, alignment),
        consecutive=relative_errors(known_truth, compared, neighbours(known)),
        per_second=relative_errors(known_truth, compared, one_second_apart(compared.stamps_ns)),
        path_m=known_truth.length_m,
        end_error_m=float(relative_errors(known_truth, compared, ends).translation_m[0]),
    )
    return SessionMetrics(session, alignment, accuracy)
