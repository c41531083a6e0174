# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The errors of a replayed recording, where it holds the truth."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from vigg_ros.report.accuracy import TrajectoryMetrics, measure_session
from vigg_ros.report.recording import Recording
from vigg_ros.report.trajectory import Trajectory, interpolate
from vigg_ros.sensors.observation import StampedPose
from vigg_ros.tracking.frame_result import FrameResult


def measure(recording: Recording) -> TrajectoryMetrics | None:
    """Accuracy of each session and of all; None without truth.

    Poses are compared as they are given: no extrinsic is applied between the frame that the truth
    follows and the sensor's (see ``truth_frame_note``).
    """
    if not recording.truth:
        return None
    truth = true_trajectory(recording.truth)
    received = Counter(record.session for record in recording.frames)
    estimates = estimated_trajectories(recording.frames)
    sessions = (measure_session(session, one, truth, received=received[session]) for session, one in estimates.items())
    return TrajectoryMetrics.of(list(sessions))


def true_trajectory(truth: Sequence[StampedPose]) -> Trajectory:
    """The truth as one trajectory, by stamp."""
    return Trajectory.of([pose.stamp_ns for pose in truth], [pose.T_frame_child for pose in truth])


def estimated_trajectories(frames: Sequence[FrameResult]) -> dict[int, Trajectory]:
    """The answered frames of each session, by stamp."""
    found = {}
    for session in sorted({record.session for record in frames}):
        answered = [record for record in frames if record.session == session and record.has_pose]
        stamps_ns = [record.stamp_ns for record in answered]
        found[session] = Trajectory.of(stamps_ns, [record.T_odom_frame for record in answered])
    return found


def why_no_errors(recording: Recording) -> str:
    """For a recording of which nothing could be measured: what is lacking."""
    if not recording.truth:
        return "no ground truth to compare with"
    truth = true_trajectory(recording.truth)
    estimates = estimated_trajectories(recording.answered).values()
    count = sum(int(interpolate(truth, estimate.stamps_ns)[1].sum()) for estimate in estimates)
    if count == 0:
        return "no answered frame has a true pose near its stamp"
    if count == 1:
        return "only 1 answered frame has a true pose; errors need two"
    return f"{count} answered frames have a true pose, but no two of one session; errors need two"


def truth_frame_note(recording: Recording) -> str:
    """A warning when the truth follows another frame than the sensor's; empty if not, or if nobody says."""
    followed = {pose.child_frame_id for pose in recording.truth} - {"", recording.frame_id}
    if not followed or not recording.frame_id:
        return ""
    return (
        f"the truth is that of {', '.join(sorted(followed))}, the poses are those of {recording.frame_id}; "
        "they are compared as they are, so a lever arm between the two counts as error"
    )
