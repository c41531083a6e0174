# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads a damaged rosbag2 database row by row, past the rows that cannot be read.

The reader of rosbags asks for all rows in one query, which ends at the first broken page.
"""

from __future__ import annotations

import sqlite3
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from urllib.parse import quote

from vigg_ros.bags.losses import Ledger
from vigg_ros.bags.storage import Channel, RawMessage

_READ_ERRORS = (sqlite3.Error, UnicodeDecodeError)
"""The second comes from damaged names that sqlite3 wants to quote in the first."""

_FAILURES_MAX = 1_000
"""Consecutive unreadable row numbers after which the rest of the table is given up."""

_STRIDE_ROWS = 100
"""After half as many, a page with thousands of rows must be broken: go on in larger steps."""


class SqliteRows:
    """A storage file (``storage.Storage``) for damaged .db3 files.

    Opening counts the messages by reading all of them once, and raises sqlite3.Error or UnicodeDecodeError
    when not even the list of topics is readable.
    """

    def __init__(self, path: Path, ledger: Ledger) -> None:
        self._path = path
        self._ledger = ledger
        self._database = sqlite3.connect(f"file:{quote(str(path))}?mode=ro&immutable=1", uri=True)
        self._database.text_factory = lambda text: text.decode(errors="replace")
        try:
            self._by_id = self._read_channels()
        except _READ_ERRORS:
            self._database.close()
            raise
        self.channels = tuple(dict.fromkeys(self._by_id.values()))
        topics = {channel.topic for channel in self.channels}
        self.counts = Counter(raw.channel.key for raw in self.messages(topics))

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """The readable messages of these topics, in the order of recording."""
        for topic_id, log_ns, data in self._rows():
            channel = self._by_id.get(topic_id) if isinstance(topic_id, int) else None
            if channel is None or not isinstance(log_ns, int) or not isinstance(data, bytes):
                self._ledger.damage(f"{self._path.name}: rows without a topic, a time or a message")
            elif channel.topic in topics:
                yield RawMessage(channel, log_ns, data)

    def close(self) -> None:
        """Close the database."""
        self._database.close()

    def _rows(self) -> Iterator[tuple[object, object, object]]:
        """Topic id, log time and data of every readable row; types unchecked, as damage may change them."""
        query = "SELECT id, topic_id, timestamp, data FROM messages WHERE id > ? ORDER BY id"
        last_id, failures = 0, 0
        while failures < _FAILURES_MAX:
            try:
                for row_id, topic_id, log_ns, data in self._database.execute(query, (last_id,)):
                    if row_id > last_id:  # broken pages can lead back to rows that were read already
                        last_id, failures = row_id, 0
                        yield topic_id, log_ns, data
                return
            except _READ_ERRORS as error:
                self._ledger.damage(f"{self._path.name}: rows that cannot be read ({error})")
                failures += 1
                last_id += 1 if failures < _FAILURES_MAX // 2 else _STRIDE_ROWS

    def _read_channels(self) -> dict[int, Channel]:
        rows = self._database.execute("SELECT id, name, type, serialization_format FROM topics").fetchall()
        definitions = self._read_definitions()
        return {
            row_id: Channel(topic, type_name, encoding, *definitions.get(type_name, ("", "")))
            for row_id, topic, type_name, encoding in rows
            if all(isinstance(text, str) for text in (topic, type_name, encoding))
        }

    def _read_definitions(self) -> dict[str, tuple[str, str]]:
        """Definition and format per type; bags before Iron hold none."""
        query = "SELECT topic_type, encoded_message_definition, encoding FROM message_definitions"
        try:
            rows = self._database.execute(query).fetchall()
        except _READ_ERRORS:
            return {}
        return {row[0]: (row[1], row[2]) for row in rows if all(isinstance(text, str) for text in row)}


def is_cut(path: Path) -> bool:
    """Whether the file is shorter than its header says (SQLite file format, 1.3.7: size in pages)."""
    with path.open("rb") as file:
        header = file.read(100)
    page_bytes = int.from_bytes(header[16:18], "big")
    page_bytes = 65536 if page_bytes == 1 else page_bytes
    pages = int.from_bytes(header[28:32], "big")
    # The size is valid only if the version-valid-for number equals the change counter.
    valid = len(header) == 100 and header[24:28] == header[92:96]
    return valid and path.stat().st_size < page_bytes * pages
