# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A replayed bag: what the report and the files are made from."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from vigg_ros.pipeline import Pipeline
from vigg_ros.registration.errors import DataError
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
            if role == "ground_truth":
                self._take_truth(message)
            else:
                yield from self._pipeline.feed(role, message)
        yield from self._pipeline.flush()

    def _take_truth(self, message: Any) -> None:
        try:
            self.truth.append(decode_pose(message))
        except DataError as error:
            self._pipeline.refused[error.code] += 1
