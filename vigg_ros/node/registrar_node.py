# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node: messages to the pipeline, answers to the publishers, and nothing else."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.clock import Clock, ClockType
from rclpy.context import Context
from rclpy.node import Node

from vigg_ros.node.answer import Answer, Registered
from vigg_ros.node.frame_statistics import Tally
from vigg_ros.node.parameters import NodeParameters
from vigg_ros.node.publishers import Outputs
from vigg_ros.node.reporting import Reporting
from vigg_ros.node.scheduler import Pipeline
from vigg_ros.node.sensor_mount import MountFinder, patient
from vigg_ros.node.services import Services
from vigg_ros.node.settings import Settings
from vigg_ros.node.subscriptions import InputTopic
from vigg_ros.node.trajectory_log import SaveError, Trail
from vigg_ros.node.transforms import Transforms
from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.header import stamp_ns
from vigg_ros.sensors.input_decoder import InputDecoder
from vigg_ros.tracking.extrinsics import Lookup, fixed

ROLES = {"points": ("points", "image", "camera_info"), "depth": ("image", "depth", "camera_info")}
"""By geometry: the leading input, its partner, the calibration."""

GRAPH_PERIOD_S, PATH_PERIOD_S, START_PERIOD_S = 0.2, 0.5, 0.02


class RegistrarNode:
    """The node ``registrar`` and what it is made of. Raises ConfigError for parameters that cannot be used."""

    def __init__(self, context: Context) -> None:
        self.ros = Node("registrar", context=context, automatically_declare_parameters_from_overrides=True)
        """What rclpy calls the node."""
        self._parameters = NodeParameters(self.ros, self._reconfigure)
        settings = self._parameters.settings
        options = settings.options
        self._transforms = self._make_transforms(settings)
        self._outputs = Outputs(self.ros, odom_frame=options.odom_frame, base_frame=options.base_frame)
        self.tally = Tally()
        """What became of the frames so far."""
        self._trail = Trail()
        self._lock = threading.RLock()
        self._stopped = threading.Event()
        self._pipeline = Pipeline(
            settings.config,
            extrinsics=self._extrinsics(settings) if options.geometry == "points" else None,
            find_mount=MountFinder(options.base_frame, self._base_lookup(settings)),
            publish=self._publish,
            failed=self._log_failure,
        )
        self._reconfigure(settings)
        self._inputs = [InputTopic(self.ros, role, options, self._receive) for role in ROLES[options.geometry]]
        self._leader, self._partner, self._calibration = self._inputs
        self._by_role = {one.role: one for one in self._inputs}
        self._decoder = InputDecoder(settings.config.input, self._by_role["image"].topic)
        self._reporting = Reporting(self.ros, self._parameters, self._inputs, self.tally, self._pipeline)
        self._services = Services(
            self.ros,
            reset=self._reset,
            request_keyframe=self._pipeline.request_keyframe,
            pause=self._pipeline.pause,
            save=self._save,
            failed=self._log_failure,
        )

    def start(self) -> None:
        """Compile or load the kernels, then subscribe."""
        self.ros.get_logger().info("loading; where kernels must be compiled first this takes up to a minute")
        self._pipeline.worker.start()
        self._begin = self._every(START_PERIOD_S, self._subscribe_when_ready)

    def end(self, patience_s: float) -> bool:
        """Publish nothing more, save what was asked for; False if a registration still runs."""
        self._stopped.set()
        ended = self._pipeline.stop(patience_s)
        if self._parameters.settings.options.save_at_exit:
            try:
                self.ros.get_logger().info(f"trajectory saved: {self._save()}")
            except SaveError as error:
                self.ros.get_logger().error(f"trajectory not saved: {error}")
        return ended

    def _subscribe_when_ready(self) -> None:
        if not self._pipeline.worker.ready.is_set():
            return
        self.ros.destroy_timer(self._begin)
        self._follow_publishers()
        self._every(GRAPH_PERIOD_S, self._follow_publishers)
        self._every(PATH_PERIOD_S, self._publish_path)
        self._every(self._reporting.CHECK_PERIOD_S, self._report)
        self._every(self._reporting.DIAGNOSTICS_PERIOD_S, self._diagnose)
        self._reporting.begin()

    def _every(self, period_s: float, callback: Callable[[], None]) -> Any:
        """A timer by a clock that always runs, whatever happens on /clock."""
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        return self.ros.create_timer(period_s, partial(self._guarded, callback), clock=steady)

    def _guarded(self, callback: Callable[[], None]) -> None:
        """Run a callback; rclpy would end the process for an exception in it."""
        try:
            callback()
        except Exception as error:
            self._log_failure(error)

    def _follow_publishers(self) -> None:
        for one in self._inputs:
            if one.follow():
                self._reporting.note_publishers(one)

    def _receive(self, role: str, message: Any) -> None:
        self._guarded(partial(self._take, role, message))

    def _take(self, role: str, message: Any) -> None:
        one = self._by_role[role]
        arrived_s = time.monotonic()
        one.monitor.arrive(arrived_s)
        try:
            observation = self._decoder.decode(role, message)  # type: ignore[arg-type]
            refusals = self._pipeline.add(observation, arrived_s=arrived_s)
        except DataError as error:
            self._refuse(one, _stamp_of(message), error.code, str(error))
        except Exception as error:  # whatever a hostile message does, the next one gets its turn
            self._log_failure(error)
            self._refuse(one, _stamp_of(message), "INTERNAL_ERROR", f"{type(error).__name__}: {error}")
        else:
            for refusal in refusals:
                if refusal.leads:  # its answer has been logged
                    one.monitor.refuse(refusal.code, refusal.message)
                else:
                    self._reporting.note_refusal(one, refusal.code, refusal.message)
            if not refusals:
                one.monitor.accept(observation.stamp_ns)
            for note in observation.notes:
                self._reporting.note(one, note)

    def _refuse(self, one: InputTopic, stamp: int, code: str, message: str) -> None:
        self._reporting.note_refusal(one, code, message)
        if one is self._leader:
            self._pipeline.refuse(stamp, code, message)

    def _publish(self, answer: Answer) -> None:
        """One answer; the pipeline sees to it that this never runs twice at a time."""
        with self._lock:
            if answer.registered is not None:
                self._publish_pose(answer.registered)
            self.tally.add(answer, time.monotonic())
            self._outputs.publish_status(self._reporting.frame_status(answer))
            # With its status the frame has its answer: what fails from here on must not give it a second one.
            if answer.registered is not None:
                self._guarded(partial(self._outputs.publish_views, answer.registered))
            self._guarded(partial(self._reporting.log_answer, answer))

    def _publish_pose(self, registered: Registered) -> None:
        pose, estimate = registered.pose, registered.estimate
        if pose is None:
            return
        self._outputs.publish_pose(registered, pose)
        self._trail.add(estimate.stamp_ns, estimate.session, pose.T_parent_child)
        options = self._parameters.settings.options
        if options.publish_tf and self._transforms is not None:
            base = self._outputs.child_frame(registered)
            parent = self._transforms.publish(
                pose.T_parent_child, stamp_ns=estimate.stamp_ns, odom=options.odom_frame, base=base
            )
            if parent is not None:
                self._reporting.note_second_parent(base, parent)

    def _publish_path(self) -> None:
        with self._lock:
            self._outputs.publish_path()

    def _report(self) -> None:
        waiting = self._reporting.check(self._leader, self._partner)
        if waiting is not None:
            with self._lock:
                self._outputs.publish_status(waiting)

    def _diagnose(self) -> None:
        with self._lock:
            statuses = self._reporting.diagnostics()
        now_ns = self.ros.get_clock().now().nanoseconds or time.time_ns()
        self._outputs.publish_diagnostics(statuses, stamp_ns=now_ns)

    def _reset(self) -> None:
        self._pipeline.reset()
        for one in self._inputs:
            one.monitor.restart()
        with self._lock:
            self._outputs.forget()

    def _save(self) -> str:
        with self._lock:  # which answers wait for, so nothing is written under it
            trail = self._trail.copy()
        return str(trail.save(self._parameters.settings.options.output_dir))

    def _reconfigure(self, settings: Settings) -> None:
        self._pipeline.configure(settings.config, max_rate_hz=settings.options.max_rate)

    def _make_transforms(self, settings: Settings) -> Transforms | None:
        """TF where a parameter cannot do without it."""
        options = settings.options
        asked = {
            "publish_tf: true": options.publish_tf,
            "geometry: points with extrinsics: tf": options.geometry == "points" and settings.T_parent_camera is None,
            f"base_frame: {options.base_frame}": bool(options.base_frame)
            and (options.geometry == "points" or settings.T_parent_camera is None),
        }
        wanted_by = next((name for name, wanted in asked.items() if wanted), None)
        return None if wanted_by is None else Transforms(self.ros, wanted_by)

    def _extrinsics(self, settings: Settings) -> Lookup:
        given = settings.T_camera_points
        return self._patient_lookup(settings) if given is None else fixed(given)

    def _base_lookup(self, settings: Settings) -> Lookup:
        given = settings.T_parent_camera
        if given is not None and settings.options.geometry == "depth":
            return fixed(given)
        return self._patient_lookup(settings) if self._transforms is not None else _no_lookup

    def _patient_lookup(self, settings: Settings) -> Lookup:
        assert self._transforms is not None, "made where extrinsics come from TF"
        return patient(self._transforms.lookup, settings.options.tf_timeout, self._stopped.wait)

    def _log_failure(self, error: BaseException) -> None:
        self._reporting.log_failure(error)


def _no_lookup(target: str, source: str) -> NDArray[np.float64] | None:
    return None


def _stamp_of(message: Any) -> int:
    try:
        return stamp_ns(message.header.stamp)
    except DataError:
        return 0
