# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plots of a replay as inline SVG, whose ink follows the page's colours. matplotlib takes a second to load: late."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, ParamSpec

import numpy as np
from numpy.typing import NDArray

from vigg_ros.report.series import (
    LOST,
    NO_FRAME,
    REFUSED,
    RELOCALISED,
    TRACKING,
    Axis,
    Route,
    choose_plan,
    evidence_series,
    runs,
    stage_times_ms,
    state_columns,
    totals_ms,
)
from vigg_ros.tracking.frame_result import FrameResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

P = ParamSpec("P")

INK, GRID = "#010203", "#040506"
"""Stand for the page's own colours, which differ between light and dark; see ``svg``."""

BLUE, ORANGE, RED, PURPLE, GREEN, GREY = "#3a86c8", "#e69f00", "#d1495b", "#9b6bb3", "#2a9d78", "#8d99a6"
BARS = {TRACKING: (BLUE, 0.7), RELOCALISED: (ORANGE, 0.7), REFUSED: (GREY, 1.0), LOST: (RED, 1.0)}
"""Colour and height of what a column shows; heights are for those who print in grey."""
STAGE_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, GREY, "#56b4e9", "#b8a038", "#cc79a7", "#5f6f52")
SHARE_COLOURS = {"overlap": BLUE, "consistency": GREEN}
INLIER_COLOURS = {"visual_inliers": PURPLE, "geometric_inliers": ORANGE}

MAX_MARKS = 400
"""Marks of a kind in one plot; more cannot be told apart."""

_WIDTH_IN = 9.4
_STYLE = {
    "font.size": 9, "font.family": "sans-serif", "svg.fonttype": "none", "axes.edgecolor": GRID,
    "axes.labelcolor": INK, "text.color": INK, "xtick.color": INK, "ytick.color": INK, "grid.color": GRID,
    "axes.grid": True, "grid.linewidth": 0.6, "axes.axisbelow": True, "axes.spines.top": False,
    "axes.spines.right": False, "lines.linewidth": 1.2, "legend.frameon": False, "axes.titlesize": 9,
    "axes.titlelocation": "left", "figure.constrained_layout.use": True, "figure.facecolor": "none",
    "axes.facecolor": "none",
}  # fmt: skip


def svg(draw: Callable[P, Figure]) -> Callable[P, str]:
    """Make a function that draws a figure return it as SVG that stands inside HTML.

    No prologue, no metadata, the page's ink, and ids that begin with the name of the function.
    """

    def drawn(*args: P.args, **kwargs: P.kwargs) -> str:
        import matplotlib

        buffer = io.StringIO()
        with matplotlib.rc_context({**_STYLE, "svg.hashsalt": "vigg"}):
            draw(*args, **kwargs).savefig(buffer, format="svg", metadata={"Date": None})
        text = buffer.getvalue()
        text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
        text = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{draw.__name__}-", text)
        return text.replace(INK, "currentColor").replace(GRID, "var(--line)")

    return drawn


@svg
def plot_states(frames: Sequence[FrameResult], axis: Axis, marks: Sequence[tuple[int, str]]) -> Figure:
    """A strip of states over time, new keyframes as ticks below it, and letters (frame, letter) above."""
    figure, ax = _blank(1.05)
    for state, start, width in runs(state_columns(frames, axis), axis):
        if state != NO_FRAME:
            colour, height = BARS[state]
            ax.broken_barh([(start, width)], (0, height), color=colour, linewidth=0)
    keyframes = _few(axis.values[[record.new_keyframe for record in frames]])
    ax.vlines(keyframes, -0.38, -0.1, color=INK, linewidth=0.8)
    for frame, letter in marks:
        ax.annotate(letter, (axis.values[frame], 1.1), ha="center", fontweight="bold")
    ax.set(xlim=axis.range, ylim=(-0.45, 1.55), yticks=[], xlabel=axis.label)
    ax.grid(visible=False)
    ax.spines["left"].set_visible(False)
    return figure


@svg
def plot_routes(routes: Sequence[Route], axis: Axis) -> Figure:
    """For each route a map, and beside it the height over time."""
    figure, grid = _blank(3.4 * len(routes), nrows=len(routes), ncols=2, squeeze=False, width_ratios=(1.2, 1))
    for (plan, profile), route in zip(grid, routes, strict=True):
        right, up, height = choose_plan(np.concatenate((route.estimate, route.truth)))
        _draw_plan(plan, route, right, up)
        profile.plot(route.at, route.truth[:, height], color=GREY, linewidth=2.4, alpha=0.7)
        profile.plot(route.at, route.estimate[:, height], color=BLUE)
        profile.set(xlabel=axis.label, ylabel=f"{'xyz'[height]} (m)")
        if len(routes) > 1:
            plan.set_title(f"session {route.session}")
    return figure


