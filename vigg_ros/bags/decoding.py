# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recorded bytes to message objects, and to header stamps without building the message."""

from __future__ import annotations

import struct
from functools import cache

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from vigg_ros.bags.losses import in_one_line
from vigg_ros.bags.mcap import UNPACKED_BYTES_MAX, Broken, decompress
from vigg_ros.bags.storage import Channel, RawMessage
from vigg_ros.sensors.header import NS_PER_S

_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_HEADER_FIELD = ("header", (Nodetype.NAME, "std_msgs/msg/Header"))
_IDL_SEPARATOR = "=" * 80 + "\n"


class Undecodable(Exception):
    """One message whose bytes are not a message of its type."""


@cache
def message_types() -> Typestore:
    """The message types of ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


class Decoder:
    """Deserialises messages. Types that Jazzy knows are read by its definitions, others by the bag's.

    So a broken definition of a standard type, or of another topic, does no harm. ROS 1 messages come
    out with the field names of ROS 2.
    """

    def __init__(self) -> None:
        self._stores: dict[tuple[str, str], Typestore | str] = {}

    def message(self, raw: RawMessage) -> object:
        """The message object, with the attributes of its ROS 2 type; raises Undecodable."""
        store = self._store(raw.channel)
        try:
            data, name = unpack(raw.data), raw.channel.type
            if raw.channel.encoding == "cdr":
                return store.deserialize_cdr(data, name)
            if store is message_types():
                return store.deserialize_cdr(store.ros1_to_cdr(data, name), name)
            return store.deserialize_ros1(data, name)
        except Exception as error:  # generated code on arbitrary bytes fails in ways nobody lists
            raise Undecodable(in_one_line(error)) from error

    def cdr(self, raw: RawMessage) -> bytes:
        """The message as ROS 2 serialises it; raises Undecodable, for bytes that are no message too.

        Whoever subscribes shall not have to cope with what a damaged bag holds, so it is read once.
        """
        message = self.message(raw)
        if raw.channel.encoding == "cdr":
            return unpack(raw.data)
        try:
            return bytes(self._store(raw.channel).serialize_cdr(message, raw.channel.type))
        except Exception as error:  # as above
            raise Undecodable(in_one_line(error)) from error

    def _store(self, channel: Channel) -> Typestore:
        if channel.encoding not in ("cdr", "ros1"):
            raise Undecodable(f"its encoding is {channel.encoding[:40]!r}, expected CDR or ROS 1")
        if channel.type in message_types().fielddefs:
            return message_types()
        key = channel.type, channel.definition
        if key not in self._stores:
            self._stores[key] = _own_store(channel)
        store = self._stores[key]
        if isinstance(store, str):
            raise Undecodable(store)
        return store


def _own_store(channel: Channel) -> Typestore | str:
    """A type store by the definition embedded in the bag, or why there is none."""
    if not channel.definition:
        return f"the type {channel.type[:80]} is unknown and the bag does not define it"
    try:
        store = get_typestore(Stores.EMPTY)
        if channel.definition_format == "ros2idl":
            for text in _idl_texts(channel.definition):
                store.register(get_types_from_idl(text))
        else:
            store.register(get_types_from_msg(channel.definition, channel.type))
        store.get_msgdef(channel.type)
    except Exception as error:  # a parser on arbitrary text fails in ways nobody lists
        return f"the bag's definition of {channel.type[:80]} is broken ({type(error).__name__})"
    return store


def _idl_texts(definition: str) -> list[str]:
    """The IDL files of a definition, which rosbag2 joins with a line of ``=`` and a title before each."""
    if not definition.startswith(_IDL_SEPARATOR):
        return [definition]
    return [text.partition("\n")[2] for text in definition.split(_IDL_SEPARATOR)[1:]]


def unpack(data: bytes) -> bytes:
    """The serialised message, unpacked if the recorder packed messages one by one.

    zstd's magic number cannot begin a CDR message, whose first byte is 0. Raises mcap.Broken.
    """
    unpacked = decompress(data, "zstd", UNPACKED_BYTES_MAX) if data.startswith(_ZSTD_MAGIC) else data
    if len(unpacked) > UNPACKED_BYTES_MAX:
        raise Broken(f"a message of more than {UNPACKED_BYTES_MAX} bytes")
    return unpacked


def header_stamp_ns(raw: RawMessage) -> int | None:
    """The stamp in the header of a message; None if its type begins with no header or it is too short.

    In both serialisations the stamp's two words follow one word: the CDR encapsulation, or the
    sequence number of a ROS 1 header.
    """
    fields = message_types().fielddefs.get(raw.channel.type, ([], []))[1]
    try:
        data = decompress(raw.data, "zstd", 12) if raw.data.startswith(_ZSTD_MAGIC) else raw.data
    except Broken:
        return None
    if not fields or fields[0] != _HEADER_FIELD or len(data) < 12:
        return None
    big_endian = raw.channel.encoding == "cdr" and data[1] == 0
    seconds, nanoseconds = struct.unpack_from(">iI" if big_endian else "<iI", data, 4)
    return int(seconds) * NS_PER_S + int(nanoseconds)
