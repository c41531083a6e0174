# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Frames over time: each is registered against a reference keyframe, and its pose chained through it."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from vigg_ros.acceptance.checks import find_lack
from vigg_ros.registration.config import Config
from vigg_ros.registration.features import Features
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.result import Evidence, Outcome, Reason, Registration, Rejection
from vigg_ros.registration.stages import OutOfTime, record_stages, time_limit
from vigg_ros.registration.vigg import extract, register
from vigg_ros.tracking.chain import UncertainPose
from vigg_ros.tracking.deskew import MAX_INTERVAL_S, deskew, mean_skew_m, velocity
from vigg_ros.tracking.keyframes import Keyframe, KeyframeBuffer, is_far

MAX_SKEW_VOXELS = 0.1
"""Mean skew from which a scan is de-skewed again: well above what the noise of two poses feigns."""


class State(str, Enum):
    """What an estimate is worth."""

    STARTED = "STARTED"
    """The first usable frame: it defines the odometry frame."""
    TRACKING = "TRACKING"
    RELOCALISED = "RELOCALISED"
    """Found again against a keyframe other than the reference; the pose may step by the drift in between."""
    LOST = "LOST"
    """No pose; ``outcome`` says why."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """The answer to one frame."""

    stamp_ns: int
    state: State
    T_odom_frame: NDArray[np.float64] | None
    """(4, 4): p_odom = T_odom_frame @ p_frame, metres; None while lost."""
    keyframe_id: int | None
    """The reference of ``outcome``; the frame's own at the start; None while there is none."""
    outcome: Outcome | None
    """The registration against that keyframe or the rejection by the reference; None at the start."""
    covariance: NDArray[np.float64] | None
    """(6, 6) of T_odom_frame as geometry_msgs/PoseWithCovariance orders it; it grows along the chain."""
    timings_ms: dict[str, float]
    """Milliseconds per stage."""
    session: int
    """Estimates of different sessions have no odometry frame in common."""
    new_keyframe: bool
    """Whether this frame became the reference of the following ones."""
    keyframe_stamp_ns: int | None = None
    """When the reference of ``outcome`` was taken: a frame can be made one later, when the next one needs it."""


@dataclass(frozen=True, slots=True)
class Tracked:
    """The last frame that was tracked, and where."""

    frame: Frame
    features: Features
    pose: UncertainPose


@dataclass(frozen=True, slots=True)
class Attempt:
    """What the latest step compared: for pictures, and for looking into a failure."""

    frame: Frame
    features: Features
    keyframe: Keyframe | None
    """What ``outcome`` refers to, features included; None where there was nothing to compare with."""


