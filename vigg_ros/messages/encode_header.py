# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stamps and headers as message fields."""

from __future__ import annotations

from vigg_ros.messages.fields import Message
from vigg_ros.sensors.header import NS_PER_S


def encode_time(stamp_ns: int) -> Message:
    """builtin_interfaces/Time of integer nanoseconds, exact. Raises ValueError for 0 and past 2038."""
    sec, nanosec = divmod(stamp_ns, NS_PER_S)
    if stamp_ns <= 0 or sec >= 2**31:
        raise ValueError(f"found a stamp of {stamp_ns} ns, expected more than 0 and less than 2**31 s")
    return Message("builtin_interfaces/msg/Time", {"sec": sec, "nanosec": nanosec})


def encode_header(stamp_ns: int, frame_id: str) -> Message:
    """std_msgs/Header."""
    return Message("std_msgs/msg/Header", {"stamp": encode_time(stamp_ns), "frame_id": frame_id})
