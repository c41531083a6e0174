# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the sensor went, as far as it is known: what a map of a replay shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.rigid import inverse
from vigg_ros.report.accuracy import TrajectoryMetrics
from vigg_ros.report.ground_truth import true_trajectory
from vigg_ros.report.recording import Recording
from vigg_ros.report.series import positions, time_axis
from vigg_ros.report.trajectory import Alignment, Trajectory, interpolate
from vigg_ros.tracking.frame_result import FrameResult


@dataclass(frozen=True, slots=True)
class Route:
    """One session's way, all in its odometry frame, metres."""

    session: int
    at: NDArray[np.float64]
    """(N,) of each frame, on the axis of time."""
    estimate: NDArray[np.float64]
    """(N, 3), NaN where there was no answer."""
    truth: NDArray[np.float64]
    """(N, 3), aligned, NaN where it is not known."""
    keyframes: NDArray[np.bool_]
    """(N,)"""

    @property
    def lost(self) -> NDArray[np.bool_]:
        """(N,) frames without an answer of which the true position is known."""
        return np.isnan(self.estimate[:, 0]) & ~np.isnan(self.truth[:, 0])


def find_routes(recording: Recording, metrics: TrajectoryMetrics | None) -> list[Route]:
    """The routes of the sessions that have an answered frame, the longest first."""
    axis = time_axis(recording.frames)
    truth = true_trajectory(recording.truth)
    alignments = {one.session: one.alignment for one in metrics.sessions} if metrics is not None else {}
    found = []
    for session in sorted({record.session for record in recording.answered}):
        rows = [row for row, record in enumerate(recording.frames) if record.session == session]
        frames = [recording.frames[row] for row in rows]
        known = _true_positions(frames, truth, alignments.get(session))
        keyframes = np.array([record.new_keyframe for record in frames])
        found.append(Route(session, axis.values[rows], positions(frames), known, keyframes))
    return sorted(found, key=lambda route: -np.count_nonzero(~np.isnan(route.estimate[:, 0])))


def frame_errors(recording: Recording, metrics: TrajectoryMetrics) -> NDArray[np.float64]:
    """Translation error (m) and rotation error (deg) after alignment (N, 2); NaN for frames not compared."""
    known = {}
    for one in metrics.sessions:
        errors = one.accuracy.absolute
        for stamp_ns, *pair in zip(errors.stamps_ns, errors.translation_m, errors.rotation_deg, strict=True):
            known[one.session, int(stamp_ns)] = pair
    unknown = [np.nan, np.nan]
    rows = [known.get((r.session, r.stamp_ns), unknown) if r.has_pose else unknown for r in recording.frames]
    return np.array(rows).reshape(-1, 2)


def choose_plan(points: NDArray[np.float64]) -> tuple[int, int, int]:
    """The axes to the right and upwards of a map, and the axis out of it: the one with the least extent.

    Of equal ones y: in a camera's frame it points down.
    """
    known = points[~np.isnan(points).any(axis=1)]
    extent = np.ptp(known, axis=0) if len(known) else np.zeros(3)
    height = min((1, 2, 0), key=lambda axis: float(extent[axis]))
    right, up = (axis for axis in range(3) if axis != height)
    return right, up, height


def _true_positions(
    frames: Sequence[FrameResult], truth: Trajectory, alignment: Alignment | None
) -> NDArray[np.float64]:
    """True positions (N, 3) of frames in the odometry frame; NaN where they are not known."""
    stamps_ns, place = np.unique([record.stamp_ns for record in frames], return_inverse=True)
    at_stamps = np.full((len(stamps_ns), 3), np.nan)
    if alignment is not None:
        found, known = interpolate(truth.moved(inverse(alignment.T_truth_estimate)), stamps_ns)
        at_stamps[known] = found.positions
    return at_stamps[place]
