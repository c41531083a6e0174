# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The online twin of the replay: the same assembler and Registrar, but the newest frame wins."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from vigg_ros.node.answer import Answer, Fate, Registered, of_estimate
from vigg_ros.node.rates import RateLimit
from vigg_ros.node.sensor_mount import Mount
from vigg_ros.node.warm_up import warm_up
from vigg_ros.node.worker import Worker
from vigg_ros.registration.config import Config
from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.observation import Observation
from vigg_ros.tracking.assembly import FrameAssembler, Refusal, SyncedMessages
from vigg_ros.tracking.extrinsics import Lookup
from vigg_ros.tracking.registrar import Registrar


@dataclass(frozen=True, slots=True)
class _Job:
    match: SyncedMessages
    generation: int
    arrived_s: float


class Pipeline:
    """Observations in, one answer for each leading message out.

    Pairing happens in the caller's thread; frames are built and registered in a worker's, where ``publish`` is
    called too. ``publish`` never runs twice at a time, and never again with a pose from before a reset that has
    returned. It may raise where the answer was not published: the frame is then answered with an INTERNAL_ERROR.
    """

    def __init__(
        self,
        config: Config,
        *,
        extrinsics: Lookup | None,
        find_mount: Callable[[str], Mount],
        publish: Callable[[Answer], None],
        failed: Callable[[BaseException], None],
    ) -> None:
        self._config = config
        self._next_config = config
        self._assembler = FrameAssembler(config.pairing, extrinsics)
        self._registrar = Registrar(config)
        self._find_mount = find_mount
        self._publish = publish
        self._report_failure = failed
        self._gate = threading.RLock()
        self._generation = 0
        self._paused = False
        self._keyframe_requested = False
        self._running: _Job | None = None
        self._rate_limit = RateLimit()
        self._with_points = extrinsics is not None
        self._worker: Worker[_Job] = Worker(self._register, failed=self._fail, prepare=self._warm_up)

    @property
    def worker(self) -> Worker[_Job]:
        """The thread of the registrations."""
        return self._worker

    def add(self, observation: Observation, *, arrived_s: float) -> list[Refusal]:
        """Take an observation, arrived at this time (time.monotonic); returned is why it could not be used, if so.

        Refusals that lead have been answered.
        """
        found = self._assembler.synchronize(observation)
        refusals = [one for one in found if isinstance(one, Refusal)]
        for refusal in refusals:
            if refusal.leads:
                self.refuse(refusal.stamp_ns, refusal.code, refusal.message)
        matches = (one for one in found if isinstance(one, SyncedMessages))
        self._take([_Job(match, self._generation, arrived_s) for match in matches])
        # Where a partner is missing nothing is wrong with the message; all others are of this observation.
        return [one for one in refusals if one.code != "UNPAIRED"]

    def refuse(self, stamp_ns: int, code: str, message: str) -> None:
        """Answer a leading message that cannot be used; the stamp is 0 where it has none."""
        session = self._assembler.session + self._generation
        self._answer(Answer(stamp_ns, session, Fate.REFUSED.value, code, message))

    def reset(self) -> None:
        """Forget keyframes and stamps; a registration that runs is not waited for, its result is discarded.

        From the thread that calls ``add``.
        """
        with self._gate:
            waiting = [job.match for job in self._worker.withdraw()] + self._assembler.restart()
            for one in waiting:
                self._discard(one)
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
            self._publish = lambda answer: None
        return self._worker.stop(timeout_s)

    def _take(self, jobs: list[_Job]) -> None:
        """Hand over the jobs of one moment: pairs may become certain together, and do not displace each other."""
        wanted = [job for job in jobs if self._wants(job)]
        if wanted:
            for job in self._worker.offer(wanted):
                self._end(job, Fate.DROPPED, "NEWER_FRAME", "a newer frame arrived while this one waited")

    def _wants(self, job: _Job) -> bool:
        if self._paused:
            self._end(job, Fate.PAUSED, "PAUSED", "the node is paused; ~/pause with data: false resumes")
            return False
        if not self._rate_limit.allows(job.match.stamp_ns, job.match.session + job.generation):
            self._end(job, Fate.SKIPPED, "MAX_RATE", "it came sooner after the last one than max_rate allows")
            return False
        return True

    def _end(self, job: _Job, fate: Fate, reason: str, message: str) -> None:
        session = job.match.session + job.generation
        self._answer(Answer(job.match.stamp_ns, session, fate.value, reason, message, job.match.leader.frame_id))

    def _answer(self, answer: Answer) -> None:
        with self._gate:
            self._publish(answer)

    def _register(self, job: _Job) -> None:
        self._running = job
        if job.generation != self._generation:
            self._discard(job.match)
            return
        begun_s = time.monotonic()
        assembled = self._assembler.build(job.match)
        built_s = time.monotonic()
        if isinstance(assembled, Refusal):
            self._refuse_job(job, assembled.code, assembled.message)
            return
        try:
            mount = self._find_mount(assembled.frame_id)
        except DataError as error:
            self._refuse_job(job, error.code, str(error))
            return
        self._prepare_registrar()
        # A reset is a new session: the Registrar forgets everything when it sees its number.
        estimate = self._registrar.step(assembled.frame, session=assembled.session + job.generation)
        before_ms = {"wait": 1e3 * (begun_s - job.arrived_s), "build": 1e3 * (built_s - begun_s)}
        timings_ms = before_ms | estimate.timings_ms | {"total": 1e3 * (time.monotonic() - job.arrived_s)}
        with self._gate:
            if job.generation == self._generation:
                registered = Registered(estimate, self._registrar.attempt, assembled.frame_id, mount)
                self._answer(of_estimate(registered, timings_ms))
            else:
                self._discard(job.match)

    def _discard(self, one: SyncedMessages | Refusal) -> None:
        session = one.session + self._generation
        message = "a reset came before this frame was answered"
        self._answer(Answer(one.stamp_ns, session, Fate.DISCARDED.value, "RESET", message))

    def _refuse_job(self, job: _Job, code: str, message: str) -> None:
        self._end(job, Fate.REFUSED, code, message)

    def _prepare_registrar(self) -> None:
        if self._next_config is not self._config:
            self._config = self._next_config
            self._registrar.configure(self._config)
        if self._keyframe_requested:
            self._keyframe_requested = False
            self._registrar.request_keyframe()

    def _warm_up(self) -> None:
        warm_up(self._config, with_points=self._with_points)

    def _fail(self, error: BaseException) -> None:
        job, self._running = self._running, None
        try:
            self._report_failure(error)
        finally:
            if job is not None:
                self._end(job, Fate.REFUSED, "INTERNAL_ERROR", f"{type(error).__name__}: {error}")
