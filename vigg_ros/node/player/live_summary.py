# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The one table at the end of ``vigg live``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vigg_ros.node.player.live_display import cpu_percent
from vigg_ros.node.player.node_process import Usage
from vigg_ros.node.player.scoreboard import Score


@dataclass(frozen=True, slots=True)
class Run:
    """What happened."""

    recording: str
    leader: str
    """What each frame is made from: "colour image" or "scan"."""
    score: Score
    played_s: float
    """Real time from the first to the last message."""
    has_truth: bool
    at_start: Usage | None
    at_end: Usage | None
    exit_code: int
    """Of the node."""


def summary_table(run: Run) -> str:
    """Coverage, latency, errors with their alignment, and what the node used, as aligned text."""
    score = run.score
    share = score.answered / score.sent if score.sent else 0.0
    rows = [
        ("recording", run.recording),
        ("frames sent", f"{score.sent} in {run.played_s:.1f} s ({_rate(score.sent, run.played_s)})"),
        ("poses received", f"{score.answered} ({share:.1%})"),
        *_unanswered(score),
        ("latency", _latency(run)),
        *_errors(run),
        ("node", _usage(run)),
    ]
    width = max(len(name) for name, _ in rows)
    return "\n".join(f"{name:<{width}}  {text}" for name, text in rows)


def advice_on_drops(run: Run, rate: float) -> str:
    """One sentence with a rate of playing that this computer can follow; empty if nothing was dropped."""
    score = run.score
    registered = score.sent - score.dropped - score.silent
    if not score.dropped or run.played_s <= 0:
        return ""
    said = f"{score.dropped} of {score.sent} frames were dropped because newer ones came"
    if registered < 1:
        return said
    slower = _round_down(rate * registered / score.sent)
    return f"registered about {registered / run.played_s:.2g} frames a second here; {said}; try --rate {slower:g}"


def _round_down(value: float) -> float:
    """To one digit: 0.37 to 0.3."""
    unit = 10.0 ** np.floor(np.log10(value))
    return float(f"{np.floor(value / unit + 1e-9) * unit:.0e}")


def _rate(count: int, seconds: float) -> str:
    return f"{(count - 1) / seconds:.1f} Hz" if count > 1 and seconds > 0 else "-"


def _unanswered(score: Score) -> list[tuple[str, str]]:
    rows = []
    reasons = score.unanswered.most_common()
    if reasons:
        rows.append(("without a pose", ", ".join(f"{reason}: {count}" for reason, count in reasons)))
    if score.silent:
        rows.append(("without an answer", f"{score.silent} (lost on the way, without partner, or still waiting)"))
    return rows


def _latency(run: Run) -> str:
    latencies_ms = run.score.latencies_ms
    if not latencies_ms.size:
        return "-"
    median, p95, largest = np.percentile(latencies_ms, (50, 95, 100))
    span = f"from publishing the {run.leader} to receiving its pose"
    return f"median {median:.0f} ms, p95 {p95:.0f} ms, max {largest:.0f} ms, {span}"


def _errors(run: Run) -> list[tuple[str, str]]:
    errors_m = run.score.errors_m
    if not errors_m.size:
        lack = "no answered frame has a true pose" if run.has_truth else "no ground truth to compare with"
        return [("position error", lack)]
    median, largest = np.percentile(100 * errors_m, (50, 100))
    return [
        ("position error", f"median {median:.2f} cm, max {largest:.2f} cm, over {len(errors_m)} frames"),
        ("aligned", "at the first pose of each odometry frame: errors are those of the motion since then"),
    ]


def _usage(run: Run) -> str:
    parts = []
    if run.at_start is not None and run.at_end is not None:
        parts.append(f"CPU mean {cpu_percent(run.at_start, run.at_end):.0f} % of one core while the bag played")
        parts.append(f"memory at most {run.at_end.peak_rss_mb:.0f} MB")
    return ", ".join([*parts, f"exit code {run.exit_code}"])
