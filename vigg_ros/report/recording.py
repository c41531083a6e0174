# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What became of each frame of a recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.result import Evidence, Registration, Rejection
from vigg_ros.sensors.observation import StampedPose
from vigg_ros.tracking.registrar import Estimate

COLOUR_IMAGES, SCANS = "colour images", "scans"


@dataclass(frozen=True, slots=True)
class FrameRecord:
    """One frame that was received: a colour image with depth images, a scan with points."""

    stamp_ns: int
    session: int
    state: str
    """A ``State``, or REFUSED for an input that never became a frame."""
    reason: str
    """Why there is no pose: a Reason of registration, or the code of a refused input; empty if there is one."""
    message: str
    keyframe_id: int | None
    new_keyframe: bool
    T_odom_frame: NDArray[np.float64] | None
    covariance: NDArray[np.float64] | None
    T_keyframe_frame: NDArray[np.float64] | None
    evidence: Evidence | None
    timings_ms: dict[str, float]
    """Milliseconds per stage; decode and pairing are not in it."""
    keyframe_stamp_ns: int | None = None

    @property
    def is_answered(self) -> bool:
        """Whether the frame got a pose."""
        return self.T_odom_frame is not None

    @classmethod
    def of_estimate(cls, estimate: Estimate) -> FrameRecord:
        """The record of a frame that was given to the Registrar."""
        outcome = estimate.outcome
        rejected = outcome if isinstance(outcome, Rejection) else None
        answer = outcome if isinstance(outcome, Registration) else None
        return cls(
            stamp_ns=estimate.stamp_ns,
            session=estimate.session,
            state=estimate.state.value,
            reason="" if rejected is None else rejected.reason.value,
            message="" if rejected is None else rejected.message,
            keyframe_id=estimate.keyframe_id,
            new_keyframe=estimate.new_keyframe,
            T_odom_frame=estimate.T_odom_frame,
            covariance=estimate.covariance,
            T_keyframe_frame=None if answer is None else answer.T_target_source,
            evidence=None if outcome is None else outcome.evidence,
            timings_ms=estimate.timings_ms,
            keyframe_stamp_ns=estimate.keyframe_stamp_ns,
        )

    @classmethod
    def of_refusal(cls, stamp_ns: int, session: int, code: str, message: str) -> FrameRecord:
        """The record of an image that never became a frame."""
        return cls(stamp_ns, session, "REFUSED", code, message, None, False, None, None, None, None, {})


@dataclass(frozen=True, slots=True)
class Recording:
    """A replayed bag: what was received, what was answered, and what is known of the truth."""

    name: str
    frames: Sequence[FrameRecord]
    """In order of arrival at the Registrar."""
    truth: Sequence[StampedPose]
    """Poses of the sensor by an independent source; empty if there is none."""
    refused: Counter[str]
    """Refused messages of any topic, by code, e.g. broken depth images."""
    notes: Sequence[str]
    """What a user should know: odd inputs that were accepted, losses of the bag."""
    frame_id: str = ""
    """The sensor's coordinate frame, as the messages name it."""
    leaders: str = COLOUR_IMAGES
    """The messages of which each became a frame: COLOUR_IMAGES or SCANS."""

    @property
    def answered(self) -> list[FrameRecord]:
        """The frames that got a pose."""
        return [record for record in self.frames if record.is_answered]

    @property
    def coverage(self) -> float:
        """Frames answered over frames received; 0 without frames."""
        return len(self.answered) / len(self.frames) if self.frames else 0.0


