# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""diagnostic_msgs: how well a part of the system does, as message fields."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vigg_ros.messages.fields import Message, stamped

OK, WARN, ERROR = range(3)
"""Levels of diagnostic_msgs/DiagnosticStatus."""


def encode_diagnostic_status(
    level: int, name: str, message: str, *, values: Mapping[str, object], hardware_id: str = ""
) -> Message:
    """diagnostic_msgs/DiagnosticStatus; values become text, in their order."""
    pairs = (Message.of("diagnostic_msgs/msg/KeyValue", key=key, value=str(value)) for key, value in values.items())
    return Message.of(
        "diagnostic_msgs/msg/DiagnosticStatus",
        level=bytes((level,)),
        name=name,
        message=message,
        hardware_id=hardware_id,
        values=tuple(pairs),
    )


def encode_diagnostic_array(statuses: Sequence[Message], *, stamp_ns: int) -> Message:
    """diagnostic_msgs/DiagnosticArray of DiagnosticStatus messages."""
    return stamped("diagnostic_msgs/msg/DiagnosticArray", stamp_ns, "", status=tuple(statuses))
