# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Answers and findings as diagnostic_msgs/DiagnosticStatus."""

from __future__ import annotations

import math
from collections.abc import Sequence

from vigg_ros.messages.diagnostic_messages import ERROR, OK, WARN, encode_diagnostic_status
from vigg_ros.messages.fields import Message
from vigg_ros.node.answer import Answer, Fate
from vigg_ros.node.frame_statistics import Tally
from vigg_ros.node.input_monitor import InputMonitor
from vigg_ros.node.watchdog import Finding
from vigg_ros.tracking.registrar import State

_LEVELS = {
    State.STARTED.value: OK,
    State.TRACKING.value: OK,
    State.RELOCALISED.value: WARN,
    State.LOST.value: ERROR,
    Fate.PAUSED.value: OK,
    Fate.SKIPPED.value: OK,
}
_EVIDENCE = (
    "visual_matches", "visual_inliers", "geometric_inliers", "rmse_m", "overlap", "consistency", "conflict", "likeness",
)  # fmt: skip


def frame_status(node: str, answer: Answer, tally: Tally) -> Message:
    """What became of one frame, as ``~/status`` of the node of this name tells it."""
    values: dict[str, object] = {"stamp_ns": answer.stamp_ns, "session": answer.session, "state": answer.state}
    values |= {"reason": answer.reason, "frames_received": tally.received, "frames_dropped": tally.dropped}
    estimate = answer.estimate
    if estimate is not None:
        values["keyframe"] = "" if estimate.keyframe_id is None else estimate.keyframe_id
        values["new_keyframe"] = estimate.new_keyframe
        if estimate.outcome is not None:
            evidence = ((name, getattr(estimate.outcome.evidence, name)) for name in _EVIDENCE)
            values |= {name: f"{value:.6g}" for name, value in evidence if math.isfinite(value)}
    values |= {f"ms_{name.replace(' ', '_')}": f"{ms:.2f}" for name, ms in answer.timings_ms.items()}
    text = " ".join(part for part in (answer.state, answer.reason) if part)
    text += f": {answer.message}" if answer.message else ""
    return encode_diagnostic_status(
        _LEVELS.get(answer.state, WARN), node, text, values=values, hardware_id=answer.frame_id
    )


def waiting_status(node: str, findings: Sequence[Finding]) -> Message:
    """That nothing is published, and why."""
    text = "WAITING: " + "; ".join(map(str, findings))
    values = {"state": "WAITING", "reason": findings[0].code, "codes": " ".join(one.code for one in findings)}
    return encode_diagnostic_status(ERROR, node, text, values=values)


def input_status(name: str, monitor: InputMonitor, now_s: float, finding: Finding | None) -> Message:
    """How an input topic is doing, for /diagnostics; ``name`` is "node: topic"."""
    missing, expected = monitor.gaps.recent()
    age_s = monitor.age_s(now_s)
    values: dict[str, object] = {
        "received": monitor.received,
        "rate_hz": f"{monitor.rate.hz(now_s):.2f}",
        "age_s": "" if age_s is None else f"{age_s:.2f}",
        "stamps_missing": f"{missing} of {expected}",
        "refused": sum(monitor.refused.values()),
    }
    values |= {f"refused_{code}": count for code, count in sorted(monitor.refused.items())}
    level, text = (OK, "receiving") if finding is None else (ERROR, str(finding))
    if finding is None and monitor.last_refusal:
        level, text = WARN, monitor.last_refusal
    return encode_diagnostic_status(level, name, text, values=values)


def registration_status(node: str, tally: Tally, now_s: float, findings: Sequence[Finding]) -> Message:
    """Rates, drops and latencies, for /diagnostics."""
    values: dict[str, object] = {"frames_received": tally.received, "pose_rate_hz": f"{tally.rate.hz(now_s):.2f}"}
    values |= {f"frames_{state.lower()}": count for state, count in sorted(tally.states.items())}
    values |= {f"reason_{reason}": count for reason, count in sorted(tally.reasons.items())}
    for name, (median, p95) in tally.latencies.summary().items():
        values[f"ms_{name.replace(' ', '_')}"] = f"median {median:.1f}, p95 {p95:.1f}"
    if findings:
        level, text = ERROR, "; ".join(map(str, findings))
    elif tally.frames_lost:
        reason = "" if tally.last is None else f"{tally.last.reason}: {tally.last.message}"
        level, text = ERROR, f"LOST for {tally.frames_lost} frames: {reason}"
    else:
        level, text = OK, "WAITING" if tally.last is None else tally.last.state
    return encode_diagnostic_status(level, f"{node}: registration", text, values=values)
