# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Storage files by the low-level readers of rosbags: the way for every file that is whole.

The high-level AnyReader is not used: it refuses a whole bag for one broken message definition.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path

from rosbags import rosbag1, rosbag2
from rosbags.interfaces import Connection, ConnectionExtRosbag2, MessageDefinitionFormat

from vigg_ros.bags.storage import Channel, RawMessage

_FORMATS = {MessageDefinitionFormat.MSG: "ros2msg", MessageDefinitionFormat.IDL: "ros2idl"}


class IndexedFile:
    """A storage file (``storage.Storage``) read by rosbags, in the order of log time.

    Opening and reading raise whatever rosbags raises.
    """

    def __init__(self, path: Path) -> None:
        self._reader = rosbag1.Reader(path) if path.suffix == ".bag" else rosbag2.Reader(path)
        self._reader.open()
        self._is_open = True
        self._channels = {connection.id: _channel(connection) for connection in self._reader.connections}
        self.channels = tuple(dict.fromkeys(self._channels.values()))
        self.counts: Counter[tuple[str, str]] = Counter()
        for connection in self._reader.connections:
            self.counts[self._channels[connection.id].key] += connection.msgcount

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """The messages of these topics by log time."""
        chosen = [connection for connection in self._reader.connections if connection.topic in topics]
        if not chosen:  # rosbags takes an empty choice for all
            return
        for connection, log_ns, data in self._reader.messages(chosen):
            yield RawMessage(self._channels[connection.id], log_ns, data)

    def close(self) -> None:
        """Close the reader."""
        if self._is_open:
            self._is_open = False
            self._reader.close()


def _channel(connection: Connection) -> Channel:
    extension = connection.ext
    return Channel(
        topic=connection.topic,
        type=connection.msgtype,
        encoding=extension.serialization_format if isinstance(extension, ConnectionExtRosbag2) else "ros1",
        definition=connection.msgdef.data,
        definition_format=_FORMATS.get(connection.msgdef.format, ""),
    )
