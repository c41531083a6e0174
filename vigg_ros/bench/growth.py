# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How time and memory grow with the size of the input, up to the worst case."""

from __future__ import annotations

import multiprocessing
import resource
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.frame_cache import timed
from vigg_ros.registration import Camera, Config, Frame, extract, register
from vigg_ros.registration.cliques import propose
from vigg_ros.registration.matches import Matches, no_matches
from vigg_ros.registration.rigid import transform

POINT_COUNTS = (5_000, 20_000, 50_000, 100_000, 200_000, 500_000)
MATCH_COUNTS = (50, 150, 300, 500, 1_000, 2_000)
GROWTH_REPEATS = 3


@dataclass(frozen=True, slots=True)
class GrowthSample:
    """What one size took."""

    what: str
    size: int
    milliseconds: float
    """The least of GROWTH_REPEATS: the others had to share the machine."""
    peak_mb: float
    """Of the whole process, which did nothing else."""


def measure() -> Iterator[GrowthSample]:
    """Every input at every size, each in a process of its own."""
    for what, sizes in INPUT_SIZES.items():
        for size in sizes:
            yield measure_in_new_process(what, size)


def measure_in_new_process(what: str, size: int) -> GrowthSample:
    """One input at one size, in a new process, so that its peak of memory is its own."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        return pool.submit(measure_one, what, size).result()


def measure_one(what: str, size: int) -> GrowthSample:
    """One input at one size, in this process."""
    prepare = INPUT_KINDS[what]
    prepare(min(INPUT_SIZES[what]))()  # compiles or loads
    work = prepare(size)
    milliseconds = min(timed(work)[1] for _ in range(GROWTH_REPEATS))
    return GrowthSample(what, size, milliseconds, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


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


def rolling_ground(count: int, seed: int = 0) -> NDArray[np.float32]:
    """Points (N, 3) on rolling ground around a scanner at 1.8 m, as dense near it as a scan is."""
    rng = np.random.default_rng(seed)
    angle, distance_m = rng.uniform(-np.pi, np.pi, count), 3 * 20 ** rng.uniform(0, 1, count)
    x, y = distance_m * np.cos(angle), distance_m * np.sin(angle)
    z = 1.5 * np.sin(0.3 * x) * np.cos(0.2 * y) - 1.8 + rng.normal(0, 0.02, count)
    return np.column_stack((x, y, z)).astype(np.float32)


def registration_of(count: int) -> Callable[[], object]:
    """Extract a scan of so many points and register it against another one, with all that doubt calls for."""
    config = Config.preset("lidar")
    camera = Camera(width_px=640, height_px=240, fx_px=400.0, fy_px=400.0, cx_px=319.5, cy_px=119.5)
    T_camera_points = np.array(((0, -1, 0, 0), (0, 0, -1, 0), (1, 0, 0, 0), (0, 0, 0, 1)), np.float64)
    image = np.random.default_rng(0).integers(0, 256, (240, 640), np.uint8)
    frames = [Frame.from_points(image, rolling_ground(count, seed), camera, T_camera_points) for seed in (0, 1)]
    target = extract(frames[0], config)
    return lambda: register(target, extract(frames[1], config), config)


def cliques_of(count: int, right: float = 0.3) -> Callable[[], object]:
    """Hypotheses of so many visual matches, of which a share is right; the worst case is that all are compatible."""
    rng = np.random.default_rng(0)
    target = rng.uniform(-3, 3, (count, 3))
    T_source_target = np.eye(4)
    T_source_target[:3, 3] = 0.3, -0.2, 0.1
    source = transform(T_source_target, target) + rng.normal(0, 0.01, (count, 3))
    wrong = rng.random(count) >= right
    source[wrong] = rng.uniform(-3, 3, (np.count_nonzero(wrong), 3))
    rows = np.arange(count)
    matches = Matches(target, source, np.ones(count), rows, rows, np.zeros(count))
    return lambda: propose(matches, no_matches(), Config().cliques)


INPUT_KINDS: dict[str, Callable[[int], Callable[[], object]]] = {
    "points of a scan": registration_of,
    "visual matches, 30 % right": cliques_of,
    "visual matches, all compatible": partial(cliques_of, right=1.0),
}
INPUT_SIZES = dict(zip(INPUT_KINDS, (POINT_COUNTS, MATCH_COUNTS, MATCH_COUNTS), strict=True))
