# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The one table at the end of a replay."""

from __future__ import annotations

from collections import Counter

import numpy as np

from vigg_ros.report.accuracy import TrajectoryMetrics
from vigg_ros.report.ground_truth import why_no_errors
from vigg_ros.report.recording import Recording


def summary_table(recording: Recording, metrics: TrajectoryMetrics | None, *, configuration: str) -> str:
    """What was replayed and how: coverage, errors with their alignment, and time per frame, as aligned text."""
    rows = [
        ("recording", recording.name),
        ("configuration", configuration),
        ("frames answered", f"{len(recording.answered)} of {len(recording.frames)} ({recording.coverage:.1%})"),
        *_unanswered(recording),
        ("keyframes", str(_keyframes(recording))),
        *_errors(recording, metrics),
        ("time per frame", _times(recording)),
    ]
    width = max(len(name) for name, _ in rows)
    return "\n".join(f"{name:<{width}}  {text}" for name, text in rows)


def _keyframes(recording: Recording) -> int:
    """Those that were taken at once, and those that a later frame needed."""
    used = {(record.session, record.keyframe_stamp_ns) for record in recording.frames if record.keyframe_stamp_ns}
    return len(used | {(record.session, record.stamp_ns) for record in recording.frames if record.new_keyframe})


def _unanswered(recording: Recording) -> list[tuple[str, str]]:
    reasons = Counter(f"{record.state.value} {record.reason}" for record in recording.frames if not record.has_pose)
    if not reasons:
        return []
    return [("without a pose", ", ".join(f"{reason}: {count}" for reason, count in reasons.most_common()))]


def _errors(recording: Recording, metrics: TrajectoryMetrics | None) -> list[tuple[str, str]]:
    if metrics is None or not metrics.pooled.compared:
        return [("errors", why_no_errors(recording))]
    accuracy = metrics.pooled
    ate, rpe = accuracy.absolute.as_dict(), accuracy.per_second.as_dict()
    shown = [
        (
            "ATE",
            f"rmse {100 * ate['translation_m']['rmse']:.2f} cm, median {100 * ate['translation_m']['median']:.2f} cm, "
            f"max {100 * ate['translation_m']['max']:.2f} cm, over {accuracy.compared} frames",
        ),
        ("aligned", accuracy.alignment),
        ("path", f"{accuracy.path_m:.2f} m, drift {accuracy.drift_percent:.2f} %"),
    ]
    if rpe["translation_m"]["count"]:
        shown.append(
            (
                "RPE over 1 s",
                f"median {100 * rpe['translation_m']['median']:.2f} cm and {rpe['rotation_deg']['median']:.2f} deg, "
                f"p95 {100 * rpe['translation_m']['p95']:.2f} cm and {rpe['rotation_deg']['p95']:.2f} deg",
            )
        )
    return shown


def _times(recording: Recording) -> str:
    totals = [sum(record.timings_ms.values()) for record in recording.frames if record.timings_ms]
    if not totals:
        return "-"
    return f"median {np.median(totals):.0f} ms, p95 {np.percentile(totals, 95):.0f} ms (extract and register)"
