# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What became of one frame: the one record that goes to files, report, status, bag and topics."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.features import Features
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.result import Evidence, Outcome, Registration
from vigg_ros.sensors.observation import Note
from vigg_ros.tracking.keyframes import Keyframe


class State(str, Enum):
    """What a result is worth, or why a frame was not given to the Registrar."""

    STARTED = "STARTED"
    """The first usable frame of a session: it defines the odometry frame."""
    TRACKING = "TRACKING"
    RELOCALISED = "RELOCALISED"
    """Found again against a keyframe other than the reference; the pose may step by the drift in between."""
    LOST = "LOST"
    """No pose; ``outcome`` says why."""
    REFUSED = "REFUSED"
    """An input that could not be used."""
    DROPPED = "DROPPED"
    """Online: a newer frame arrived while this one waited."""
    DISCARDED = "DISCARDED"
    """Online: a reset came while it waited or was being registered."""
    SKIPPED = "SKIPPED"
    """Online: it came sooner than ``max_rate`` allows."""
    PAUSED = "PAUSED"

    @property
    def was_registered(self) -> bool:
        """Whether the Registrar was asked."""
        return self in (State.STARTED, State.TRACKING, State.RELOCALISED, State.LOST)


@dataclass(frozen=True, slots=True)
class Comparison:
    """What was compared: for pictures, clouds, and for looking into a failure."""

    frame: Frame
    features: Features
    keyframe: Keyframe | None
    """What ``outcome`` refers to, features included; None where there was nothing to compare with."""


@dataclass(frozen=True, slots=True)
class FrameResult:
    """The answer to one leading message: every one gets exactly one."""

    stamp_ns: int
    session: int
    """Results of different sessions have no odometry frame in common."""
    state: State
    reason: str = ""
    """Why there is no pose: a Reason of registration or the code of a refused input; empty if there is one."""
    message: str = ""
    """One sentence: what was found and what was expected; of a start, why it was necessary."""
    frame_id: str = ""
    """The coordinate frame of the sensor: of the camera with depth images, of the scanner with points."""
    T_odom_frame: NDArray[np.float64] | None = None
    """(4, 4): p_odom = T_odom_frame @ p_frame, metres; None without a pose."""
    covariance: NDArray[np.float64] | None = None
    """(6, 6) of T_odom_frame as geometry_msgs/PoseWithCovariance orders it: x y z (m), then rotation about x y z (rad),
    along the axes of the odometry frame. It grows along the chain of keyframes."""
    keyframe_id: int | None = None
    """The reference of ``outcome``; the frame's own at the start; None while there is none."""
    keyframe_stamp_ns: int | None = None
    """When that reference was taken: a frame can be made one later, when the next one needs it."""
    new_keyframe: bool = False
    """Whether this frame became the reference of the following ones."""
    outcome: Outcome | None = None
    """The registration against that keyframe or the rejection by the reference; None at the start."""
    timings_ms: dict[str, float] = field(default_factory=dict)
    """Milliseconds per stage; online also waiting and building, and ``total`` from arrival to answer."""
    notes: tuple[Note, ...] = ()
    """What tracking found odd, or did by itself."""
    compared: Comparison | None = None
    """None where nothing was, and once the result is kept; see ``kept``."""

    @property
    def has_pose(self) -> bool:
        """Whether the frame got a pose."""
        return self.T_odom_frame is not None

    @property
    def evidence(self) -> Evidence | None:
        """What spoke for or against the answer; None where nothing was registered."""
        return None if self.outcome is None else self.outcome.evidence

    def kept(self) -> FrameResult:
        """The result without images, clouds and matched pixels: a few hundred bytes, of which a replay keeps all."""
        outcome = self.outcome
        if isinstance(outcome, Registration):
            outcome = replace(outcome, visual_inliers_px=outcome.visual_inliers_px[:0].copy())
        return replace(self, compared=None, outcome=outcome)
