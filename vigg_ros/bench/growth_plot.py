# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Time and memory over the size of the input, as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from vigg_ros.bench.growth import Growth


def draw_growth(rows: Sequence[Growth], path: Path) -> None:
    """Two panels with logarithmic axes, one line for each kind of input. Raises OSError."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.6), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, 2)
    for panel, label, value in (
        (panels[0], "time (ms)", lambda row: row.milliseconds),
        (panels[1], "peak memory of the process (MB)", lambda row: row.peak_mb),
    ):
        for what in dict.fromkeys(row.what for row in rows):
            of_kind = [row for row in rows if row.what == what]
            panel.plot([row.size for row in of_kind], [value(row) for row in of_kind], "o-", label=what, markersize=4)
        panel.set(xscale="log", yscale="log", xlabel="number of points or matches", ylabel=label)
        panel.grid(visible=True, which="both", alpha=0.25)
    panels[0].legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=130)
