# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads bags: rosbag2 folders, lone .mcap and .db3 files, ROS 1 .bag files, whole or damaged."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal, TypeVar

from vigg_ros.bags.decoding import Decoder, Undecodable, header_stamp_ns
from vigg_ros.bags.losses import Ledger, Loss
from vigg_ros.bags.metadata import find_files
from vigg_ros.bags.ordering import StampEntry, in_stamp_order
from vigg_ros.bags.storage import RawMessage
from vigg_ros.bags.storage_file import StorageFile, unpack_file
from vigg_ros.registration.errors import BagError

IMAGE_TYPES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")

_PEEKED_MESSAGES = 10

Decoded = TypeVar("Decoded")


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic of a bag; the same name stands twice if it holds two types."""

    name: str
    type: str
    """As ROS 2 spells it: ``sensor_msgs/msg/Image``."""
    count: int
    """Messages by the bag's index; reading may find fewer, see ``BagReader.losses``."""


@dataclass(frozen=True, slots=True)
class BagMessage:
    """One message: an object with the attributes of its ROS 2 type."""

    topic: str
    type: str
    log_ns: int
    message: object


@dataclass(frozen=True, slots=True)
class SerialisedMessage:
    """One message as the bytes that ROS 2 sends (CDR)."""

    topic: str
    type: str
    log_ns: int
    stamp_ns: int | None
    """The stamp in its header; None for a type without a header."""
    data: bytes


