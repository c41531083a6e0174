# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writes rosbag2 bags of messages as the encoders of ``messages`` make them."""

from __future__ import annotations

import os
import sqlite3
from contextlib import suppress
from pathlib import Path
from typing import Literal

from rosbags.interfaces import Connection, Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer, WriterError

from vigg_ros.bags.decoding import message_types
from vigg_ros.messages.fields import ROSBAGS, Message, build
from vigg_ros.registration.errors import BagError

Compression = Literal["none", "chunk", "message", "file"]

_STORAGES = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}
_COMPRESSIONS = {
    "none": CompressionMode.NONE,
    "chunk": CompressionMode.STORAGE,
    "message": CompressionMode.MESSAGE,
    "file": CompressionMode.FILE,
}
_WRITE_ERRORS = (OSError, WriterError, sqlite3.Error)
_INFINITE_TIME = QosTime(9223372036, 854775807)
_LATCHED_QOS = Qos(
    history=QosHistory.KEEP_LAST,
    depth=1,
    reliability=QosReliability.RELIABLE,
    durability=QosDurability.TRANSIENT_LOCAL,
    deadline=_INFINITE_TIME,
    lifespan=_INFINITE_TIME,
    liveliness=QosLiveliness.AUTOMATIC,
    liveliness_lease_duration=_INFINITE_TIME,
    avoid_ros_namespace_conventions=False,
)
"""What tf2 asks of /tf_static: who comes late gets the last message. The times are rmw's "infinite"."""


class BagWriteError(BagError):
    """A bag that cannot be written as asked; the user can ask for another path or storage."""


class BagWriter:
    """A new bag in a new folder, opened by ``with``. The same messages give the same bytes.

    Raises BagWriteError when the path exists already (as a dangling symbolic link too), cannot be written,
    or the disk is full. A bag that could not be finished has no metadata.yaml; it is left in place.
    Packing slows reading down: ``chunk`` (mcap only), ``message`` and ``file`` by zstd are for archives.
    """

    def __init__(
        self, path: Path | str, *, storage: Literal["mcap", "sqlite3"] = "mcap", compression: Compression = "none"
    ) -> None:
        self.path = Path(path)
        if compression == "chunk" and storage != "mcap":
            raise BagWriteError("compression by chunk needs the storage mcap; use message or file with sqlite3")
        if storage == "sqlite3" and set("?#%") & set(str(self.path)):
            raise BagWriteError(f"{self.path}: sqlite3 bags cannot be written to paths with ?, # or %; use mcap")
        if os.path.lexists(self.path):
            raise BagWriteError(f"{self.path} exists already and is not overwritten; give another path")
        self._writer = Writer(self.path, version=9, storage_plugin=_STORAGES[storage])
        self._writer.set_compression(_COMPRESSIONS[compression], CompressionFormat.ZSTD)
        self._connections: dict[tuple[str, str], Connection] = {}

    def __enter__(self) -> BagWriter:
        try:
            self._writer.open()
        except _WRITE_ERRORS as error:
            raise self._failure(error) from error
        return self

    def __exit__(self, exception_type: type[BaseException] | None, *_: object) -> None:
        try:
            if exception_type is None:
                self._writer.close()
        except _WRITE_ERRORS as error:
            raise self._failure(error) from error
        finally:
            with suppress(Exception):  # nothing is left to abort after a good close
                self._writer.abort()

    def write(self, topic: str, message: Message, *, log_ns: int) -> None:
        """Append a message, recorded at this time, to a topic (/tf_static is marked as latched)."""
        store = message_types()
        data = store.serialize_cdr(build(message, store.types.__getitem__, ROSBAGS), message.type)
        try:
            self._writer.write(self._connection(topic, message.type), log_ns, data)
        except _WRITE_ERRORS as error:
            raise self._failure(error) from error

    def _connection(self, topic: str, type_name: str) -> Connection:
        key = topic, type_name
        if key not in self._connections:
            self._connections[key] = self._writer.add_connection(
                topic,
                type_name,
                typestore=message_types(),
                offered_qos_profiles=[_LATCHED_QOS] if topic == "/tf_static" else [],
            )
        return self._connections[key]

    def _failure(self, error: Exception) -> BagWriteError:
        return BagWriteError(f"{self.path} cannot be written: {error}; free space or give another path")
