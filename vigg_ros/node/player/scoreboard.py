# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What was sent to a node and what it answered, frame by frame."""

from __future__ import annotations

import threading
from collections import Counter, deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.rigid import inverse
from vigg_ros.report.trajectory import Trajectory, interpolate

RECENT_S = 3.0
"""Rates and latencies while it runs are those of so many seconds."""

STARTED = "STARTED"
"""The state of a frame that begins an odometry frame of its own."""

DROPPED = "DROPPED"
"""The state of a frame that gave way to a newer one."""


@dataclass(frozen=True, slots=True)
class Score:
    """The count so far."""

    state: str
    """The latest state, and its reason if there is one."""
    sent: int
    answered: int
    unanswered: Counter[str]
    """Frames without a pose by state and reason, as the node says."""
    silent: int
    """Frames of which nothing was heard (yet)."""
    rate_hz: float
    """Poses per second, lately."""
    recent_latency_ms: float
    """Median, lately; NaN without poses."""
    latencies_ms: NDArray[np.float64]
    """(N,): from publishing a frame's leading message to receiving its pose."""
    errors_m: NDArray[np.float64]
    """(M,): errors of position, of the answered frames whose truth is known; see ``Errors``."""


    @property
    def dropped(self) -> int:
        """Frames that the node says it left out, for newer ones."""
        return sum(count for words, count in self.unanswered.items() if words.split()[:1] == [DROPPED])


class Errors:
    """Errors of position by the truth, both relative to the first answered frame of each odometry frame."""

    def __init__(self, truth: Trajectory | None) -> None:
        self._truth = truth
        self._anchor: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
        self._latest: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
        self.metres: list[float] = []

    def add(self, recorded_ns: int, T_odom_frame: NDArray[np.float64]) -> None:
        """The pose of the frame that has this stamp in the recording; ignored where the truth is not known."""
        if self._truth is None:
            return
        known, is_known = interpolate(self._truth, np.array([recorded_ns], np.int64))
        if not is_known[0]:
            self._latest = None
            return
        T_world_frame = known.T_world_sensor[0]
        self._latest = T_world_frame, T_odom_frame
        if self._anchor is None:
            self._anchor = self._latest
        true, estimated = (
            inverse(first) @ present for first, present in zip(self._anchor, self._latest, strict=True)
        )
        self.metres.append(float(np.linalg.norm(true[:3, 3] - estimated[:3, 3])))

    def begin(self) -> None:
        """What comes from here on is in another odometry frame."""
        self._anchor = None

    def begin_with_latest(self) -> None:
        """The latest pose was already in that other odometry frame."""
        self._anchor = self._latest
        if self._latest is not None:
            self.metres[-1] = 0.0


@dataclass(slots=True)
class Scoreboard:
    """Collects what is sent and what comes back, from several threads."""

    errors: Errors
    heard_s: float = 0.0
    """When something was last heard from the node, on the monotonic clock."""
    _state: str = "WAITING"
    _sent: dict[int, tuple[int, float]] = field(default_factory=dict)
    _silent: set[int] = field(default_factory=set)
    _count: int = 0
    _begun_s: float = 0.0
    _latest_pose_ns: int = 0
    _latencies_s: list[float] = field(default_factory=list)
    _recent: deque[tuple[float, float]] = field(default_factory=deque)
    _unanswered: Counter[str] = field(default_factory=Counter)
    _begins: set[int] = field(default_factory=set)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def sent(self, recorded_ns: int, stamp_ns: int, at_s: float) -> None:
        """A frame's leading message was published, with this stamp instead of the recorded one."""
        with self._lock:
            self._begun_s = self._begun_s or at_s
            self._count += 1
            self._sent[stamp_ns] = recorded_ns, at_s
            self._silent.add(stamp_ns)

    def posed(self, stamp_ns: int, T_odom_frame: NDArray[np.float64], at_s: float) -> None:
        """A pose was received; one of a frame that was not sent from here counts for nothing."""
        with self._lock:
            if stamp_ns not in self._sent:
                return
            recorded_ns, sent_s = self._sent[stamp_ns]
            self.heard_s = at_s
            self._silent.discard(stamp_ns)
            self._latencies_s.append(at_s - sent_s)
            self._recent.append((at_s, at_s - sent_s))
            if stamp_ns in self._begins:
                self._begins.discard(stamp_ns)
                self.errors.begin()
            self.errors.add(recorded_ns, T_odom_frame)
            self._latest_pose_ns = stamp_ns

    def stated(self, stamp_ns: int, state: str, reason: str, at_s: float, *, has_pose: bool) -> None:
        """A status was received. Status and pose of a frame come in either order."""
        with self._lock:
            words = f"{state} {reason}".strip()
            if state != DROPPED:  # which says nothing of the tracker
                self._state = words
            if stamp_ns not in self._sent:
                return
            self.heard_s = at_s
            self._silent.discard(stamp_ns)
            if not has_pose:
                self._unanswered[words] += 1
            elif state == STARTED and self._latest_pose_ns == stamp_ns:
                self.errors.begin_with_latest()
            elif state == STARTED:
                self._begins.add(stamp_ns)

    def score(self, now_s: float) -> Score:
        """The count so far."""
        with self._lock:
            while self._recent and self._recent[0][0] < now_s - RECENT_S:
                self._recent.popleft()
            recent_s = [latency_s for _, latency_s in self._recent]
            return Score(
                state=self._state,
                sent=self._count,
                answered=len(self._latencies_s),
                unanswered=self._unanswered.copy(),
                silent=len(self._silent),
                rate_hz=len(recent_s) / min(RECENT_S, max(now_s - self._begun_s, 1.0)),
                recent_latency_ms=1e3 * float(np.median(recent_s)) if recent_s else float("nan"),
                latencies_ms=1e3 * np.array(self._latencies_s),
                errors_m=np.array(self.errors.metres),
            )