class BagReader:
    """A bag, opened by ``with``. Raises BagError, and nothing else, when it cannot be read at all.

    What can only partly be read is read: one broken message or chunk costs no other. ``losses`` then
    says what was lost. An .mcap file whose end is missing is read as far as it goes when it is given
    itself or its folder has no metadata.yaml (a recording that was never closed); when metadata.yaml
    says that the recording was complete, the copy is at fault and is refused.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.topics: tuple[Topic, ...] = ()
        self._ledger = Ledger()
        self._decoder = Decoder()
        self._files: list[StorageFile] = []
        self._promised: Counter[str] = Counter()
        self._stack = ExitStack()

    def __enter__(self) -> BagReader:
        try:
            self._open()
        except OSError as error:
            self._stack.close()
            raise BagError(f"{self.path} cannot be read: {error}") from error
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._files.clear()
        self._stack.close()

    @property
    def losses(self) -> tuple[Loss, ...]:
        """What was lost so far: in opening, and in the latest reading of each topic."""
        return self._ledger.losses

    @property
    def damaged(self) -> bool:
        """Whether anything was lost so far: the bag is only partly readable."""
        return bool(self.losses)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know although nothing was lost by it."""
        return tuple(self._ledger.notes)

    def messages(
        self, topics: Iterable[str] | None = None, *, order: Literal["stamp", "log"] = "stamp"
    ) -> Iterator[BagMessage]:
        """The messages of these topics (None: all), deserialised one by one.

        ``stamp`` orders them by header stamp, whatever the log times say, by reading the bag twice;
        memory holds at most a few dozen messages (see ``ordering``). ``log`` takes them as recorded.
        Messages that cannot be decoded are skipped and counted in ``losses``.
        """
        for raw, message in self._read(topics, order, self._decoder.message):
            yield BagMessage(raw.channel.topic, raw.channel.type, raw.log_ns, message)

    def serialised(
        self, topics: Iterable[str] | None = None, *, order: Literal["stamp", "log"] = "log"
    ) -> Iterator[SerialisedMessage]:
        """Like ``messages``, as bytes for ROS 2; those of ROS 1 bags are converted."""
        for raw, data in self._read(topics, order, self._decoder.cdr):
            yield SerialisedMessage(raw.channel.topic, raw.channel.type, raw.log_ns, header_stamp_ns(raw), data)

    def latched(self) -> frozenset[str]:
        """Topics whose latest message was kept for late subscribers, as far as the bag says."""
        return frozenset(channel.topic for file in self._files for channel in file.channels if channel.latched)

    def stamps(self, topics: Iterable[str] | None = None) -> tuple[StampEntry, ...]:
        """Log times and header stamps of these topics (None: all) as recorded, without decoding."""
        chosen = self._choose(topics)
        return tuple(
            StampEntry(raw.channel.topic, raw.log_ns, header_stamp_ns(raw)) for raw in self._in_log_order(chosen)
        )

    def encodings(self) -> dict[str, str]:
        """``encoding`` or ``format`` of the first readable message of each image topic."""
        found = {}
        for topic in self.topics:
            if topic.type in IMAGE_TYPES:
                for raw in islice(self._raw(frozenset((topic.name,))), _PEEKED_MESSAGES):
                    try:
                        message = self._decoder.message(raw)
                    except Undecodable:
                        continue
                    found[topic.name] = str(getattr(message, "encoding", getattr(message, "format", "")))
                    break
        return found

    def _read(
        self, topics: Iterable[str] | None, order: Literal["stamp", "log"], decode: Callable[[RawMessage], Decoded]
    ) -> Iterator[tuple[RawMessage, Decoded]]:
        """Each message of these topics that can be decoded; the others are counted as lost."""
        chosen = self._choose(topics)
        self._ledger.begin(chosen)
        by_log = order == "log"
        raws = self._in_log_order(chosen) if by_log else in_stamp_order(self.stamps(chosen), partial(self._raw, chosen))
        for raw in raws:
            try:
                decoded = decode(raw)
            except Undecodable as error:
                self._ledger.undecodable(raw.channel.topic, str(error))
            else:
                yield raw, decoded

    def _open(self) -> None:
        files = find_files(self.path, self._ledger)
        folder = Path()
        if any(path.suffix == ".zstd" for path in files.paths):
            folder = Path(self._stack.enter_context(TemporaryDirectory()))
        for path in files.paths:
            try:
                self._open_file(unpack_file(path, folder, self._ledger), is_complete=files.promised is not None)
            except BagError as error:
                if len(files.paths) == 1:
                    raise
                self._ledger.damage(str(error))
        if not self._files:
            raise BagError(f"no file of {self.path} can be read: {'; '.join(map(str, self.losses))}")
        self._count(files.promised)

    def _open_file(self, path: Path, *, is_complete: bool) -> None:
        file = StorageFile(path, self._ledger)
        self._stack.callback(file.close)
        if file.cut and is_complete:
            raise BagError(
                f"{path} is cut: it ends before its index, but metadata.yaml says that the recording was "
                f"complete; copy the bag again, or give {path.name} itself to read what is left of it"
            )
        self._files.append(file)

    def _count(self, promised: Counter[str] | None) -> None:
        """Set the topics, and how many messages a complete reading has to find."""
        counts = sum((file.counts for file in self._files), Counter[tuple[str, str]]())
        keys = {channel.key for file in self._files for channel in file.channels}
        self.topics = tuple(Topic(name, kind, counts[name, kind]) for name, kind in sorted(keys))
        self._promised = Counter()
        for topic in self.topics:
            self._promised[topic.name] += topic.count
        for name, count in (promised or {}).items():
            if count and name not in self._promised:
                self._ledger.damage(f"metadata.yaml promises {count} messages of {name}, which no file holds")
        self._promised |= promised or Counter()

    def _choose(self, topics: Iterable[str] | None) -> frozenset[str]:
        if not self._files:
            raise BagError(f"{self.path} is not open; read it within 'with BagReader(path) as reader:'")
        present = {topic.name for topic in self.topics}
        return frozenset(present if topics is None else present.intersection(topics))

    def _raw(self, topics: frozenset[str]) -> Iterator[RawMessage]:
        for file in self._files:
            yield from file.messages(topics)

    def _in_log_order(self, topics: frozenset[str]) -> Iterator[RawMessage]:
        """As recorded; a reading that comes to its end is compared with the promised counts."""
        seen: Counter[str] = Counter()
        for raw in self._raw(topics):
            seen[raw.channel.topic] += 1
            yield raw
        self._ledger.compare(self._promised, seen, topics)
