# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The replay itself: observations in, one record for each frame out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator

from vigg_ros.registration.config import Config
from vigg_ros.report.recording import FrameRecord
from vigg_ros.report.source import RefusedMessage
from vigg_ros.sensors.observation import Observation, StampedPose
from vigg_ros.tracking.assembly import Assembled, FrameAssembler, Refusal
from vigg_ros.tracking.extrinsics import Lookup
from vigg_ros.tracking.registrar import Attempt, Estimate, Registrar

Watcher = Callable[[Estimate, Attempt], None]
"""Sees each estimate together with what it was made of."""


class Replay:
    """Feeds a recording to the same assembler and Registrar that the node uses; every frame is processed."""

    def __init__(
        self, config: Config, watcher: Watcher | None = None, *, extrinsics: Lookup | None = None
    ) -> None:
        self._leader = "image" if extrinsics is None else "points"
        self._assembler = FrameAssembler(config.pairing, extrinsics)
        self._registrar = Registrar(config)
        self._watcher = watcher
        self.truth: list[StampedPose] = []
        self.frame_id = ""
        self.refused: Counter[str] = Counter()

    def run(self, source: Iterable[Observation | RefusedMessage]) -> Iterator[FrameRecord]:
        """A record for each leading message (see ``FrameAssembler``), in the order in which they are processed."""
        for item in source:
            if isinstance(item, RefusedMessage):
                if item.role == self._leader:
                    yield FrameRecord.of_refusal(item.stamp_ns, self._registrar.session, item.code, item.message)
            elif isinstance(item, StampedPose):
                self.truth.append(item)
            else:
                yield from filter(None, map(self._process, self._assembler.add(item)))
        yield from filter(None, map(self._process, self._assembler.flush()))

    def _process(self, assembled: Assembled) -> FrameRecord | None:
        """The record of a frame; None for a message that only counts as refused, such as a repeated depth image."""
        if isinstance(assembled, Refusal):
            self.refused[assembled.code] += 1
            if not assembled.leads:
                return None
            return FrameRecord.of_refusal(assembled.stamp_ns, assembled.session, assembled.code, assembled.message)
        self.frame_id = assembled.frame_id
        estimate = self._registrar.step(assembled.frame, session=assembled.session)
        attempt = self._registrar.attempt
        if self._watcher is not None and attempt is not None:
            self._watcher(estimate, attempt)
        return FrameRecord.of_estimate(estimate)
