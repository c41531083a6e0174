# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The spine: messages in, one result for each leading message out. Node, replay, live and benchmark go through it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.config import Config
from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.header import stamp_ns
from vigg_ros.sensors.input_decoder import InputDecoder, Role
from vigg_ros.sensors.observation import Note, Observation
from vigg_ros.tracking.assembly import FrameAssembler, Refusal, SyncedFrame, SyncedMessages
from vigg_ros.tracking.extrinsics import Lookup, fixed
from vigg_ros.tracking.frame_result import FrameResult, State
from vigg_ros.tracking.registrar import Registrar
from vigg_ros.tracking.user_mask import UserMask


@dataclass(frozen=True, slots=True)
class Received:
    """What a message has brought."""

    stamp_ns: int
    """Of the message; 0 where it has none that could be read."""
    found: tuple[FrameResult | SyncedMessages, ...] = ()
    """In the order of their stamps: the results of frames that were refused, and messages that make a frame."""
    refusals: tuple[Refusal, ...] = ()
    """Why this message could not be used, if so; a missing partner is no fault of a message."""
    notes: tuple[Note, ...] = ()
    """What is odd about it, although it was accepted."""


class Pipeline:
    """One camera with depth images, or, with ``extrinsics``, with scans.

    ``feed`` does everything at once, as a replay needs it. A scheduler calls the steps apart: ``receive`` decodes and
    pairs in the thread that brings the messages, ``build`` and ``track`` make and register frames in another one.
    Every leading message (colour image, or scan) gets one result, in the order in which they are settled.
    """

    def __init__(
        self,
        config: Config,
        extrinsics: Lookup | NDArray[np.float64] | None = None,
        *,
        topics: Mapping[Role, str] | None = None,
    ) -> None:
        """Raises ConfigError for a mask that cannot be read.

        ``extrinsics``: T_camera_points (4, 4), or a lookup by the names of the two frames. ``topics`` by role: that
        of the image says whether it is rectified, unless ``input.rectify`` does."""
        lookup = fixed(extrinsics) if isinstance(extrinsics, np.ndarray) else extrinsics
        self.leader: Role = "image" if lookup is None else "points"
        self._decoder = InputDecoder(config.input, (topics or {}).get("image", ""))
        self._assembler = FrameAssembler(config.pairing, lookup, UserMask(config.input))
        self._registrar = Registrar(config)
        self._restarts = 0
        self.refused: Counter[str] = Counter()
        """Refused messages of any role, by code; exact where one thread does everything."""
        self.notes: dict[tuple[Role, str], Note] = {}
        """The first note of each role and code."""

    def feed(self, role: Role, message: Any) -> list[FrameResult]:
        """All results that are certain once this message of rclpy or rosbags is known."""
        return [*self.finish(self.receive(role, message).found)]

    def flush(self) -> list[FrameResult]:
        """What is left at the end of a recording."""
        return [*self.finish(self.remaining())]

    def remaining(self) -> tuple[FrameResult | SyncedMessages, ...]:
        """As ``flush``, but no frame is built yet."""
        return self._settled(self._assembler.remaining())

    def receive(self, role: Role, message: Any) -> Received:
        """Decode a message and pair it; quick, and no frame is built yet."""
        try:
            observation = self._decoder.decode(role, message)
        except DataError as error:
            return self.refuse(role, message, error.code, str(error))
        for note in observation.notes:
            self.notes.setdefault((role, note.code), note)
        return self.pair(observation)

    def pair(self, observation: Observation) -> Received:
        """What a decoded message brings."""
        matched = self._assembler.synchronize(observation)
        refusals = [one for one in matched if isinstance(one, Refusal) and one.code != "UNPAIRED"]
        return Received(observation.stamp_ns, self._settled(matched), tuple(refusals), observation.notes)

    def refuse(self, role: Role, message: Any, code: str, text: str) -> Received:
        """A message that cannot be used."""
        refusal = Refusal(_stamp_of(message), code, text, self._assembler.session, role == self.leader)
        return Received(refusal.stamp_ns, self._settled([refusal]), (refusal,))

    def build(self, messages: SyncedMessages) -> SyncedFrame | FrameResult:
        """The frame of paired messages, or the result that says why there is none."""
        built = self._assembler.build(messages)
        return self._refused(built) if isinstance(built, Refusal) else built

    def track(self, synced: SyncedFrame) -> FrameResult:
        """Register a frame."""
        result = self._registrar.step(synced.frame, session=synced.session)
        for note in result.notes:
            self.notes.setdefault((self.leader, note.code), note)
        return replace(result, frame_id=synced.frame_id)

    def finish(self, found: Iterable[FrameResult | SyncedMessages]) -> Iterator[FrameResult]:
        """Build and track what was received, each frame when its result is asked for: results hold images, and many
        frames can become certain together."""
        built = (one if isinstance(one, FrameResult) else self.build(one) for one in found)
        return (one if isinstance(one, FrameResult) else self.track(one) for one in built)

    def restart(self) -> list[FrameResult]:
        """Forget stamps and keyframes, as before a recording; what waited for a partner is discarded."""
        waiting = self._assembler.restart()
        results = [self.left_out(self._numbered(one), State.DISCARDED, "RESET", RESET_MESSAGE) for one in waiting]
        self._restarts += 1
        return results

    def left_out(self, one: SyncedMessages | Refusal, state: State, reason: str, message: str) -> FrameResult:
        """The result of a frame that is not registered."""
        frame_id = one.leader.frame_id if isinstance(one, SyncedMessages) else ""
        session = one.session + self._registrar.own_sessions
        return FrameResult(one.stamp_ns, session, state, reason, message, frame_id)

    def request_keyframe(self) -> None:
        """Let the next tracked frame become the reference."""
        self._registrar.request_keyframe()

    def configure(self, config: Config) -> None:
        """Other options of the method from the next frame on."""
        self._registrar.configure(config)

    def _settled(self, matched: list[SyncedMessages | Refusal]) -> tuple[FrameResult | SyncedMessages, ...]:
        """Matches as they are, refusals that lead as results; each refusal is counted."""
        settled: list[FrameResult | SyncedMessages] = []
        for one in map(self._numbered, matched):
            result = self._refused(one) if isinstance(one, Refusal) else one
            if isinstance(one, SyncedMessages) or one.leads:
                settled.append(result)
        return tuple(settled)

    def _refused(self, refusal: Refusal) -> FrameResult:
        self.refused[refusal.code] += 1
        return self.left_out(refusal, State.REFUSED, refusal.code, refusal.message)

    def _numbered(self, one: SyncedMessages | Refusal) -> SyncedMessages | Refusal:
        """With the number of the session since the pipeline was made: a restart begins one too. Those that begin
        because a camera was lost for too long are counted by the Registrar, on top."""
        return replace(one, session=one.session + self._restarts)


RESET_MESSAGE = "a reset came before this frame was answered"


def _stamp_of(message: Any) -> int:
    try:
        return stamp_ns(message.header.stamp)
    except (AttributeError, DataError):
        return 0
