# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Moves the stamps of serialised messages, so that a recording seems to be taken now."""

from __future__ import annotations

import struct
from dataclasses import replace

from vigg_ros.bags.decoding import message_types
from vigg_ros.bags.reader import SerialisedMessage
from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.point_cloud import moved_point_times

_TF = "tf2_msgs/msg/TFMessage"
_POINTS = "sensor_msgs/msg/PointCloud2"
_SECOND_NS = 1_000_000_000
_STAMP_OFFSET = 4
"""CDR: a header's stamp follows the four bytes of the encapsulation."""


def moved(message: SerialisedMessage, shift_ns: int) -> SerialisedMessage:
    """The message with the stamp of its header, or those of its transforms, later by ``shift_ns``.

    In a point cloud times of the clock move along, or they would be far from the stamp.

    Stamps of 0 stay ("always", in static transforms; in images a fault that shall stay visible), and so
    do those that would leave the range of builtin_interfaces/Time.
    """
    if message.type == _TF:
        return replace(message, data=_moved_transforms(message.data, shift_ns))
    if not message.stamp_ns or not _is_time(message.stamp_ns + shift_ns):
        return message
    data = bytearray(_moved_points(message.data, shift_ns) if message.type == _POINTS else message.data)
    endian = ">" if data[1] == 0 else "<"
    struct.pack_into(f"{endian}iI", data, _STAMP_OFFSET, *divmod(message.stamp_ns + shift_ns, _SECOND_NS))
    return replace(message, stamp_ns=message.stamp_ns + shift_ns, data=bytes(data))


def _is_time(stamp_ns: int) -> bool:
    return 0 < stamp_ns < 2**31 * _SECOND_NS


def _moved_transforms(data: bytes, shift_ns: int) -> bytes:
    store = message_types()
    message = store.deserialize_cdr(data, _TF)
    time = store.types["builtin_interfaces/msg/Time"]
    for transform in message.transforms:  # type: ignore[attr-defined]
        stamp = transform.header.stamp
        stamp_ns = stamp.sec * _SECOND_NS + stamp.nanosec
        if stamp_ns and _is_time(stamp_ns + shift_ns):
            sec, nanosec = divmod(stamp_ns + shift_ns, _SECOND_NS)
            transform.header.stamp = time(sec=sec, nanosec=nanosec)
    return bytes(store.serialize_cdr(message, _TF))


def _moved_points(data: bytes, shift_ns: int) -> bytes:
    store = message_types()
    cloud = store.deserialize_cdr(data, _POINTS)
    try:
        points = moved_point_times(cloud, shift_ns)  # type: ignore[arg-type]
    except DataError:
        return data  # a fault that shall stay visible
    if points is None:
        return data
    cloud.data = points  # type: ignore[attr-defined]
    return bytes(store.serialize_cdr(cloud, _POINTS))
