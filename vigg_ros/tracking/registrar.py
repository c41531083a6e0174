# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Frames over time: each is registered against a reference keyframe, and its pose chained through it."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vigg_ros.acceptance.checks import frame_objection
from vigg_ros.registration.config import Config
from vigg_ros.registration.features import Features
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.result import Evidence, Outcome, Reason, Registration, Rejection
from vigg_ros.registration.stages import OutOfTime, record_stages, time_limit
from vigg_ros.registration.vigg import extract, register
from vigg_ros.sensors.header import NS_PER_S
from vigg_ros.sensors.observation import Note
from vigg_ros.tracking.chain import MAX_INTERVAL_S, UncertainPose
from vigg_ros.tracking.deskew import deskew, mean_skew_m, velocity
from vigg_ros.tracking.frame_result import Comparison, FrameResult, State
from vigg_ros.tracking.keyframes import Keyframe, KeyframeBuffer, is_far
from vigg_ros.tracking.own_body import OwnBody, body_note
from vigg_ros.tracking.stamp_error import displacement, stamp_covariance

MAX_SKEW_VOXELS = 0.1
"""Mean skew from which a scan is de-skewed again: well above what the noise of two poses explains."""

UNUSABLE_FRAME = (Reason.NO_TEXTURE, Reason.NO_DEPTH)
"""Reasons that lie in the frame itself, whatever it is compared with (acceptance.checks.frame_objection)."""


@dataclass(frozen=True, slots=True)
class TrackedFrame:
    """The last frame that was tracked, and where."""

    frame: Frame
    features: Features
    pose: UncertainPose
    displacement: NDArray[np.float64]
    """(6,); see ``stamp_error``."""


