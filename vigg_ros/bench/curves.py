# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cumulative errors of methods as pictures. Imports matplotlib: import it late."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vigg_ros.bench.pair_results import Limits, PairResult

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8d99a6", "#5f6f52", "#000000")
"""Those of Okabe and Ito, which colour-blind people can tell apart, and a few more."""

LINE_STYLES = ("-", "--", ":")
"""For methods beyond the colours."""

_SETTINGS = {
    "font.size": 9, "axes.grid": True, "grid.linewidth": 0.5, "grid.color": "#d0d0d0", "axes.spines.top": False,
    "axes.spines.right": False, "legend.frameon": False,
}  # fmt: skip


def draw_curves(results: Sequence[PairResult], limits: Limits, path: Path) -> None:
    """A row for each group: the share of pairs with less than each rotation and each translation error.

    The curves of methods that refuse end below one: at their coverage, or at the limit of recall.
    """
    groups = list(dict.fromkeys(result.group for result in results))
    methods = list(dict.fromkeys(result.method for result in results))
    with matplotlib.rc_context(_SETTINGS):
        figure = Figure(figsize=(9.0, 2.3 * len(groups) + 0.9), layout="constrained")
        axes = figure.subplots(len(groups), 2, squeeze=False, sharey=True)
        for row, group in zip(axes, groups, strict=True):
            of_group = [result for result in results if result.group == group]
            _draw_row(row, of_group, methods, limits)
            count = sum(result.method == methods[0] for result in of_group)
            row[0].set_ylabel(f"{group}: share of {count} pairs")
        axes[-1][0].set_xlabel("rotation error below (deg)")
        axes[-1][1].set_xlabel("translation error below (m)")
        figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside right upper")
        figure.savefig(path, dpi=110, metadata={"Software": None})


def cumulative(errors: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """The share (M,) of errors (N,) below each of the values (M,); errors of inf are below none."""
    return np.searchsorted(np.sort(errors), at, side="left") / max(len(errors), 1)


def _draw_row(row: Sequence[Axes], results: Sequence[PairResult], methods: Sequence[str], limits: Limits) -> None:
    names = ("rotation_error_deg", "translation_error_m")
    scales = ((limits.recall_deg, limits.accuracy_deg), (limits.recall_m, limits.accuracy_m))
    for axis, name, (limit, marks) in zip(row, names, scales, strict=True):
        # The square gives small errors, where methods differ, more room.
        at = limit * np.linspace(0, 1, 400) ** 2
        for i, method in enumerate(methods):
            errors = np.array([getattr(result, name) for result in results if result.method == method])
            line = LINE_STYLES[i // len(COLOURS) % len(LINE_STYLES)]
            style = {"color": COLOURS[i % len(COLOURS)], "linewidth": 1.4 if i else 2.2, "zorder": 100 - i}
            axis.plot(at, cumulative(errors, at), line, label=method, **style)
        axis.set_xscale("function", functions=(np.sqrt, np.square))
        axis.set_xticks((0.0, *marks, limit), [f"{mark:g}" for mark in (0.0, *marks, limit)])
        axis.set_xlim(0, limit)
        axis.set_ylim(0, 1.02)
