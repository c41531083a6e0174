# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Storage files by the low-level readers of rosbags: the way for every file that is whole.

The high-level AnyReader is not used: it refuses a whole bag for one broken message definition.
"""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path

from rosbags import rosbag1, rosbag2
from rosbags.interfaces import Connection, ConnectionExtRosbag2, MessageDefinitionFormat, QosDurability

from vigg_ros.bags.storage import Channel, RawMessage

_ROS1_EMPTY_BYTES = 8_192
"""A ROS 1 bag's header is padded to 4,096 bytes; with what surrounds it, an empty bag stays below this."""

_DEFINITION_FORMATS = {MessageDefinitionFormat.MSG: "ros2msg", MessageDefinitionFormat.IDL: "ros2idl"}


class _BoundedFile(io.BufferedReader):
    """A file of which nobody can ask for more than it holds.

    rosbags reads as many bytes as a record says, and Python makes room for them before it reads: in a
    damaged file that would be gigabytes.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(io.FileIO(path))
        self._size = path.stat().st_size

    def read(self, size: int | None = -1, /) -> bytes:
        return super().read(size if size is None else min(size, self._size))


class _BoundedPath(type(Path())):  # type: ignore[misc]  # a concrete class, also before Python 3.12
    """A path that rosbags opens as a bounded file."""

    def open(self, *_: object, **__: object) -> _BoundedFile:
        return _BoundedFile(Path(self))


class IndexedFile:
    """A storage file (``storage.Storage``) read by rosbags, in the order of log time.

    Opening and reading raise whatever rosbags raises.
    """

    def __init__(self, path: Path) -> None:
        bounded = _BoundedPath(path)
        self._reader = rosbag1.Reader(bounded) if path.suffix == ".bag" else rosbag2.Reader(bounded)
        self._reader.open()
        if not self._reader.connections and path.suffix == ".bag" and path.stat().st_size > _ROS1_EMPTY_BYTES:
            self.close()
            raise ValueError("its header says that it is empty, which it is not")
        self._channels = {connection.id: _channel(connection) for connection in self._reader.connections}
        self.channels = tuple(dict.fromkeys(self._channels.values()))
        self.counts = self._count()
        self.stray = max(0, self._reader.message_count - self.counts.total())
        """Messages that the file counts, but that belong to none of its topics."""

    def _count(self) -> Counter[tuple[str, str]]:
        counts: Counter[tuple[str, str]] = Counter()
        for connection in self._reader.connections:
            counts[connection.topic, connection.msgtype] += connection.msgcount
        for topic, info in self._reader.topics.items():
            # ROS 1 bags count twice, and rosbags reads the other count here.
            if info.msgtype is not None:
                counts[topic, info.msgtype] = max(counts[topic, info.msgtype], info.msgcount)
        return counts

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """The messages of these topics by log time."""
        chosen = [connection for connection in self._reader.connections if connection.topic in topics]
        if not chosen:  # rosbags takes an empty choice for all
            return
        for connection, log_ns, data in self._reader.messages(chosen):
            yield RawMessage(self._channels[connection.id], log_ns, data)

    def close(self) -> None:
        """Close the reader."""
        self._reader.close()


def _channel(connection: Connection) -> Channel:
    extension = connection.ext
    if isinstance(extension, ConnectionExtRosbag2):
        encoding, profiles = extension.serialization_format, extension.offered_qos_profiles
        latched = any(qos.durability is QosDurability.TRANSIENT_LOCAL for qos in profiles)
    else:
        encoding, latched = "ros1", bool(extension.latching)
    return Channel(
        topic=connection.topic,
        type=connection.msgtype,
        encoding=encoding,
        definition=connection.msgdef.data,
        definition_format=_DEFINITION_FORMATS.get(connection.msgdef.format, ""),
        latched=latched,
    )
