# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The frames that were sent to a node, and what it answered to each."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.rigid import inverse
from vigg_ros.report.trajectory import Trajectory, interpolate
from vigg_ros.tracking.frame_result import State

Matrix = NDArray[np.float64]

_POSE_FOLLOWS = {"", State.STARTED.value, State.TRACKING.value, State.RELOCALISED.value}
"""States of a frame whose pose, where there is none yet, is still to come."""


@dataclass(slots=True)
class LiveFrame:
    """A frame whose leading message was published. Times are on the monotonic clock."""

    sent_s: float
    T_world_frame: Matrix | None = None
    """The true pose (4, 4); None where it is not known."""
    state: str = ""
    """As the node says; empty as long as it says nothing."""
    reason: str = ""
    received_s: float = float("nan")
    T_odom_frame: Matrix | None = None
    """The answered pose (4, 4); None without one."""


class LiveFrames:
    """All frames of a run, in the order of sending."""

    def __init__(self, truth: Trajectory | None) -> None:
        self.all: list[LiveFrame] = []
        self.heard_s = 0.0
        """When something was last heard of a frame."""
        self._truth = truth
        self._by_stamp: dict[int, LiveFrame] = {}
        """The latest: a bag that was recorded from a loop holds a stamp several times."""

    def send(self, stamp_ns: int) -> None:
        """A leading message is published now."""
        T_world_frame = None
        if self._truth is not None:
            known, is_known = interpolate(self._truth, np.array([stamp_ns], np.int64))
            T_world_frame = known.T_world_sensor[0] if is_known[0] else None
        frame = self._by_stamp[stamp_ns] = LiveFrame(time.monotonic(), T_world_frame)
        self.all.append(frame)

    def take_pose(self, stamp_ns: int, T_odom_frame: Matrix) -> None:
        """The node published a pose. What it says of frames that were not sent from here counts for nothing."""
        if stamp_ns in self._by_stamp:
            frame = self._by_stamp[stamp_ns]
            frame.received_s = self.heard_s = time.monotonic()
            frame.T_odom_frame = T_odom_frame

    def take_status(self, stamp_ns: int, state: str, reason: str) -> None:
        """The node published the status of a frame: before or after its pose."""
        if stamp_ns in self._by_stamp:
            frame = self._by_stamp[stamp_ns]
            frame.state, frame.reason, self.heard_s = state, reason, time.monotonic()

    @property
    def answered(self) -> list[LiveFrame]:
        """Those with a pose."""
        return [frame for frame in self.all if frame.T_odom_frame is not None]

    @property
    def failures(self) -> Counter[str]:
        """How many got no pose, by what the node says: state and reason."""
        failed = (frame for frame in self.all if frame.state not in _POSE_FOLLOWS and frame.T_odom_frame is None)
        return Counter(f"{frame.state} {frame.reason}".strip() for frame in failed)

    @property
    def dropped(self) -> int:
        """How many gave way to newer ones."""
        return sum(frame.state == State.DROPPED.value for frame in self.all)

    @property
    def pending(self) -> int:
        """Of how many there is neither a pose nor a reason (yet)."""
        return len(self.all) - len(self.answered) - self.failures.total()

    @property
    def duration_s(self) -> float:
        """From sending the first frame to sending the last one."""
        return self.all[-1].sent_s - self.all[0].sent_s if self.all else 0.0

    def position_errors_m(self) -> Matrix:
        """(M,): of the answered frames whose truth is known, both taken from the first one of their session."""
        errors_m = []
        first: tuple[Matrix, Matrix] | None = None
        for frame in self.all:
            if frame.state == State.STARTED.value:
                first = None
            if frame.T_odom_frame is not None and frame.T_world_frame is not None:
                first = first or (inverse(frame.T_odom_frame), inverse(frame.T_world_frame))
                difference = first[0] @ frame.T_odom_frame - first[1] @ frame.T_world_frame
                errors_m.append(np.linalg.norm(difference[:3, 3]))
        return np.array(errors_m)
