# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A replay in words and tables, for readers who were not there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from vigg_ros.acceptance.checks import EXPLANATIONS
from vigg_ros.registration.config import PRESETS, Config
from vigg_ros.report.accuracy import TrajectoryMetrics
from vigg_ros.report.html import Markup, element, section, table
from vigg_ros.report.recording import Recording, truth_frame_note, why_no_errors
from vigg_ros.report.series import Axis, totals_ms
from vigg_ros.report.trajectory_errors import ROTATION_ALIGNMENT, PoseErrors, Spread
from vigg_ros.tracking.frame_result import State

MEANINGS = {reason.value: explanation.meaning for reason, explanation in EXPLANATIONS.items()}
REMEDIES = {reason.value: explanation.remedy for reason, explanation in EXPLANATIONS.items()}
"""By reason of registration. Refused inputs say themselves what was found, what was expected, and what to do."""


def lead(recording: Recording, metrics: TrajectoryMetrics | None) -> Markup:
    """The result in two sentences; accuracy with its coverage and alignment."""
    received, answered = len(recording.frames), len(recording.answered)
    said = f"{answered} of {received} {recording.leaders} got a pose ({recording.coverage:.1%})."
    if not answered:
        said += " There is no trajectory."
    elif metrics is None or not metrics.pooled.compared:
        said += f" Nothing is known of their errors: {why_no_errors(recording)}."
    else:
        ate = Spread.of(metrics.pooled.absolute.translation_m)
        said += f" Compared with the truth over {ate.count} of them, positions are off by {length(ate.rmse)} rmse "
        said += f"after {metrics.pooled.alignment}."
    return element("p", said, class_="lead")


def summary_table(recording: Recording, metrics: TrajectoryMetrics | None, run_info: Mapping[str, Any]) -> str:
    """What was replayed and how, and its key figures, as aligned text."""
    reasons = Counter(f"{record.state.value} {record.reason}" for record in recording.frames if not record.has_pose)
    unanswered = ", ".join(f"{reason}: {count}" for reason, count in reasons.most_common())
    rows = {"recording": recording.name, "configuration": str(run_info.get("configuration", ""))}
    rows |= {title: f"{figure}: {said}" for title, figure, said in key_figures(recording, metrics, run_info)}
    rows |= {"without a pose": unanswered} if unanswered else {}
    rows |= {"aligned": metrics.pooled.alignment} if metrics is not None and metrics.pooled.compared else {}
    return table_text({**rows, "keyframes": str(_keyframes(recording))})


def table_text(rows: Mapping[str, str]) -> str:
    """Names and what is said of them, as aligned text."""
    width = max(map(len, rows))
    return "\n".join(f"{name:<{width}}  {text}" for name, text in rows.items())


def key_figures(
    recording: Recording, metrics: TrajectoryMetrics | None, run_info: Mapping[str, Any]
) -> list[tuple[str, str, str]]:
    """Coverage, accuracy as far as it is known, and time per frame: each a title, the figure, and what it means."""
    lost, refused = (sum(one.state is state for one in recording.frames) for state in (State.LOST, State.REFUSED))
    answered = f"{len(recording.answered)} of {len(recording.frames)} {recording.leaders} received"
    return [
        ("frames answered", f"{recording.coverage:.1%}", f"{answered}; {lost} lost, {refused} refused"),
        *_accuracy(recording, metrics),
        ("time per frame", *_time(recording, run_info)),
    ]


def _accuracy(recording: Recording, metrics: TrajectoryMetrics | None) -> list[tuple[str, str, str]]:
    """Absolute and relative errors and drift."""
    if metrics is None or not metrics.pooled.compared:
        return [("accuracy", "unknown", why_no_errors(recording))]
    accuracy = metrics.pooled
    ate, turned = Spread.of(accuracy.absolute.translation_m), Spread.of(accuracy.absolute.rotation_deg)
    positions = f"median {length(ate.median)}, p95 {length(ate.p95)}, max {length(ate.maximum)}"
    rotations = f"rotations {angle(turned.median)} median, {ROTATION_ALIGNMENT}"
    figures = [("ATE", f"{length(ate.rmse)} rmse", f"over {ate.count} frames, aligned; {positions}; {rotations}")]
    for title, errors in (("RPE over 1 s", accuracy.per_second), ("RPE per frame", accuracy.consecutive)):
        if len(errors.stamps_ns):
            figures.append((title, *_relative(errors)))
    if np.isfinite(accuracy.drift_percent):
        said = f"{length(accuracy.end_error_m)} off at the end of {length(accuracy.path_m)}"
        figures.append(("drift", f"{accuracy.drift_percent:.2f} % of the path", said))
    return figures


