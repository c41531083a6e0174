# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""report.html: what became of a recording, on one page that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vigg_ros.report import plots, wording
from vigg_ros.report.accuracy import TrajectoryMetrics
from vigg_ros.report.gallery import Gallery, locate, pictured_section
from vigg_ros.report.html import Markup, element, page, plot, section, tile
from vigg_ros.report.recording import Recording
from vigg_ros.report.series import Axis, evidence_series, find_routes, frame_errors, time_axis, totals_ms
from vigg_ros.report.trajectory_errors import ROTATION_ALIGNMENT
from vigg_ros.tracking.frame_result import FrameResult

MAX_MAPS = 4
"""Sessions of which a map is drawn."""


def write_report(
    recording: Recording, metrics: TrajectoryMetrics | None, gallery: Gallery, run_info: Mapping[str, Any], path: Path
) -> None:
    """Write the report; metrics are None without truth.

    ``run_info`` is what run.json holds: its ``processor``, ``cores`` and ``system`` name the machine, the
    rest is listed as it is.
    """
    frames, axis = recording.frames, time_axis(recording.frames)
    parts = [_header(recording, metrics, run_info)]
    if frames:
        parts += [_states(frames, gallery, axis), wording.unanswered_section(recording, axis)]
        parts += [_routes(recording, metrics, axis), _errors(recording, metrics, axis), _evidence(frames, axis)]
        parts += [_times(frames, run_info), pictured_section(gallery, frames, axis)]
    parts += [wording.notes_section(recording)]
    parts += [section("Run", wording.changes_table(gallery.config), wording.run_table(run_info))]
    path.write_text(page(f"Replay of {recording.name}", *parts), encoding="utf-8")


def _header(recording: Recording, metrics: TrajectoryMetrics | None, run_info: Mapping[str, Any]) -> Markup:
    tiles = (tile(*figure) for figure in wording.key_figures(recording, metrics, run_info))
    title = element("h1", f"Replay of {recording.name}")
    return element("header", title, wording.lead(recording, metrics), element("div", *tiles, class_="tiles"))


def _states(frames: Sequence[FrameResult], gallery: Gallery, axis: Axis) -> Markup:
    marks = [(place, letter) for place, letter, _ in locate(gallery, frames)]
    keys = ("tracking", "relocalised", "lost", "refused")
    legend = [Markup(element("span", class_=f"key {key}") + key) for key in keys]
    caption = element("span", *legend, ". Ticks below: new keyframes. Letters: frames that are pictured at the end.")
    return section("What became of the frames", plot(plots.plot_states(frames, axis, marks), caption))


def _routes(recording: Recording, metrics: TrajectoryMetrics | None, axis: Axis) -> Markup:
    routes = find_routes(recording, metrics)
    if not routes:
        return Markup()
    shown = routes[:MAX_MAPS]
    said = (
        "Left a map, seen along the axis of the least extent; right that axis over time. Coordinates are those of the "
        "odometry frame, the sensor's own at the first frame: for a camera x is right, y down, z ahead. "
    )
    if len(shown) < len(routes):
        said += f"The {len(shown)} longest of {len(routes)} sessions. "
    if any(not np.isnan(route.truth).all() for route in shown):
        assert metrics is not None, "there is no truth without metrics"
        said += f"The truth is laid onto the estimate by {metrics.pooled.alignment}."
    return section("Where the sensor went", plot(plots.plot_routes(shown, axis), said))


def _errors(recording: Recording, metrics: TrajectoryMetrics | None, axis: Axis) -> Markup:
    if metrics is None or not metrics.pooled.compared:
        return Markup()
    svg = plots.plot_errors(frame_errors(recording, metrics), recording.frames, axis)
    said = (
        f"Error of each of the {metrics.pooled.compared} compared frames: positions after {metrics.pooled.alignment}; "
        f"rotations with {ROTATION_ALIGNMENT}. Red: no pose."
    )
    return section("Errors", plot(svg, said))


def _evidence(frames: Sequence[FrameResult], axis: Axis) -> Markup:
    if np.isnan(evidence_series(frames, "overlap")).all():
        return Markup()
    said = (
        "Overlap: share of both surfaces that coincides with the keyframe's. Consistency: coinciding share of what "
        "both should see. Inliers: matches that agree with the answer. Overlap falls as the sensor moves away from "
        "its keyframe and jumps up at a new one. Red: no pose; crosses: evidence for the best motion, not enough."
    )
    return section("Evidence", plot(plots.plot_evidence(frames, axis), said))


def _times(frames: Sequence[FrameResult], run_info: Mapping[str, Any]) -> Markup:
    timed = len(totals_ms(frames))
    if not timed:
        return Markup()
    said = (
        f"Median (bar) and 95th percentile (tick) of {timed} frames on: "
        f"{wording.machine(run_info)}. Without decoding and pairing. Medians of stages do not add up to "
        "the median of their sum; stages that run side by side count in full."
    )
    return section("Time", plot(plots.plot_times(frames), said))
