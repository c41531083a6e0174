# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One storage file, read by rosbags as far as that goes and by the sequential readers beyond."""

from __future__ import annotations

import shutil
import sqlite3
from collections import Counter, defaultdict
from collections.abc import Collection, Iterator
from pathlib import Path

from vigg_ros.bags.indexed import IndexedFile
from vigg_ros.bags.losses import Ledger, in_one_line
from vigg_ros.bags.mcap import McapScan, zstd
from vigg_ros.bags.sqlite import SqliteRows, is_cut
from vigg_ros.bags.storage import RawMessage, Storage
from vigg_ros.registration.errors import BagError

_REMEDIES = {
    ".mcap": "copy it again, or rescue what is left with 'mcap recover'",
    ".db3": "copy it again, or rescue what is left with sqlite3's '.recover'",
    ".bag": "copy it again, or rebuild its index with 'rosbag reindex'",
}


class StorageFile:
    """A storage file (``storage.Storage``) that hands on every readable message exactly once.

    Opening raises BagError with a remedy when nothing can be read; reading raises nothing, what cannot
    be read goes to the ledger. ``cut`` tells that the end of the file is missing.
    """

    def __init__(self, path: Path, ledger: Ledger) -> None:
        self._path = path
        self._remedy = _REMEDIES[path.suffix]
        self._ledger = ledger
        self._check_size()
        self._primary = self._open()
        self.channels = self._primary.channels
        self.counts = self._primary.counts
        self.cut = isinstance(self._primary, McapScan) and self._primary.cut

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """The readable messages of these topics, in the order of log time for an undamaged file."""
        delivered: defaultdict[str, list[int]] = defaultdict(list)
        try:
            yield from _unseen(self._primary.messages(topics), delivered)
            return
        except Exception as error:  # damaged files make rosbags fail in ways nobody lists
            failure = f"{self._path.name}: {in_one_line(error)}"
        fallback = self._open_fallback()
        if fallback is None:
            self._ledger.damage(f"{failure}; what follows is lost")
            return
        self._ledger.note(f"{failure}; the rest is read front to back, without the index")
        try:
            yield from _unseen(fallback.messages(topics), delivered)
        except Exception as error:  # as above
            self._ledger.damage(f"{self._path.name}: {in_one_line(error)}; what follows is lost")
        finally:
            fallback.close()

    def close(self) -> None:
        """Release the file."""
        self._primary.close()

    def _check_size(self) -> None:
        if self._path.stat().st_size == 0:
            raise BagError(f"{self._path} is empty (0 bytes): nothing was recorded, or the copy failed")
        if self._path.suffix == ".db3" and is_cut(self._path):
            raise BagError(f"{self._path} is cut: it is shorter than its header says; {self._remedy}")
        journal = self._path.with_name(self._path.name + "-wal")
        if journal.is_file() and journal.stat().st_size:
            self._ledger.damage(
                f"{journal.name} holds messages that were never merged; "
                f"do it with sqlite3 {self._path.name} 'PRAGMA wal_checkpoint' and read the bag again"
            )

    def _open(self) -> Storage:
        try:
            indexed = IndexedFile(self._path)
            if indexed.stray:
                self._ledger.damage(f"{self._path.name}: {indexed.stray} messages belong to no topic")
            return indexed
        except Exception as error:  # as above
            fallback = self._open_fallback()
            words = in_one_line(error)
            if fallback is None:
                raise BagError(f"{self._path} cannot be read ({words}); {self._remedy}") from error
            self._ledger.note(f"{self._path.name} is read front to back, without its index ({words})")
            return fallback

    def _open_fallback(self) -> Storage | None:
        """The sequential reader for this file; None if there is none or it finds no message."""
        fallback: Storage | None = None
        try:
            if self._path.suffix == ".mcap":
                fallback = McapScan(self._path, self._ledger)
            elif self._path.suffix == ".db3":
                fallback = SqliteRows(self._path, self._ledger)
        except (OSError, sqlite3.Error, UnicodeDecodeError):
            return None
        return fallback if fallback is not None and fallback.counts else None


def _unseen(raws: Iterator[RawMessage], delivered: defaultdict[str, list[int]]) -> Iterator[RawMessage]:
    """The messages beyond those that were delivered before; the log times of what is delivered are added."""
    repeated = Counter((topic, log_ns) for topic, times in delivered.items() for log_ns in times)
    for raw in raws:
        key = raw.channel.topic, raw.log_ns
        if repeated[key]:
            repeated[key] -= 1
        else:
            delivered[raw.channel.topic].append(raw.log_ns)
            yield raw


def unpack_file(path: Path, folder: Path, ledger: Ledger) -> Path:
    """The storage file itself if it is not packed as a whole (.zstd), else its unpacked copy in a folder.

    Raises BagError when the disk has no room for it.
    """
    if path.suffix != ".zstd":
        return path
    unpacked = folder / path.stem
    try:
        with zstd.open(path, "rb") as source, unpacked.open("wb") as target:
            shutil.copyfileobj(source, target)
    except (zstd.ZstdError, EOFError) as error:
        ledger.damage(f"{path.name} cannot be unpacked to its end ({error})")
    except OSError as error:
        raise BagError(f"{path} cannot be unpacked into {folder}: {error}") from error
    return unpacked
