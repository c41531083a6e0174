# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A FrameResult as diagnostic_msgs/DiagnosticStatus: what ~/status says of a frame, live and in a result bag."""

from __future__ import annotations

from collections.abc import Mapping

from vigg_ros.messages.diagnostic_messages import ERROR, OK, WARN, encode_diagnostic_status
from vigg_ros.messages.fields import Message
from vigg_ros.tracking.columns import known_values_of, timing_name
from vigg_ros.tracking.frame_result import FrameResult, State

STATUS_LEVELS = {
    State.STARTED: OK,
    State.TRACKING: OK,
    State.RELOCALISED: WARN,
    State.LOST: ERROR,
    State.PAUSED: OK,
    State.SKIPPED: OK,
}
"""All others are warnings."""


def frame_status(node: str, result: FrameResult, counts: Mapping[str, int] | None = None) -> Message:
    """What became of one frame, as the node of this name tells it; ``counts`` of frames so far are added."""
    values: dict[str, object] = {**known_values_of(result), **(counts or {})}
    values |= {timing_name(stage): f"{ms:.2f}" for stage, ms in result.timings_ms.items()}
    text = " ".join(part for part in (result.state.value, result.reason) if part)
    text += f": {result.message}" if result.message else ""
    level = STATUS_LEVELS.get(result.state, WARN)
    return encode_diagnostic_status(level, node, text, values=values, hardware_id=result.frame_id)