def _draw_plan(ax: Any, route: Route, right: int, up: int) -> None:
    """The way on a map, with what is known of the truth."""
    if not np.isnan(route.truth).all():
        ax.plot(route.truth[:, right], route.truth[:, up], color=GREY, linewidth=2.4, alpha=0.7, label="truth, aligned")
    ax.plot(route.estimate[:, right], route.estimate[:, up], color=BLUE, label="estimate")
    keyframes = route.estimate[route.keyframes]
    ax.plot(keyframes[:, right], keyframes[:, up], "o", color=BLUE, markersize=3, label="keyframes")
    if route.lost.any():
        lost = _few(route.truth[route.lost])
        ax.plot(lost[:, right], lost[:, up], "x", color=RED, markersize=5, label="no pose here")
    first = route.estimate[~np.isnan(route.estimate[:, 0])][0]
    ax.plot(first[right], first[up], "s", color=INK, markersize=5, fillstyle="none", label="start")
    ax.set(xlabel=f"{'xyz'[right]} (m)", ylabel=f"{'xyz'[up]} (m)")
    ax.set_aspect("equal", adjustable="datalim")
    ax.legend(loc="best", fontsize=8)


@svg
def plot_errors(errors: NDArray[np.float64], frames: Sequence[FrameResult], axis: Axis) -> Figure:
    """Translation (m) and rotation errors (deg) of frames (N, 2) over time; some of them are known."""
    figure, (upper, lower) = _blank(3.0, nrows=2, sharex=True)
    shown = (upper, 100 * errors[:, 0], "position (cm)"), (lower, errors[:, 1], "rotation (deg)")
    for ax, values, label in shown:
        _shade(ax, frames, axis)
        ax.plot(axis.values, values, color=BLUE, marker="." if len(values) < MAX_MARKS else "", markersize=3)
        ax.set(ylabel=label, xlim=axis.range, ylim=(0, 1.1 * max(np.nanmax(values), 1e-9)))
    lower.set_xlabel(axis.label)
    return figure


@svg
def plot_evidence(frames: Sequence[FrameResult], axis: Axis) -> Figure:
    """Overlap, consistency and inliers over time; crosses where the frame was lost all the same."""
    figure, axes = _blank(3.4, nrows=2, sharex=True)
    answered = np.array([record.has_pose for record in frames])
    for ax, colours in zip(axes, (SHARE_COLOURS, INLIER_COLOURS), strict=True):
        _shade(ax, frames, axis)
        for name, colour in colours.items():
            values = evidence_series(frames, name)
            ax.plot(axis.values, np.where(answered, values, np.nan), color=colour, label=name.replace("_", " "))
            # Stages that were not reached leave 0.
            lost = _few(np.column_stack((axis.values, values))[~answered & (values > 0)])
            ax.plot(lost[:, 0], lost[:, 1], "x", color=colour, markersize=4)
        ax.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2, fontsize=8, borderaxespad=0)
    axes[0].set(ylabel="share", ylim=(0, 1.05), xlim=axis.range)
    axes[1].set(ylabel="matches", xlabel=axis.label)
    axes[1].set_ylim(bottom=0)
    return figure


@svg
def plot_times(frames: Sequence[FrameResult]) -> Figure:
    """Median and 95th percentile of each stage and of all together."""
    stages = stage_times_ms(frames)
    figure, ax = _blank(0.7 + 0.27 * (len(stages) + 1))
    done_ms = 0.0
    for row, values_ms in enumerate(stages.values(), 1):
        colour = STAGE_COLOURS[(row - 1) % len(STAGE_COLOURS)]
        median_ms, p95_ms = np.percentile(values_ms, (50, 95))
        ax.barh(row, median_ms, color=colour, height=0.62)
        ax.barh(0, median_ms, left=done_ms, color=colour, height=0.62)
        _tick(ax, row, median_ms, p95_ms)
        done_ms += float(median_ms)
    _tick(ax, 0, *np.percentile(totals_ms(frames), (50, 95)))
    ax.set(yticks=range(len(stages) + 1), yticklabels=["all stages", *stages], xlabel="ms per frame")
    ax.invert_yaxis()
    ax.grid(visible=False, axis="y")
    ax.margins(x=0.22)
    ax.set_xlim(left=0)
    return figure


def _tick(ax: Any, row: int, median_ms: float, p95_ms: float) -> None:
    """From the median to the 95th percentile, with both in figures."""
    ax.plot((median_ms, p95_ms), (row, row), color=INK, linewidth=0.8)
    ax.plot((p95_ms, p95_ms), (row - 0.2, row + 0.2), color=INK, linewidth=1.2)
    place = {"xytext": (6, 0), "textcoords": "offset points", "va": "center", "fontsize": 8}
    ax.annotate(f"{median_ms:.0f} (p95 {p95_ms:.0f})", (max(median_ms, p95_ms), row), **place)


def _blank(height_in: float, **subplots: Any) -> tuple[Figure, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH_IN, height_in))
    return figure, figure.subplots(**subplots)


def _shade(ax: Any, frames: Sequence[FrameResult], axis: Axis) -> None:
    """Mark the times without an answer."""
    unanswered = (state_columns(frames, axis) >= REFUSED).astype(np.int64)
    for missing, start, width in runs(unanswered, axis):
        if missing:
            ax.axvspan(start, start + width, color=RED, alpha=0.15, linewidth=0)


def _few(values: NDArray[Any]) -> NDArray[Any]:
    """At most MAX_MARKS rows, evenly spread."""
    rows = np.linspace(0, len(values) - 1, min(len(values), MAX_MARKS)).astype(int)
    return np.asarray(values[rows])
