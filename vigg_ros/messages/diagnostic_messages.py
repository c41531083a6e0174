# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""diagnostic_msgs: how well a part of the system does, and what became of a frame, as message fields."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vigg_ros.messages.fields import Message, stamped
from vigg_ros.tracking.columns import known_values_of, timing_name
from vigg_ros.tracking.frame_result import FrameResult, State

OK, WARN, ERROR = range(3)
"""Levels of diagnostic_msgs/DiagnosticStatus."""

STATUS_LEVELS = {State.LOST: ERROR} | dict.fromkeys((State.STARTED, State.TRACKING, State.PAUSED, State.SKIPPED), OK)
"""Of a frame by its state; all others are warnings."""


def encode_diagnostic_status(
    level: int, name: str, message: str, *, values: Mapping[str, object], hardware_id: str = ""
) -> Message:
    """diagnostic_msgs/DiagnosticStatus; values become text, in their order."""
    pairs = (Message.of("diagnostic_msgs/msg/KeyValue", key=key, value=str(value)) for key, value in values.items())
    return Message.of(
        "diagnostic_msgs/msg/DiagnosticStatus",
        level=bytes((level,)), name=name, message=message, hardware_id=hardware_id, values=tuple(pairs),
    )


def encode_diagnostic_array(statuses: Sequence[Message], *, stamp_ns: int) -> Message:
    """diagnostic_msgs/DiagnosticArray of DiagnosticStatus messages."""
    return stamped("diagnostic_msgs/msg/DiagnosticArray", stamp_ns, "", status=tuple(statuses))


def frame_status(node: str, result: FrameResult, counts: Mapping[str, int] | None = None) -> Message:
    """What ~/status says of one frame, live and in a result bag; ``counts`` of frames so far are added."""
    values: dict[str, object] = {**known_values_of(result), **(counts or {})}
    values |= {timing_name(stage): f"{ms:.2f}" for stage, ms in result.timings_ms.items()}
    text = " ".join(part for part in (result.state.value, result.reason) if part)
    text += f": {result.message}" if result.message else ""
    level = STATUS_LEVELS.get(result.state, WARN)
    return encode_diagnostic_status(level, node, text, values=values, hardware_id=result.frame_id)
