# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recording as series over time and ways in space: what the plots of a bounded size show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.rigid import inverse
from vigg_ros.report.accuracy import TrajectoryMetrics
from vigg_ros.report.recording import Recording, true_trajectory
from vigg_ros.report.trajectory import Alignment, Trajectory, interpolate
from vigg_ros.tracking.frame_result import FrameResult, State

STRIP_COLUMNS = 800
"""Columns of a strip: about the pixels that it is shown on."""

NO_FRAME, TRACKING, RELOCALISED, REFUSED, LOST = range(5)
"""What a column shows; where several frames share it, the one that matters most."""

_KINDS = {State.RELOCALISED: RELOCALISED, State.REFUSED: REFUSED, State.LOST: LOST}

LONG_GAP = 5.0
"""A frame stands for the time to the next one, but not for more than so many usual intervals."""


@dataclass(frozen=True, slots=True)
class Axis:
    """Where each frame (N,), at least one, stands on the axis of time."""

    values: NDArray[np.float64]
    is_time: bool
    """Seconds since the first frame; else frame numbers."""

    @property
    def range(self) -> tuple[float, float]:
        """From the first frame to the end of the last one."""
        return float(self.values[0]), float(self.values[-1]) + self.step

    def place(self, frame: int) -> str:
        """Where a frame stands, in words."""
        value = self.values[frame]
        return f"{value:.2f} s" if self.is_time else f"frame {value:.0f}"

    @property
    def label(self) -> str:
        """For the axis of a plot."""
        return "time (s)" if self.is_time else "frame, in order of arrival"

    @property
    def step(self) -> float:
        """The usual distance of two frames; 1 where there is none."""
        steps = np.diff(self.values)
        return float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0


def time_axis(frames: Sequence[FrameResult]) -> Axis:
    """Seconds since the first frame; frame numbers where the clock does not run forward.

    The stamps of refused images prove nothing (they may be the very reason): each is kept only as far as
    it lies between those of the frames around it, or as near to the first or last as their number allows.
    """
    stamps = np.array([record.stamp_ns for record in frames], np.int64)
    good = np.array([record.state is not State.REFUSED for record in frames], bool)
    if not good.any() or (np.diff(stamps[good]) < 0).any():
        return Axis(np.arange(len(frames), dtype=np.float64), is_time=False)
    rows = np.flatnonzero(good)
    usual_ns = int(np.median(np.diff(stamps[rows]))) if len(rows) > 1 else 0
    start = stamps[rows[0]] - rows[0] * usual_ns
    end = stamps[rows[-1]] + (len(frames) - 1 - rows[-1]) * usual_ns
    before = np.maximum.accumulate(np.where(good, stamps, start))
    after = np.minimum.accumulate(np.where(good, stamps, end)[::-1])[::-1]
    at = np.maximum.accumulate(np.clip(stamps, before, after))
    return Axis((at - at[0]) / 1e9, is_time=True)


def state_columns(frames: Sequence[FrameResult], axis: Axis) -> NDArray[np.int64]:
    """What each of STRIP_COLUMNS equal parts of the axis shows, NO_FRAME to LOST."""
    columns = np.zeros(STRIP_COLUMNS, np.int64)
    start, end = axis.range
    ends = np.minimum(np.append(axis.values[1:], end), axis.values + LONG_GAP * axis.step)
    scale = STRIP_COLUMNS / (end - start)
    first = np.minimum(((axis.values - start) * scale).astype(int), STRIP_COLUMNS - 1)
    last = np.maximum(((ends - start) * scale).astype(int), first + 1)
    for record, a, b in zip(frames, first, last, strict=True):
        columns[a:b] = np.maximum(columns[a:b], _KINDS.get(record.state, TRACKING))
    return columns


def runs(columns: NDArray[np.int64], axis: Axis) -> list[tuple[int, float, float]]:
    """Runs of equal columns as (value, start, width) on the axis."""
    start, end = axis.range
    width = (end - start) / len(columns)
    edges = np.flatnonzero(np.diff(columns)) + 1
    begins, ends = np.append(0, edges), np.append(edges, len(columns))
    return [(int(columns[a]), start + a * width, (b - a) * width) for a, b in zip(begins, ends, strict=True)]


def evidence_series(frames: Sequence[FrameResult], name: str) -> NDArray[np.float64]:
    """One figure of the evidence (N,), NaN where there is none."""
    return np.array([np.nan if record.evidence is None else float(getattr(record.evidence, name)) for record in frames])


def positions(frames: Sequence[FrameResult]) -> NDArray[np.float64]:
    """Positions (N, 3), metres, in the odometry frame of each one's session; NaN for unanswered frames."""
    rows = [np.full(3, np.nan) if r.T_odom_frame is None else r.T_odom_frame[:3, 3] for r in frames]
    return np.array(rows).reshape(-1, 3)


def totals_ms(frames: Sequence[FrameResult]) -> NDArray[np.float64]:
    """Milliseconds of all stages together of each frame (M,) that got as far as any stage."""
    return np.array([sum(record.timings_ms.values()) for record in frames if record.timings_ms])


def stage_times_ms(frames: Sequence[FrameResult]) -> dict[str, NDArray[np.float64]]:
    """Milliseconds (M,) of each stage, 0 where a frame did not come to it, in order of first use."""
    timed = [record.timings_ms for record in frames if record.timings_ms]
    stages = dict.fromkeys(stage for timings_ms in timed for stage in timings_ms)
    return {stage: np.array([timings_ms.get(stage, 0.0) for timings_ms in timed]) for stage in stages}


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
