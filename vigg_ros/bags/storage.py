# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What every storage file offers, whatever its format: channels, and raw messages in recorded order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Channel:
    """A series of messages of one type under one topic name."""

    topic: str
    type: str
    """As ROS 2 spells it, for ROS 1 bags too: ``sensor_msgs/msg/Image``."""
    encoding: str
    """``cdr`` or ``ros1``; others cannot be decoded."""
    definition: str = ""
    """The message definition embedded in the bag, or empty."""
    definition_format: str = ""
    """``ros2msg``, ``ros2idl`` or another name from the bag; empty without a definition."""
    latched: bool = False
    """Whether who subscribes late was to get the latest message too (transient local), if the file says so."""

    @property
    def key(self) -> tuple[str, str]:
        """Topic and type: what a user can tell apart."""
        return self.topic, self.type


@dataclass(frozen=True, slots=True)
class RawMessage:
    """One message as its bytes were recorded (decompressed)."""

    channel: Channel
    log_ns: int
    data: bytes


class Storage(Protocol):
    """One open storage file."""

    channels: tuple[Channel, ...]
    counts: Counter[tuple[str, str]]
    """Messages per topic and type, by the file's own index if it has one, else by counting."""

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """The messages of these topics. May raise anything: the file may be damaged."""
        ...

    def close(self) -> None:
        """Release the file."""
        ...