class Registrar:
    """Holds the keyframes. Not safe for use from several threads at once."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._input_session = 0
        self.own_sessions = 0
        """Sessions that began because no pose was found for too long."""
        self.reset(0)

    @property
    def reference(self) -> Keyframe | None:
        """The keyframe that the next frame is registered against first."""
        return self._keyframes.reference

    @property
    def session(self) -> int:
        """The session that the results belong to: that of the input, plus those that began by themselves.

        As neither number falls, no two sessions have one number, in whatever order they begin.
        """
        return self._input_session + self.own_sessions

    def reset(self, session: int | None = None) -> None:
        """Forget everything: the next usable frame defines a new odometry frame, of this session of the input or the
        next one."""
        self._input_session = self._input_session + 1 if session is None else session
        self._own_body = OwnBody()
        self._forget_poses()

    def _forget_poses(self) -> None:
        self._own_body.forget_views()
        self._keyframes = KeyframeBuffer(self._config.keyframes)
        self._last: TrackedFrame | None = None
        self._velocity: NDArray[np.float64] | None = None
        self._answered_ns = 0
        self._frames_lost = 0
        self._searches = 0
        self._keyframe_requested = False

    def request_keyframe(self) -> None:
        """Let the next frame that is tracked become the reference, however near it is."""
        self._keyframe_requested = True

    def configure(self, config: Config) -> None:
        """Other options from the next frame on; keyframes keep the features they have."""
        self._config = config

    def step(self, frame: Frame, *, session: int | None = None) -> FrameResult:
        """Register the next frame; a session of the input other than the current one starts again."""
        if session is not None and session != self._input_session:
            self.reset(session)
        with record_stages() as timings_ms, time_limit(self._config.time_budget_s):
            self._velocity = self._velocity if self._is_recent(frame.stamp_ns) else None
            try:
                seen = self._extract(self._without_body(frame), self._velocity)
                result = self._start(seen) if self.reference is None else self._track(frame, seen)
            except OutOfTime as overrun:
                result = self._lost(frame, self.reference, Rejection(Reason.TIMEOUT, str(overrun), Evidence()))
        return replace(result, timings_ms=timings_ms)

    def _start(self, seen: Comparison) -> FrameResult:
        """Take the first usable frame as the first keyframe, of a new session if there is one already."""
        features = seen.features
        objection = frame_objection(features, features, self._config)
        if objection:
            return self._lost(seen, None, Rejection(*objection, Evidence(keypoints=len(features.keypoints))))
        message = ""
        notes: tuple[Note, ...] = ()
        if self.reference is not None:
            lost_s = (seen.frame.stamp_ns - self._answered_ns) / NS_PER_S
            message, notes = f"lost for {lost_s:.1f} s: a new session starts", (_lost_note(lost_s),)
            self.own_sessions += 1
            self._forget_poses()
        pose = UncertainPose.identity()
        keyframe = self._keyframes.add(seen.frame, features, pose, np.zeros(6))
        self._last = TrackedFrame(seen.frame, features, pose, np.zeros(6))
        self._answered_ns = seen.frame.stamp_ns
        started = self._found(seen, State.STARTED, keyframe, None, pose, new_keyframe=True)
        return replace(started, message=message, notes=notes)

    def _track(self, frame: Frame, seen: Comparison) -> FrameResult:
        """The pose by the reference or another keyframe; a new session after too long without one."""
        # Within a time budget a last search could leave no time for a start, frame after frame.
        if self._config.time_budget_s > 0 and self._has_given_up(frame.stamp_ns):
            return self._start(seen)
        state, keyframe, outcome = self._search(seen.features)
        if isinstance(outcome, Rejection):
            lost = self._lost(seen, keyframe, outcome)
            is_usable = outcome.reason not in UNUSABLE_FRAME
            return self._start(seen) if is_usable and self._has_given_up(frame.stamp_ns) else lost
        with suppress(OutOfTime):  # then the answer before the correction stands
            seen, keyframe, outcome = self._correct(frame, seen, keyframe, outcome)
        self._frames_lost = self._searches = 0
        self._answered_ns = frame.stamp_ns
        pose = _pose(keyframe, outcome)
        self._velocity = self._velocity_to(pose, frame.stamp_ns)
        moved = displacement(seen.frame, self._velocity)
        of_stamps = stamp_covariance(outcome.T_target_source, keyframe.displacement, moved)
        outcome = replace(outcome, covariance=outcome.covariance + of_stamps)
        pose = _pose(keyframe, outcome)
        self._last = TrackedFrame(seen.frame, seen.features, pose, moved)
        new_keyframe = self._keyframe_requested or is_far(outcome, self._config.keyframes)
        if new_keyframe:
            self._keyframe_requested = False
            self._keyframes.add(seen.frame, seen.features, pose, moved)
        found = self._found(seen, state, keyframe, outcome, pose, new_keyframe=new_keyframe)
        return replace(found, notes=self._watch_body(frame, pose, state))

    def _without_body(self, frame: Frame) -> Frame:
        """The frame without the robot's own body, as far as it is known and the camera is the same."""
        mask = self._own_body.mask if self._config.input.own_body == "auto" else None
        return frame if mask is None or mask.shape != frame.image.shape[:2] else frame.masked(mask)

    def _watch_body(self, frame: Frame, pose: UncertainPose, state: State) -> tuple[Note, ...]:
        """Look for the robot's own body in a tracked frame, as it was measured; a note where it is found at first."""
        if self._config.input.own_body == "off":
            return ()
        body, knew_body = self._own_body, self._own_body.mask is not None
        if state is State.RELOCALISED:  # the pose may have stepped
            body.forget_views()
        with suppress(OutOfTime):  # the answer stands
            body.watch(frame, pose.T_parent_child)
        return () if knew_body or body.mask is None else (body_note(body.mask),)

    def _extract(self, frame: Frame, velocity_sensor: NDArray[np.float64] | None) -> Comparison:
        """Features of a frame, which is de-skewed where it can be."""
        if self._config.input.deskew:
            frame = deskew(frame, velocity_sensor)
        return Comparison(frame, extract(frame, self._config), None)

    def _correct(
        self, frame: Frame, seen: Comparison, keyframe: Keyframe, outcome: Registration
    ) -> tuple[Comparison, Keyframe, Registration]:
        """Register once more where the motion found shows that a scan was de-skewed for another one.

        So it is with the first two scans, before any motion is known, and where the motion changes suddenly.
        """
        found = self._velocity_to(_pose(keyframe, outcome), frame.stamp_ns)
        if found is None or self._last is None or not self._config.input.deskew:
            return seen, keyframe, outcome
        max_skew_m = MAX_SKEW_VOXELS * self._config.geometric.voxel_size_m
        better, straight = seen, keyframe
        if mean_skew_m(frame, found if self._velocity is None else found - self._velocity) > max_skew_m:
            better = self._extract(frame, found)
        # Only of the last frame is the motion known now; one that was de-skewed has no times any more.
        if keyframe.frame is self._last.frame and mean_skew_m(keyframe.frame, found) > max_skew_m:
            straightened = self._extract(keyframe.frame, found)
            straight = replace(keyframe, frame=straightened.frame, features=straightened.features)
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
                last = self._keyframes.add(
                    self._last.frame, self._last.features, self._last.pose, self._last.displacement
                )
                return State.TRACKING, last, outcome
        position = np.zeros(3) if self._last is None else self._last.pose.T_parent_child[:3, 3]
        for keyframe in self._keyframes.others(position, self._config.keyframes.retries, self._searches):
            outcome = register(keyframe.features, features, self._config)
            if isinstance(outcome, Registration):
                self._keyframes.make_reference(keyframe)
                return State.RELOCALISED, keyframe, outcome
        return State.LOST, reference, rejection

    def _has_given_up(self, stamp_ns: int) -> bool:
        """Whether it is lost for too long, and every keyframe was compared with a usable frame since then."""
        config = self._config.keyframes
        is_late = config.lost_timeout_s > 0 and stamp_ns - self._answered_ns >= config.lost_timeout_s * NS_PER_S
        turns = math.ceil((len(self._keyframes) - 1) / config.retries) if config.retries else 1
        return is_late and self._searches >= max(turns, 1)

    def _is_recent(self, stamp_ns: int) -> bool:
        """Whether the last tracked frame says how the sensor moves now."""
        return self._last is not None and 0 < stamp_ns - self._last.frame.stamp_ns <= MAX_INTERVAL_S * 1e9

    def _velocity_to(self, pose: UncertainPose, stamp_ns: int) -> NDArray[np.float64] | None:
        before = self._last
        if before is None:
            return None
        return velocity(before.pose.T_parent_child, pose.T_parent_child, stamp_ns - before.frame.stamp_ns)

    def _found(
        self,
        seen: Comparison,
        state: State,
        keyframe: Keyframe,
        outcome: Registration | None,
        pose: UncertainPose,
        *,
        new_keyframe: bool,
    ) -> FrameResult:
        return FrameResult(
            stamp_ns=seen.frame.stamp_ns,
            session=self.session,
            state=state,
            T_odom_frame=pose.T_parent_child,
            covariance=pose.covariance,
            keyframe_id=keyframe.id,
            keyframe_stamp_ns=keyframe.frame.stamp_ns,
            new_keyframe=new_keyframe,
            outcome=outcome,
            compared=seen if outcome is None else replace(seen, keyframe=keyframe),
        )

    def _lost(self, seen: Comparison | Frame, keyframe: Keyframe | None, rejection: Rejection) -> FrameResult:
        """Of a frame that was compared, or whose time was up before there was anything to compare."""
        frame = seen if isinstance(seen, Frame) else seen.frame
        if self.reference is not None:
            self._frames_lost += 1
            self._searches += rejection.reason not in UNUSABLE_FRAME
            self._answered_ns = min(self._answered_ns, frame.stamp_ns)  # a clock that was set back counts from there
        return FrameResult(
            stamp_ns=frame.stamp_ns,
            session=self.session,
            state=State.LOST,
            reason=rejection.reason.value,
            message=rejection.message,
            keyframe_id=None if keyframe is None else keyframe.id,
            keyframe_stamp_ns=None if keyframe is None else keyframe.frame.stamp_ns,
            outcome=rejection,
            compared=None if isinstance(seen, Frame) else replace(seen, keyframe=keyframe),
        )


def _lost_note(lost_s: float) -> Note:
    return Note(
        "LOST_TIMEOUT", f"no pose for {lost_s:.1f} s", "a new session began, with an odometry frame of its own",
        "keyframes.lost_timeout_s says after how long; 0 for never",
    )


def _pose(keyframe: Keyframe, outcome: Registration) -> UncertainPose:
    """The pose of the frame that was registered against a keyframe."""
    return keyframe.pose.compose(UncertainPose(outcome.T_target_source, outcome.covariance))
