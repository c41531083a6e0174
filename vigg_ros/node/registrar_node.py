# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node: messages to the scheduler, results to the publishers, and nothing else."""

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

from vigg_ros.node.parameters import NodeParameters
from vigg_ros.node.publishers import Publishers
from vigg_ros.node.rates import FrameStatistics
from vigg_ros.node.reporting import Reporting
from vigg_ros.node.scheduler import Scheduler
from vigg_ros.node.services import create_services
from vigg_ros.node.settings import Settings
from vigg_ros.node.subscriptions import InputTopic
from vigg_ros.node.trajectory_log import SaveError, TrajectoryLog
from vigg_ros.node.transforms import Transforms
from vigg_ros.pipeline import Pipeline
from vigg_ros.sensors.input_decoder import Role
from vigg_ros.tracking.extrinsics import Lookup, fixed
from vigg_ros.tracking.frame_result import FrameResult
from vigg_ros.tracking.sensor_mount import BaseResult, MountFinder, waiting_lookup

ROLES: dict[str, tuple[Role, Role, Role]] = {
    "points": ("points", "image", "camera_info"),
    "depth": ("image", "depth", "camera_info"),
}
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
        self._publishers = Publishers(self.ros, odom_frame=options.odom_frame, base_frame=options.base_frame)
        self.statistics = FrameStatistics()
        """What became of the frames so far."""
        self._trajectory = TrajectoryLog()
        self._lock = threading.RLock()
        self._stopped = threading.Event()
        self._inputs = [InputTopic(self.ros, role, options, self._receive) for role in ROLES[options.geometry]]
        self._leader, self._partner, self._calibration = self._inputs
        self._by_role = {one.role: one for one in self._inputs}
        pipeline = Pipeline(
            settings.config,
            self._extrinsics(settings) if options.geometry == "points" else None,
            topics={"image": self._by_role["image"].topic},
        )
        self._scheduler = Scheduler(
            pipeline,
            settings.config,
            find_mount=MountFinder(options.base_frame, self._base_lookup(settings)),
            publish=self._publish,
            failed=self._log_failure,
        )
        self._reconfigure(settings)
        self._reporting = Reporting(self.ros, self._parameters, self._inputs, self.statistics, self._scheduler)
        create_services(
            self.ros,
            reset=self._reset,
            request_keyframe=self._scheduler.request_keyframe,
            pause=self._scheduler.pause,
            save=self._save,
            failed=self._log_failure,
        )

    def start(self) -> None:
        """Compile or load the kernels, then subscribe."""
        self.ros.get_logger().info("loading; where kernels must be compiled first this takes up to a minute")
        self._scheduler.worker.start()
        self._begin = self._every(START_PERIOD_S, self._subscribe_when_ready)

    def end(self, patience_s: float) -> bool:
        """Publish nothing more, save what was asked for; False if a registration still runs."""
        self._stopped.set()
        ended = self._scheduler.stop(patience_s)
        if self._parameters.settings.options.save_at_exit:
            try:
                self.ros.get_logger().info(f"trajectory saved: {self._save()}")
            except SaveError as error:
                self.ros.get_logger().error(f"trajectory not saved: {error}")
        return ended

    def _subscribe_when_ready(self) -> None:
        if not self._scheduler.worker.ready.is_set():
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

    def _receive(self, role: Role, message: Any) -> None:
        self._guarded(partial(self._take, role, message))

    def _take(self, role: Role, message: Any) -> None:
        one = self._by_role[role]
        arrived_s = time.monotonic()
        one.monitor.arrive(arrived_s)
        received = self._scheduler.receive(role, message, arrived_s=arrived_s)
        for refusal in received.refusals:
            if refusal.leads:  # its result has been logged
                one.monitor.refuse(refusal.code, refusal.message)
            else:
                self._reporting.note_refusal(one, refusal.code, refusal.message)
        if not received.refusals:
            one.monitor.accept(received.stamp_ns)
        for note in received.notes:
            self._reporting.note(one, note)

    def _publish(self, result: FrameResult, base: BaseResult | None) -> None:
        """One result; the scheduler sees to it that this never runs twice at a time."""
        with self._lock:
            if base is not None:
                self._publish_pose(base)
            self.statistics.add(result, time.monotonic())
            self._publishers.publish_status(self._reporting.frame_status(result))
            # With its status the frame has its answer: what fails from here on must not give it a second one.
            if base is not None:
                self._guarded(partial(self._publishers.publish_views, base))
            self._guarded(partial(self._reporting.log_result, result))

    def _publish_pose(self, base: BaseResult) -> None:
        pose, result = base.pose, base.result
        if pose is None:
            return
        self._publishers.publish_pose(base)
        self._trajectory.add(result.stamp_ns, result.session, pose.T_parent_child)
        options = self._parameters.settings.options
        if options.publish_tf and self._transforms is not None:
            child = self._publishers.child_frame(base)
            parent = self._transforms.publish(
                pose.T_parent_child, stamp_ns=result.stamp_ns, odom=options.odom_frame, base=child
            )
            if parent is not None:
                self._reporting.note_second_parent(child, parent)

    def _publish_path(self) -> None:
        with self._lock:
            self._publishers.publish_path()

    def _report(self) -> None:
        waiting = self._reporting.check(self._leader, self._partner)
        if waiting is not None:
            with self._lock:
                self._publishers.publish_status(waiting)

    def _diagnose(self) -> None:
        with self._lock:
            statuses = self._reporting.diagnostics()
        now_ns = self.ros.get_clock().now().nanoseconds or time.time_ns()
        self._publishers.publish_diagnostics(statuses, stamp_ns=now_ns)

    def _reset(self) -> None:
        self._scheduler.reset()
        for one in self._inputs:
            one.monitor.restart()
        with self._lock:
            self._publishers.forget()

    def _save(self) -> str:
        with self._lock:  # which answers wait for, so nothing is written under it
            trajectory = self._trajectory.copy()
        return str(trajectory.save(self._parameters.settings.options.output_dir))

    def _reconfigure(self, settings: Settings) -> None:
        self._scheduler.configure(settings.config, max_rate_hz=settings.options.max_rate)

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
        return self._waiting_lookup(settings) if given is None else fixed(given)

    def _base_lookup(self, settings: Settings) -> Lookup:
        given = settings.T_parent_camera
        if given is not None and settings.options.geometry == "depth":
            return fixed(given)
        return self._waiting_lookup(settings) if self._transforms is not None else _no_lookup

    def _waiting_lookup(self, settings: Settings) -> Lookup:
        assert self._transforms is not None, "made where extrinsics come from TF"
        return waiting_lookup(self._transforms.lookup, settings.options.tf_timeout, self._stopped.wait)

    def _log_failure(self, error: BaseException) -> None:
        self._reporting.log_failure(error)


def _no_lookup(target: str, source: str) -> NDArray[np.float64] | None:
    return None
