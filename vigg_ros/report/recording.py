# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A replayed bag: what the report and the files are made from, and its errors where it holds the truth."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from vigg_ros.pipeline import Pipeline
from vigg_ros.registration.errors import DataError
from vigg_ros.report.accuracy import TrajectoryMetrics, measure_session
from vigg_ros.report.trajectory import Trajectory, interpolate
from vigg_ros.sensors.input_decoder import Role
from vigg_ros.sensors.observation import StampedPose
from vigg_ros.sensors.stamped_pose import decode_pose
from vigg_ros.tracking.frame_result import FrameResult

LEADING_MESSAGES = {"image": "colour images", "points": "scans"}
"""By role: the messages of which each becomes a frame, in words."""


@dataclass(frozen=True, slots=True)
class Recording:
    """A replayed bag: what was received, what was answered, and what is known of the truth."""

    name: str
    frames: Sequence[FrameResult]
    """In order of arrival at the Registrar, without images (``FrameResult.kept``)."""
    truth: Sequence[StampedPose]
    """Poses of the sensor by an independent source; empty if there is none."""
    refused: Counter[str]
    """Refused messages of any topic, by code, e.g. broken depth images."""
    notes: Sequence[str]
    """What a user should know: odd inputs that were accepted, losses of the bag."""
    leaders: str = LEADING_MESSAGES["image"]
    """The messages of which each became a frame, in words."""

    @property
    def answered(self) -> list[FrameResult]:
        """The frames that got a pose."""
        return [result for result in self.frames if result.has_pose]

    @property
    def coverage(self) -> float:
        """Frames answered over frames received; 0 without frames."""
        return len(self.answered) / len(self.frames) if self.frames else 0.0

    @property
    def frame_id(self) -> str:
        """The sensor's coordinate frame, as the last messages name it; empty without frames."""
        return next((result.frame_id for result in reversed(self.frames) if result.state.was_registered), "")


class Replay:
    """A loop over a pipeline in which every frame is processed; the truth goes beside it."""

    def __init__(self, pipeline: Pipeline) -> None:
        self._pipeline = pipeline
        self.truth: list[StampedPose] = []

    def run(self, messages: Iterable[tuple[Role, Any]]) -> Iterator[FrameResult]:
        """A result for each leading message, in the order in which they are settled."""
        for role, message in messages:
            if role != "ground_truth":
                yield from self._pipeline.finish(self._pipeline.receive(role, message).found)
                continue
            try:
                pose = decode_pose(message)
            except DataError as error:
                self._pipeline.refused[error.code] += 1
                continue
            self.truth.append(pose)
            for note in pose.notes:
                self._pipeline.notes.setdefault((role, note.code), note)
        yield from self._pipeline.finish(self._pipeline.remaining())


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
