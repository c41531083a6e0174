# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Time and memory over the size of the input, as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from vigg_ros.bench.growth import GrowthSample


def draw_growth(rows: Sequence[GrowthSample], path: Path) -> None:
    """Two panels with logarithmic axes, one line for each kind of input. Raises OSError."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.6), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, 2)
    labels = {"milliseconds": "time (ms)", "peak_mb": "peak memory of the process (MB)"}
    for panel, (name, label) in zip(panels, labels.items(), strict=True):
        for what in dict.fromkeys(row.what for row in rows):
            of_kind = [row for row in rows if row.what == what]
            sizes, values = [row.size for row in of_kind], [getattr(row, name) for row in of_kind]
            panel.plot(sizes, values, "o-", label=what, markersize=4)
        panel.set(xscale="log", yscale="log", xlabel="number of points or matches", ylabel=label)
        panel.grid(visible=True, which="both", alpha=0.25)
    panels[0].legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=130)
