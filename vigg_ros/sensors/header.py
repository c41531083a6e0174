# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stamps and frame names.

Here and in the other decoders a message is whatever has its attributes: rclpy's classes do, and so do those of rosbags.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.message_limits import shortened
from vigg_ros.sensors.observation import Note

NS_PER_S = 1_000_000_000

RESTART_STEP_NS = NS_PER_S
"""A topic whose stamps step back by at least this much has started again (a bag in a loop, a restarted clock)."""

MAX_FRAME_ID_LENGTH = 256


@dataclass(frozen=True, slots=True)
class Header:
    """Who saw it and when."""

    stamp_ns: int
    frame_id: str
    notes: tuple[Note, ...]


def stamp_ns(stamp: Any, *, zero_allowed: bool = False) -> int:
    """A builtin_interfaces/Time in integer nanoseconds, exact. Raises DataError for 0, negative and malformed ones."""
    sec, nanosec = int(stamp.sec), int(stamp.nanosec)
    if sec < 0 or not 0 <= nanosec < NS_PER_S:
        raise DataError(
            "STAMP_INVALID", found=f"stamp sec {sec}, nanosec {nanosec}",
            expected="sec >= 0 and 0 <= nanosec < 1,000,000,000", remedy="check the driver's clock",
        )
    if sec == nanosec == 0 and not zero_allowed:
        raise DataError(
            "STAMP_ZERO", found="stamp 0",
            expected="the time of acquisition",
            remedy="let the driver fill header.stamp; poses are published at that time",
        )
    return sec * NS_PER_S + nanosec


def read_header(header: Any, *, zero_stamp_allowed: bool = False) -> Header:
    """Stamp and frame of a std_msgs/Header; a leading slash (tf1) is dropped with a note, an empty frame noted.

    A zero stamp is allowed for what holds at any time: calibrations and static transforms.
    """
    notes: list[Note] = []
    frame_id = read_frame_id(header.frame_id, notes)
    return Header(stamp_ns(header.stamp, zero_allowed=zero_stamp_allowed), frame_id, tuple(notes))


def read_frame_id(text: str, notes: list[Note]) -> str:
    """A frame's name as tf2 knows it; what is odd about it is added to the notes."""
    if len(text) > MAX_FRAME_ID_LENGTH or not text.isprintable():
        raise DataError(
            "FRAME_ID_INVALID", found=f"frame_id {shortened(text)}",
            expected=f"at most {MAX_FRAME_ID_LENGTH} printable characters",
            remedy="set the driver's frame_id parameter",
        )
    frame_id = text.lstrip("/")
    if frame_id != text:
        notes.append(Note("FRAME_ID_SLASH", f"frame_id {text!r}", f"taken as {frame_id!r}", "tf2 knows no slash"))
    if not frame_id:
        taken = "accepted where no transform is needed"
        notes.append(Note("FRAME_ID_EMPTY", "an empty frame_id", taken, "set the driver's frame_id parameter"))
    return frame_id