def _relative(errors: PoseErrors) -> tuple[str, str]:
    moved, turned = Spread.of(errors.translation_m), Spread.of(errors.rotation_deg)
    pairs = f"{moved.count} {'pair' if moved.count == 1 else 'pairs'}"
    said = f"median; p95 {length(moved.p95)} and {angle(turned.p95)}; {pairs}"
    return f"{length(moved.median)} and {angle(turned.median)}", said


def _time(recording: Recording, run_info: Mapping[str, Any]) -> tuple[str, str]:
    """The time that a frame takes, and the machine that it was taken on."""
    totals = totals_ms(recording.frames)
    if len(totals) == 0:
        return "unknown", "no frame was processed"
    median_ms, p95_ms = np.percentile(totals, (50, 95))
    return f"{median_ms:.0f} ms", f"median; p95 {p95_ms:.0f} ms; {machine(run_info)}"


def _keyframes(recording: Recording) -> int:
    """Those that were taken at once, and those that a later frame needed."""
    used = {(record.session, record.keyframe_stamp_ns) for record in recording.frames if record.keyframe_stamp_ns}
    return len(used | {(record.session, record.stamp_ns) for record in recording.frames if record.new_keyframe})


def machine(run_info: Mapping[str, Any]) -> str:
    """The machine's name; times mean nothing without it."""
    cores = f"{run_info['cores']} cores" if run_info.get("cores") else ""
    parts = [run_info.get("processor"), cores, run_info.get("system")]
    return ", ".join(str(part) for part in parts if part) or "a machine that was not named"


def unanswered_section(recording: Recording, axis: Axis) -> Markup:
    """Why frames got no pose: how often, where first, what that means, and what was said; empty if all did."""
    groups: dict[tuple[str, str], list[int]] = {}
    for place, record in enumerate(recording.frames):
        if not record.has_pose:
            groups.setdefault((record.state.value, record.reason), []).append(place)
    rows = []
    for (state, reason), places in sorted(groups.items(), key=lambda group: -len(group[1])):
        share = len(places) / len(recording.frames)
        count = f"{len(places)} ({share:.1%})"
        meaning = f"{MEANINGS[reason]} Remedy: {REMEDIES[reason]}." if reason in MEANINGS else (
            f"One of the {recording.leaders} could not be made into a frame."
        )
        said = recording.frames[places[0]].message
        rows.append((element("b", reason or state), state.lower(), count, axis.place(places[0]), meaning, said))
    heading = ("reason", "", "frames", "first at", "what it means", "what was said of the first")
    return section("Frames without a pose", table(heading, rows, narrow=True)) if rows else Markup()


def notes_section(recording: Recording) -> Markup:
    """What a user should know, and refused messages of all topics by code; empty if there is nothing."""
    notes = [note for note in (*recording.notes, truth_frame_note(recording)) if note]
    parts = [element("ul", *(element("li", note) for note in notes))] if notes else []
    if recording.refused:
        parts.append(table(("refused messages of all topics", "how many"), recording.refused.most_common()))
    return section("Notes", *parts) if parts else Markup()


def run_table(run_info: Mapping[str, Any]) -> Markup:
    """Everything that run.json says."""
    return table(("run", ""), [(name.replace("_", " "), value) for name, value in run_info.items()])


def changes_table(config: Config) -> Markup:
    """What differs from the preset that is nearest to the configuration."""
    name, changes = nearest_preset(config)
    if not changes:
        return element("p", "The configuration is the preset ", element("code", name), ", unchanged.")
    rows = [(element("code", option), *values) for option, values in changes.items()]
    return table(("option", "value", f"in preset {name}"), rows)


def nearest_preset(config: Config) -> tuple[str, dict[str, tuple[Any, Any]]]:
    """The preset with the fewest differences, and they: option -> (value, the preset's value)."""
    candidates = {}
    for name in PRESETS:
        pairs = zip(config.options(), Config.preset(name).options(), strict=True)
        candidates[name] = {o: (value, preset) for (o, _, value), (_, _, preset) in pairs if value != preset}
    nearest = min(candidates, key=lambda name: len(candidates[name]))
    return nearest, candidates[nearest]


def length(metres: float) -> str:
    """The length of an error or a path, to three digits, in the unit that suits it."""
    for unit, scale in (("m", 1.0), ("cm", 100.0)):
        if metres * scale >= 1:
            return f"{metres * scale:.3g} {unit}"
    return f"{1000 * metres:.2g} mm" if metres >= 1e-5 else "under 0.01 mm"


def angle(deg: float) -> str:
    """An angle of an error, to two digits."""
    return f"{deg:.2g} deg" if deg >= 1e-3 else "under 0.001 deg"
