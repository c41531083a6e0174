# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Findings, inputs and rates as diagnostic_msgs/DiagnosticStatus."""

from __future__ import annotations

from collections.abc import Sequence

from vigg_ros.messages.diagnostic_messages import ERROR, OK, WARN, encode_diagnostic_status
from vigg_ros.messages.fields import Message
from vigg_ros.node.input_monitor import InputMonitor
from vigg_ros.node.rates import FrameStatistics
from vigg_ros.node.watchdog import Finding
from vigg_ros.tracking.columns import timing_name


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


def registration_status(node: str, statistics: FrameStatistics, now_s: float, findings: Sequence[Finding]) -> Message:
    """Rates, drops and latencies, for /diagnostics."""
    rate_hz = f"{statistics.rate.hz(now_s):.2f}"
    values: dict[str, object] = {"frames_received": statistics.received, "pose_rate_hz": rate_hz}
    values |= {f"frames_{state.lower()}": count for state, count in sorted(statistics.states.items())}
    values |= {f"reason_{reason}": count for reason, count in sorted(statistics.reasons.items())}
    for name, (median, p95) in statistics.latencies.summary().items():
        values[timing_name(name)] = f"median {median:.1f}, p95 {p95:.1f}"
    if findings:
        level, text = ERROR, "; ".join(map(str, findings))
    elif statistics.frames_lost:
        reason = "" if statistics.last is None else f"{statistics.last.reason}: {statistics.last.message}"
        level, text = ERROR, f"LOST for {statistics.frames_lost} frames: {reason}"
    else:
        level, text = OK, "WAITING" if statistics.last is None else statistics.last.state.value
    return encode_diagnostic_status(level, f"{node}: registration", text, values=values)
