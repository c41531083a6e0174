# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Around the pipeline, online: one worker registers, the newest frame wins, and every frame gets its one result."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from vigg_ros.node.rates import RateLimit
from vigg_ros.node.warm_up import warm_up
from vigg_ros.node.worker import Worker
from vigg_ros.pipeline import RESET_MESSAGE, Pipeline, Received
from vigg_ros.registration.config import Config
from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.input_decoder import Role
from vigg_ros.tracking.assembly import SyncedMessages
from vigg_ros.tracking.frame_result import FrameResult, State
from vigg_ros.tracking.sensor_mount import BaseResult, SensorMount

Publish = Callable[[FrameResult, BaseResult | None], None]
"""Is given each result, and what it says of the base where it was registered."""


@dataclass(frozen=True, slots=True)
class _Job:
    messages: SyncedMessages
    generation: int
    arrived_s: float


class Scheduler:
    """Messages in, one result for each leading message out.

    Decoding and pairing happen in the caller's thread; frames are built and registered in a worker's, where
    ``publish`` is called too. It never runs twice at a time, and never again with a pose from before a reset that has
    returned. It may raise where the result was not published: a frame that was registered then ends with an
    INTERNAL_ERROR, and all else is reported.
    """

    def __init__(
        self,
        pipeline: Pipeline,
        config: Config,
        *,
        find_mount: Callable[[str], SensorMount],
        publish: Publish,
        failed: Callable[[BaseException], None],
    ) -> None:
        self._pipeline = pipeline
        self._config = self._next_config = config
        self._find_mount = find_mount
        self._publish = publish
        self._report_failure = failed
        self._gate = threading.RLock()
        self._generation = 0
        self._paused = False
        self._keyframe_requested = False
        self._running: _Job | None = None
        self._rate_limit = RateLimit()
        prepare = partial(warm_up, config, with_points=pipeline.leader == "points")
        self.worker: Worker[_Job] = Worker(self._register, failed=self._fail, prepare=prepare)
        """The thread of the registrations."""

    def receive(self, role: Role, message: Any, *, arrived_s: float) -> Received:
        """Take a message, arrived at this time (time.monotonic). What is refused has its result at once."""
        try:
            received = self._pipeline.receive(role, message)
        except Exception as error:  # whatever a hostile message does, the next one gets its turn
            self._report_failure(error)
            received = self._pipeline.refuse(role, message, "INTERNAL_ERROR", f"{type(error).__name__}: {error}")
        jobs = [_Job(one, self._generation, arrived_s) for one in received.found if not isinstance(one, FrameResult)]
        for one in received.found:
            if isinstance(one, FrameResult):
                self._give_or_report(one)
        self._offer([job for job in jobs if self._wants(job)])
        return received

    def reset(self) -> None:
        """Forget keyframes and stamps; a registration that runs is not waited for, its result is discarded.

        From the thread that calls ``receive``.
        """
        with self._gate:
            for job in self.worker.withdraw():
                self._discard(job)
            for result in self._pipeline.restart():
                self._give(result)
            self._generation += 1

    def pause(self, paused: bool) -> None:
        """Let frames pass unregistered, or register them again; keyframes are kept."""
        with self._gate:
            self._paused = paused

    @property
    def is_paused(self) -> bool:
        """Whether frames pass unregistered."""
        return self._paused

    def request_keyframe(self) -> None:
        """Let the next tracked frame become the reference."""
        self._keyframe_requested = True

    def configure(self, config: Config, *, max_rate_hz: float) -> None:
        """Other options from the next frame on."""
        self._next_config = config
        self._rate_limit.max_rate_hz = max_rate_hz

    def stop(self, timeout_s: float) -> bool:
        """Publish nothing more; False if a registration still runs after the timeout."""
        with self._gate:
            self._generation += 1
            self._publish = lambda result, base: None
        return self.worker.stop(timeout_s)

    def _offer(self, jobs: list[_Job]) -> None:
        """Hand over the jobs of one moment: pairs may become certain together, and do not displace each other."""
        if jobs:
            for job in self.worker.offer(jobs):
                self._leave_out(job, State.DROPPED, "NEWER_FRAME", "a newer frame arrived while this one waited")

    def _wants(self, job: _Job) -> bool:
        if self._paused:
            self._leave_out(job, State.PAUSED, "PAUSED", "the node is paused; ~/pause with data: false resumes")
            return False
        if not self._rate_limit.allows(job.messages.stamp_ns, job.messages.session):
            self._leave_out(job, State.SKIPPED, "MAX_RATE", "it came sooner after the last one than max_rate allows")
            return False
        return True

    def _register(self, job: _Job) -> None:
        self._running = job
        if job.generation != self._generation:
            self._discard(job)
            return
        begun_s = time.monotonic()
        synced = self._pipeline.build(job.messages)
        built_s = time.monotonic()
        if isinstance(synced, FrameResult):
            self._give_or_report(synced)
            return
        try:
            mount = self._find_mount(synced.frame_id)
        except DataError as error:
            self._leave_out(job, State.REFUSED, error.code, str(error))
            return
        self._configure_pipeline()
        result = self._pipeline.track(synced)
        before_ms = {"wait": 1e3 * (begun_s - job.arrived_s), "build": 1e3 * (built_s - begun_s)}
        timings_ms = before_ms | result.timings_ms | {"total": 1e3 * (time.monotonic() - job.arrived_s)}
        result = replace(result, timings_ms=timings_ms)
        with self._gate:
            if job.generation == self._generation:
                self._give(result, BaseResult(result, mount))
            else:
                self._discard(job)

    def _configure_pipeline(self) -> None:
        if self._next_config is not self._config:
            self._config = self._next_config
            self._pipeline.configure(self._config)
        if self._keyframe_requested:
            self._keyframe_requested = False
            self._pipeline.request_keyframe()

    def _discard(self, job: _Job) -> None:
        self._leave_out(job, State.DISCARDED, "RESET", RESET_MESSAGE)

    def _leave_out(self, job: _Job, state: State, reason: str, message: str) -> None:
        self._give_or_report(self._pipeline.left_out(job.messages, state, reason, message))

    def _give_or_report(self, result: FrameResult) -> None:
        """A result without a pose: where it cannot be published, that is reported and the others get theirs."""
        try:
            self._give(result)
        except Exception as error:
            self._report_failure(error)

    def _give(self, result: FrameResult, base: BaseResult | None = None) -> None:
        with self._gate:
            self._publish(result, base)

    def _fail(self, error: BaseException) -> None:
        job, self._running = self._running, None
        try:
            self._report_failure(error)
        finally:
            if job is not None:
                self._leave_out(job, State.REFUSED, "INTERNAL_ERROR", f"{type(error).__name__}: {error}")