class Registrar:
    """Holds the keyframes. Not safe for use from several threads at once."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._session = 0
        self._keyframe_requested = False
        self.reset(0)

    @property
    def reference(self) -> Keyframe | None:
        """The keyframe that the next frame is registered against first."""
        return self._keyframes.reference

    @property
    def session(self) -> int:
        """The session that the estimates belong to."""
        return self._session

    @property
    def attempt(self) -> Attempt | None:
        """What the latest step compared; None before the first one of a session."""
        return self._attempt

    def reset(self, session: int | None = None) -> None:
        """Forget everything: the next usable frame defines a new odometry frame, of this session or the next one."""
        self._session = self._session + 1 if session is None else session
        self._keyframes = KeyframeBuffer(self._config.keyframes)
        self._last: Tracked | None = None
        self._velocity: NDArray[np.float64] | None = None
        self._attempt: Attempt | None = None
        self._frames_lost = 0
        self._keyframe_requested = False

    def request_keyframe(self) -> None:
        """Let the next frame that is tracked become the reference, however near it is."""
        self._keyframe_requested = True

    def configure(self, config: Config) -> None:
        """Other options from the next frame on; keyframes keep the features they have."""
        self._config = config

    def step(self, frame: Frame, *, session: int | None = None) -> Estimate:
        """Register the next frame; a session other than the current one starts again."""
        if session is not None and session != self._session:
            self.reset(session)
        with record_stages() as timings_ms, time_limit(self._config.time_budget_s):
            self._velocity = self._velocity if self._is_recent(frame.stamp_ns) else None
            try:
                seen = self._look(frame, self._velocity)
            except OutOfTime as overrun:
                return self._give_up(frame, str(overrun), timings_ms)
            if self._keyframes.reference is None:
                self._attempt = seen
                return self._start(seen, timings_ms)
            state, keyframe, outcome = self._search(seen.features)
            if isinstance(outcome, Registration):
                with suppress(OutOfTime):  # then the answer before the correction stands
                    seen, keyframe, outcome = self._correct(frame, seen, keyframe, outcome)
        self._attempt = replace(seen, keyframe=keyframe)
        if isinstance(outcome, Rejection):
            self._frames_lost += 1
            return self._estimate(frame, State.LOST, keyframe, outcome, timings_ms)
        self._frames_lost = 0
        pose = _pose(keyframe, outcome)
        self._velocity = self._velocity_to(pose, frame.stamp_ns)
        self._last = Tracked(seen.frame, seen.features, pose)
        new_keyframe = self._keyframe_requested or is_far(outcome, self._config.keyframes)
        if new_keyframe:
            self._keyframe_requested = False
            self._keyframes.add(seen.frame, seen.features, pose)
        return self._estimate(frame, state, keyframe, outcome, timings_ms, pose=pose, new_keyframe=new_keyframe)

    def _give_up(self, frame: Frame, message: str, timings_ms: dict[str, float]) -> Estimate:
        """Of a frame whose time was up before there was anything to compare."""
        self._attempt = None
        self._frames_lost += 1
        rejection = Rejection(Reason.TIMEOUT, message, Evidence())
        return self._estimate(frame, State.LOST, self._keyframes.reference, rejection, timings_ms)

    def _look(self, frame: Frame, velocity_sensor: NDArray[np.float64] | None) -> Attempt:
        """Features of a frame, which is de-skewed where it can be."""
        if self._config.input.deskew:
            frame = deskew(frame, velocity_sensor)
        return Attempt(frame, extract(frame, self._config), None)

    def _correct(
        self, frame: Frame, seen: Attempt, keyframe: Keyframe, outcome: Registration
    ) -> tuple[Attempt, Keyframe, Registration]:
        """Register once more where the motion found shows that a scan was de-skewed for another one.

        So it is with the first two scans, before any motion is known, and where the motion changes suddenly.
        """
        found = self._velocity_to(_pose(keyframe, outcome), frame.stamp_ns)
        if found is None or self._last is None or not self._config.input.deskew:
            return seen, keyframe, outcome
        max_skew_m = MAX_SKEW_VOXELS * self._config.geometric.voxel_size_m
        better, straight = seen, keyframe
        if mean_skew_m(frame, found if self._velocity is None else found - self._velocity) > max_skew_m:
            better = self._look(frame, found)
        # Only of the last frame is the motion known now; one that was de-skewed has no times any more.
        if keyframe.frame is self._last.frame and mean_skew_m(keyframe.frame, found) > max_skew_m:
            looked = self._look(keyframe.frame, found)
            straight = replace(keyframe, frame=looked.frame, features=looked.features)
        if better is seen and straight is keyframe:
            return seen, keyframe, outcome
        again = register(straight.features, better.features, self._config)
        if isinstance(again, Rejection):
            return seen, keyframe, outcome
        self._keyframes.replace(keyframe, straight)
        return better, straight, again

    def _search(self, features: Features) -> tuple[State, Keyframe, Outcome]:
        """Against the reference; failing that the last frame, then other keyframes."""
        reference = self._keyframes.reference
        assert reference is not None, "the caller has checked"
        rejection = register(reference.features, features, self._config)
        if isinstance(rejection, Registration):
            return State.TRACKING, reference, rejection
        if self._frames_lost == 0 and self._last is not None and self._last.frame is not reference.frame:
            # The last frame was tracked, so it is a sound reference, and the nearest there is.
            outcome = register(self._last.features, features, self._config)
            if isinstance(outcome, Registration):
                last = self._keyframes.add(self._last.frame, self._last.features, self._last.pose)
                return State.TRACKING, last, outcome
        for keyframe in self._keyframes.others(self._position(), self._config.keyframes.retries, self._frames_lost):
            outcome = register(keyframe.features, features, self._config)
            if isinstance(outcome, Registration):
                self._keyframes.make_reference(keyframe)
                return State.RELOCALISED, keyframe, outcome
        return State.LOST, reference, rejection

    def _is_recent(self, stamp_ns: int) -> bool:
        """Whether the last tracked frame says how the sensor moves now."""
        return self._last is not None and 0 < stamp_ns - self._last.frame.stamp_ns <= MAX_INTERVAL_S * 1e9

    def _velocity_to(self, pose: UncertainPose, stamp_ns: int) -> NDArray[np.float64] | None:
        if self._last is None:
            return None
        before = self._last
        return velocity(before.pose.T_parent_child, pose.T_parent_child, stamp_ns - before.frame.stamp_ns)

    def _position(self) -> NDArray[np.float64]:
        return np.zeros(3) if self._last is None else self._last.pose.T_parent_child[:3, 3]

    def _start(self, seen: Attempt, timings_ms: dict[str, float]) -> Estimate:
        frame, features = seen.frame, seen.features
        lack = find_lack(features, features)
        if lack:
            rejection = Rejection(*lack, Evidence(keypoints=len(features.keypoints)))
            return self._estimate(frame, State.LOST, None, rejection, timings_ms)
        pose = UncertainPose.identity()
        keyframe = self._keyframes.add(frame, features, pose)
        self._last = Tracked(frame, features, pose)
        return self._estimate(frame, State.STARTED, keyframe, None, timings_ms, pose=pose, new_keyframe=True)

    def _estimate(
        self,
        frame: Frame,
        state: State,
        keyframe: Keyframe | None,
        outcome: Outcome | None,
        timings_ms: dict[str, float],
        *,
        pose: UncertainPose | None = None,
        new_keyframe: bool = False,
    ) -> Estimate:
        return Estimate(
            stamp_ns=frame.stamp_ns,
            state=state,
            T_odom_frame=None if pose is None else pose.T_parent_child,
            keyframe_id=None if keyframe is None else keyframe.id,
            keyframe_stamp_ns=None if keyframe is None else keyframe.frame.stamp_ns,
            outcome=outcome,
            covariance=None if pose is None else pose.covariance,
            timings_ms=timings_ms,
            session=self._session,
            new_keyframe=new_keyframe,
        )


def _pose(keyframe: Keyframe, outcome: Registration) -> UncertainPose:
    """The pose of the frame that was registered against a keyframe."""
    return keyframe.pose.compose(UncertainPose(outcome.T_target_source, outcome.covariance))
