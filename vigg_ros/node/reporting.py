# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the node says about itself: log lines, WAITING, and /diagnostics."""

from __future__ import annotations

import time
import traceback

from rclpy.node import Node

from vigg_ros.messages.diagnostic_messages import frame_status
from vigg_ros.messages.fields import Message
from vigg_ros.node.diagnostics import input_status, registration_status, waiting_status
from vigg_ros.node.input_monitor import offset_s
from vigg_ros.node.parameters import NodeParameters
from vigg_ros.node.rates import FrameStatistics, Throttle
from vigg_ros.node.scheduler import Scheduler
from vigg_ros.node.settings import Settings
from vigg_ros.node.subscriptions import InputTopic, has_publisher
from vigg_ros.node.watchdog import PROFILE_REMEDY, SILENCE_S, Facts, Finding, explain, patience_s
from vigg_ros.sensors.observation import Note
from vigg_ros.tracking.frame_result import FrameResult, State

LOG_PERIOD_S = 10.0
"""Equal lines are said once in this time."""

MISSING_SHARE = 0.1
"""So many missing stamps of a regular topic are worth a line."""


class Reporting:
    """Speaks for the node; knows nothing of publishers."""

    CHECK_PERIOD_S = 0.5
    DIAGNOSTICS_PERIOD_S = 1.0

    def __init__(
        self,
        node: Node,
        parameters: NodeParameters,
        inputs: list[InputTopic],
        statistics: FrameStatistics,
        scheduler: Scheduler,
    ) -> None:
        self._node = node
        self._name = node.get_fully_qualified_name().strip("/")
        self._parameters = parameters
        self._inputs = inputs
        self._statistics = statistics
        self._scheduler = scheduler
        self._throttle = Throttle(LOG_PERIOD_S)
        self._notes: set[tuple[str, str]] = set()
        self._began_s = time.monotonic()
        self._patience_s = SILENCE_S
        self._findings: list[Finding] = []
        self._state: State | None = None
        self._lost_before = 0

    def begin(self) -> None:
        """The kernels are loaded and the topics subscribed: say so."""
        self._began_s = time.monotonic()
        topics = ", ".join(one.topic for one in self._inputs)
        options = self._settings.options
        self._node.get_logger().info(
            f"ready: config {options.config}, geometry {options.geometry}; subscribed to {topics}; "
            f"poses on {self._node.resolve_topic_name('~/pose')} in {options.odom_frame}"
        )

    def note(self, one: InputTopic, note: Note) -> None:
        """Something odd that was accepted: said once for each topic and code."""
        if (one.topic, note.code) not in self._notes:
            self._notes.add((one.topic, note.code))
            self._node.get_logger().warning(f"{one.topic}: {note} ({note.code})")

    def note_refusal(self, one: InputTopic, code: str, message: str) -> None:
        """A message that was refused."""
        one.monitor.refuse(code, message)
        self._warn(f"{one.topic} {code}", f"{one.topic}: {message} ({code})")

    def note_publishers(self, one: InputTopic) -> None:
        """The publishers of an input have come or gone."""
        if len(one.offers) > 1:
            self._warn(
                f"{one.topic} publishers",
                f"{one.topic}: found {len(one.offers)} publishers, expected one; their messages are mixed, and stamps "
                "that do not ascend are refused; stop one of them, or remap (TWO_PUBLISHERS)",
            )

    def note_second_parent(self, base: str, parent: str) -> None:
        """TF has another parent for the base already."""
        self._warn(
            "second parent",
            f"/tf: found {base} below {parent}, expected no parent besides "
            f"{self._settings.options.odom_frame}; nothing is published on /tf; set base_frame to the root of the "
            "robot's tree, or publish_tf to false (SECOND_PARENT)",
        )

    def log_result(self, result: FrameResult) -> None:
        """Changes of the state; refused and dropped frames, throttled."""
        leader = self._inputs[0].topic
        for note in result.notes:
            self.note(self._inputs[0], note)
        if result.state.was_registered:
            self._log_registered(result)
        elif result.state is State.REFUSED:
            self._warn(f"{leader} {result.reason}", f"{leader}: {result.message} ({result.reason})")
        elif result.state is State.DROPPED:
            self._warn(
                "dropped",
                f"{leader}: frames arrive faster than they are registered; {self._statistics.dropped} of "
                f"{self._statistics.received} were dropped so far; lower the rate (max_rate) or the cost "
                "(geometric.sample_k, visual.max_keypoints) if that matters (DROPPED)",
            )

    def frame_status(self, result: FrameResult) -> Message:
        """What ~/status says of a frame."""
        counts = {"frames_received": self._statistics.received, "frames_dropped": self._statistics.dropped}
        return frame_status(self._name, result, counts)

    def check(self, leader: InputTopic, partner: InputTopic) -> Message | None:
        """Explain a silence; a status to publish if there is something new to say."""
        now_s = time.monotonic()
        self._check_clock(now_s)
        self._check_gaps()
        self._allow_for_silence(now_s)
        last_s = max(self._began_s, self._statistics.last_pose_s or 0.0)
        self._findings = self._explain(leader, partner, now_s) if now_s - last_s >= self._patience_s else []
        if not self._findings:
            return None
        held = self._throttle.due("silence " + " ".join(one.code for one in self._findings), now_s)
        if held is None:
            return None
        for finding in self._findings:
            self._node.get_logger().error(f"no pose for {now_s - last_s:.0f} s. {finding}")
        return waiting_status(self._name, self._findings)

    def diagnostics(self) -> list[Message]:
        """The statuses of /diagnostics: one for each input, one for the registration."""
        now_s = time.monotonic()
        by_topic = {finding.topic: finding for finding in reversed(self._findings)}
        inputs = [
            input_status(f"{self._name}: {one.topic}", one.monitor, now_s, by_topic.get(one.topic))
            for one in self._inputs
        ]
        return [*inputs, registration_status(self._name, self._statistics, now_s, self._findings)]

    def log_failure(self, error: BaseException) -> None:
        """An error of this package, with its place, so that it can be reported."""
        place = "".join(traceback.format_exception(error))
        self._warn(f"failure {type(error).__name__}", f"internal error, please report it:\n{place}", error=True)

    @property
    def _settings(self) -> Settings:
        """Those of now: some change while the node runs."""
        return self._parameters.settings

    def _allow_for_silence(self, now_s: float) -> None:
        """While paused, silence is what was asked for; another max_rate asks for poses from now on."""
        before_s, self._patience_s = self._patience_s, patience_s(self._settings.options.max_rate)
        if self._scheduler.is_paused or self._patience_s != before_s:
            self._began_s = now_s

    def _explain(self, leader: InputTopic, partner: InputTopic, now_s: float) -> list[Finding]:
        last = self._statistics.last
        other = "depth" if self._settings.options.geometry == "points" else "points"
        idle = has_publisher(self._node, other)
        return explain(
            Facts(
                inputs=[one.facts(now_s) for one in self._inputs],
                slop_s=self._settings.config.pairing.sync_slop_s,
                offset_s=offset_s(leader.monitor, partner.monitor),
                last_reason="" if last is None or last.has_pose else last.reason,
                last_message="" if last is None else last.message,
                busy=self._scheduler.worker.is_busy,
                idle_topics=() if idle is None else (idle,),
            )
        )

    def _log_registered(self, result: FrameResult) -> None:
        before, self._state = self._state, result.state
        log = self._node.get_logger()
        if result.state is State.LOST:
            self._warn(f"lost {result.reason}", f"LOST: {result.message} ({result.reason})")
        elif result.state is State.STARTED:
            reason = f"{result.message}; " if result.message else ""
            log.info(
                f"session {result.session} started: {reason}{result.frame_id} at this frame defines the odometry frame"
            )
        elif result.state is State.RELOCALISED or before is State.LOST:
            log.info(f"{result.state.value} again after {self._lost_before} lost frames")
        self._lost_before = self._statistics.frames_lost

    def _check_gaps(self) -> None:
        for one in self._inputs[:2]:
            missing, expected = one.monitor.gaps.recent()
            if expected and missing > MISSING_SHARE * expected:
                self._warn(
                    f"{one.topic} gaps",
                    f"{one.topic}: found {expected - missing} of the last {expected} stamps, expected all of them; "
                    f"{PROFILE_REMEDY} (STAMPS_MISSING)",
                )

    def _check_clock(self, now_s: float) -> None:
        waited = now_s - self._began_s >= SILENCE_S
        if waited and ("/clock", "NO_CLOCK") not in self._notes and self._lacks_clock():
            self._notes.add(("/clock", "NO_CLOCK"))
            self._node.get_logger().warning(
                "/clock: found no message, expected the time, as use_sim_time is on; outputs carry the stamps of the "
                "inputs and go on; publish /clock or set use_sim_time to false (NO_CLOCK)"
            )

    def _lacks_clock(self) -> bool:
        return self._node.get_parameter("use_sim_time").value and self._node.get_clock().now().nanoseconds == 0

    def _warn(self, key: str, text: str, *, error: bool = False) -> None:
        held = self._throttle.due(key, time.monotonic())
        if held is None:
            return
        text += f" ({held} more like this since the last line)" if held else ""
        if error:
            self._node.get_logger().error(text)
        else:
            self._node.get_logger().warning(text)
