# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads an MCAP file front to back, without its index, past what is broken.

The reader of rosbags needs the index at the end of the file, which an unfinished recording lacks, and
stops at the first broken chunk. This one serves where that one gives up. Format: the MCAP
specification, https://mcap.dev/spec (records of opcode, length, content; little-endian).
"""

from __future__ import annotations

import struct
import sys
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import BinaryIO
from zlib import crc32

from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]

from vigg_ros.bags.losses import Ledger
from vigg_ros.bags.storage import Channel, RawMessage

if sys.version_info >= (3, 14):
    from compression import zstd as zstd
else:
    from backports import zstd as zstd

MAGIC = b"\x89MCAP0\r\n"
UNPACKED_BYTES_MAX = 2**29
"""Above this a chunk or message is not believed: recorders cut chunks at about a megabyte, and the
largest image accepted later has 64 megapixels."""

_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _STATISTICS, _DATA_END = 0x03, 0x04, 0x05, 0x06, 0x0B, 0x0F
_OPCODES_READ = (_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _STATISTICS, _DATA_END)


class Broken(Exception):
    """A record that cannot be what it says."""


class McapScan:
    """A storage file (``storage.Storage``) for damaged and unfinished .mcap files.

    Counts the messages by reading the whole file once. Damage goes to the ledger.
    """

    def __init__(self, path: Path, ledger: Ledger) -> None:
        self._finished = False
        self._promised: Counter[tuple[str, str]] = Counter()
        self._path = path
        self._ledger = ledger
        self._schemas: dict[int, tuple[str, str, str]] = {}
        self._channels: dict[int, Channel] = {}
        found = Counter(raw.channel.key for raw in self._scan())
        self.channels = tuple(dict.fromkeys(self._channels.values()))
        self.counts = found | self._promised
        self.cut = not self._finished and not _ends_with_magic(path)
        """Whether the end is missing: a copy that was cut short, or a recording that was never closed."""

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """The readable messages of these topics, in the order of the file."""
        return (raw for raw in self._scan() if raw.channel.topic in topics)

    def close(self) -> None:
        """Nothing stays open between readings."""

    def _scan(self) -> Iterator[RawMessage]:
        with self._path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                self._damage("the beginning of the file is not MCAP's")
            size = self._path.stat().st_size
            try:
                for opcode, content in _file_records(file, size):
                    yield from self._record(opcode, content, file.tell())
            except Broken as broken:
                if not self._finished:
                    self._damage(f"byte {file.tell()} of {size}: {broken}; what follows is lost")

    def _record(self, opcode: int, content: bytes, position: int) -> Iterator[RawMessage]:
        """The messages of one record of the file; a broken record is reported and skipped."""
        try:
            if opcode == _CHUNK:
                for inner, inner_content in _buffer_records(_unpack_chunk(content)):
                    yield from self._simple_record(inner, inner_content)
            else:
                yield from self._simple_record(opcode, content)
        except (Broken, struct.error, UnicodeDecodeError) as broken:
            self._damage(f"a record that ends at byte {position} is broken: {broken}")

    def _simple_record(self, opcode: int, content: bytes) -> Iterator[RawMessage]:
        if opcode == _MESSAGE:
            channel_id, _, log_ns, _ = struct.unpack_from("<HIQQ", content)
            if channel_id in self._channels:
                yield RawMessage(self._channels[channel_id], log_ns, content[22:])
            else:
                self._damage(f"messages of channel {channel_id}, which no readable record describes")
        elif opcode == _SCHEMA:
            self._schemas.setdefault(*_parse_schema(content))
        elif opcode == _CHANNEL:
            self._channels.setdefault(*_parse_channel(content, self._schemas))
        elif opcode == _STATISTICS:
            self._promised = self._parse_statistics(content)
        elif opcode == _DATA_END:
            self._finished = True

    def _parse_statistics(self, content: bytes) -> Counter[tuple[str, str]]:
        (size,) = struct.unpack_from("<I", content, 42)
        promised: Counter[tuple[str, str]] = Counter()
        for channel_id, count in struct.iter_unpack("<HQ", content[46 : 46 + size]):
            if channel_id in self._channels:
                promised[self._channels[channel_id].key] += count
        return promised

    def _damage(self, text: str) -> None:
        self._ledger.damage(f"{self._path.name}: {text}")


def _file_records(file: BinaryIO, size: int) -> Iterator[tuple[int, bytes]]:
    """Opcodes and contents of the records that matter here, up to the end of the file.

    Lengths are compared with the file's size before anything is read: a flipped bit must not ask for
    terabytes. The content of a record too large to be believed is left out, which makes it a broken one.
    """
    while (head := file.read(9))[: len(MAGIC)] != MAGIC:
        if len(head) < 9:
            raise Broken("the file ends without the mark that a recorder writes on closing")
        opcode, length = struct.unpack("<BQ", head)
        if length > size - file.tell():
            raise Broken(f"a record of {length} bytes, of which {size - file.tell()} are there")
        if opcode not in _OPCODES_READ or length > UNPACKED_BYTES_MAX:
            file.seek(length, 1)
        if opcode in _OPCODES_READ:
            yield opcode, file.read(length) if length <= UNPACKED_BYTES_MAX else b""


def _ends_with_magic(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-min(len(MAGIC), path.stat().st_size), 2)
        return file.read() == MAGIC


def _buffer_records(buffer: bytes) -> Iterator[tuple[int, bytes]]:
    start = 0
    while start < len(buffer):
        if len(buffer) - start < 9:
            raise Broken("a chunk that ends within a record")
        opcode, length = struct.unpack_from("<BQ", buffer, start)
        if opcode not in (_SCHEMA, _CHANNEL, _MESSAGE) or length > len(buffer) - start - 9:
            raise Broken(f"a record of kind {opcode} and {length} bytes within a chunk")
        yield opcode, buffer[start + 9 : start + 9 + length]
        start += 9 + length


def _unpack_chunk(content: bytes) -> bytes:
    _, _, size, crc = struct.unpack_from("<QQQI", content)
    compression, position = _string(content, 28)
    (packed_size,) = struct.unpack_from("<Q", content, position)
    packed = content[position + 8 : position + 8 + packed_size]
    if size > UNPACKED_BYTES_MAX or len(packed) != packed_size:
        raise Broken(f"a chunk of {size} bytes, packed {packed_size}, in {len(content)}")
    buffer = decompress(packed, compression, size)
    if len(buffer) != size or (crc and crc32(buffer) != crc):
        raise Broken("a chunk that fails its size or checksum")
    return buffer


def decompress(packed: bytes, compression: str, size_max: int) -> bytes:
    """Unpacked bytes, never more than size_max + 1; compression is ``zstd``, ``lz4`` or empty."""
    try:
        if compression == "zstd":
            return zstd.ZstdDecompressor().decompress(packed, max_length=size_max + 1)
        if compression == "lz4":
            return bytes(LZ4FrameDecompressor().decompress(packed, max_length=size_max + 1))
    except (zstd.ZstdError, RuntimeError, EOFError) as error:
        raise Broken(f"{compression} data that cannot be unpacked ({error})") from error
    if compression:
        raise Broken(f"the unknown compression {compression[:20]!r}")
    return packed


def _parse_schema(content: bytes) -> tuple[int, tuple[str, str, str]]:
    (schema_id,) = struct.unpack_from("<H", content)
    name, position = _string(content, 2)
    encoding, position = _string(content, position)
    definition, _ = _string(content, position)
    return schema_id, (name, encoding, definition)


def _parse_channel(content: bytes, schemas: dict[int, tuple[str, str, str]]) -> tuple[int, Channel]:
    channel_id, schema_id = struct.unpack_from("<HH", content)
    topic, position = _string(content, 4)
    encoding, _ = _string(content, position)
    name, definition_format, definition = schemas.get(schema_id, ("", "", ""))
    return channel_id, Channel(topic, name, encoding, definition, definition_format)


def _string(content: bytes, position: int) -> tuple[str, int]:
    """The length-prefixed string at a position, and where it ends."""
    (length,) = struct.unpack_from("<I", content, position)
    end = position + 4 + length
    if end > len(content):
        raise Broken(f"a text of {length} bytes beyond its record")
    return content[position + 4 : end].decode(), end
