# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a damaged bag lost, counted and in words."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field


def in_one_line(error: BaseException) -> str:
    """An error of another library as part of a sentence."""
    text = " ".join(str(error).split())[:150]
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


@dataclass(frozen=True, slots=True)
class Loss:
    """Messages that a bag should hold and that could not be handed on."""

    topic: str
    """Empty when the damage cannot be told by topic."""
    count: int | None
    """None: nobody knows how many."""
    reason: str

    def __str__(self) -> str:
        number = "an unknown number of" if self.count is None else str(self.count)
        messages = "message" if self.count == 1 else "messages"
        return f"{number} {messages}{' of ' + self.topic if self.topic else ''}: {self.reason}"


@dataclass(slots=True)
class _TopicLosses:
    """One reading of one topic; a new reading starts a new one, so that nothing is counted twice."""

    undecodable: int = 0
    first_error: str = ""
    missing: int = 0
    promised: int = 0


@dataclass(slots=True)
class Ledger:
    """Collects losses and notes while a bag is read."""

    notes: list[str] = field(default_factory=list)
    _damages: dict[str, None] = field(default_factory=dict)
    _topics: defaultdict[str, _TopicLosses] = field(default_factory=lambda: defaultdict(_TopicLosses))

    def note(self, text: str) -> None:
        """Remember what a user should know but that lost nothing; the same text once."""
        if text not in self.notes:
            self.notes.append(text)

    def damage(self, text: str) -> None:
        """Remember a damaged place, which cost a number of messages nobody knows; the same text once."""
        self._damages[text] = None

    def begin(self, topics: Iterable[str]) -> None:
        """Start a new reading of these topics."""
        for topic in topics:
            self._topics[topic] = _TopicLosses()

    def undecodable(self, topic: str, error: str) -> None:
        """Count one message that was there but could not be understood."""
        losses = self._topics[topic]
        losses.first_error = losses.first_error or error
        losses.undecodable += 1

    def compare(self, promised: Counter[str], seen: Counter[str], topics: Iterable[str]) -> None:
        """Set what is missing after a complete reading of these topics."""
        for topic in topics:
            self._topics[topic].missing = max(0, promised[topic] - seen[topic])
            self._topics[topic].promised = promised[topic]

    @property
    def losses(self) -> tuple[Loss, ...]:
        """All losses so far: damaged places first, then by topic."""
        found = [Loss("", None, text) for text in self._damages]
        for topic, losses in sorted(self._topics.items()):
            if losses.undecodable:
                found.append(Loss(topic, losses.undecodable, f"not decodable; first: {losses.first_error}"))
            if losses.missing:
                found.append(Loss(topic, losses.missing, f"missing of {losses.promised} that the bag's index promises"))
        return tuple(found)
