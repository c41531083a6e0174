# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Points sorted into cubic cells, so that neighbours within one cell size are a few contiguous runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.kernels.compilation import compiled
from vigg_ros.registration.options import MAX_CELLS_PER_AXIS


@dataclass(frozen=True, slots=True)
class CellIndex:
    """N points sorted by the key of their cell; C occupied cells.

    ``runs`` (C, 9, 2): for each cell, nine [start, end) runs of sorted points which together hold
    every point of the 27 cells around it.
    """

    cell_size_m: float
    origin: NDArray[np.float64]
    """(3,) corner of cell (1, 1, 1)."""
    shape: NDArray[np.int64]
    """(3,) cells per axis, margins included."""
    order: NDArray[np.int64]
    """(N,) the point at each sorted place."""
    keys: NDArray[np.int64]
    """(C,) ascending keys of the occupied cells."""
    starts: NDArray[np.int64]
    """(C + 1,) where each cell's points start."""
    runs: NDArray[np.int64]

    @classmethod
    def build(cls, points: NDArray[np.floating], cell_size_m: float) -> CellIndex:
        """Sort points (N, 3), metres, N >= 1, all finite, into cells."""
        origin = points.min(axis=0).astype(np.float64)
        cells = np.floor((points - origin) / cell_size_m).astype(np.int64) + 1
        shape = cells.max(axis=0) + 2
        if shape.max() > MAX_CELLS_PER_AXIS:
            raise ValueError(f"points span {shape.max()} cells on one axis, expected {MAX_CELLS_PER_AXIS} at most")
        key = (cells[:, 0] * shape[1] + cells[:, 1]) * shape[2] + cells[:, 2]
        order = np.argsort(key, kind="stable")
        keys, first = np.unique(key[order], return_index=True)
        starts = np.append(first, len(points)).astype(np.int64)
        runs = runs_of_keys_plain(keys, keys, starts, _steps(shape))
        return cls(cell_size_m, origin, shape, order, keys, starts, runs)

    def lookup(self) -> tuple[Any, ...]:
        """What a kernel needs to find runs by itself: origin, cell size, shape, keys, starts, runs, steps."""
        return self.origin, self.cell_size_m, self.shape, self.keys, self.starts, self.runs, _steps(self.shape)

    def runs_at(self, points: NDArray[np.floating]) -> NDArray[np.int64]:
        """Runs (M, 9, 2) around arbitrary points (M, 3); empty runs where no indexed point can be near."""
        cells = np.floor((points - self.origin) / self.cell_size_m) + 1
        inside = np.all((cells >= 0) & (cells < self.shape), axis=1)
        # Cell (0, 0, 0) is in the margin; from outside even its neighbours must not be reached.
        cells = np.where(inside[:, None], cells, 0).astype(np.int64)
        key = np.where(inside, (cells[:, 0] * self.shape[1] + cells[:, 1]) * self.shape[2] + cells[:, 2], -1)
        return np.asarray(runs_of_keys(key, self.keys, self.starts, self.runs, _steps(self.shape)))


def _steps(shape: NDArray[np.int64]) -> NDArray[np.int64]:
    """What the keys of the nine columns of cells around a cell differ by."""
    return np.array([(dx * shape[1] + dy) * shape[2] for dx in (-1, 0, 1) for dy in (-1, 0, 1)], np.int64)


@compiled
def runs_of_keys(around, keys, starts, known, steps):  # pragma: no cover - compiled
    """Runs (M, 9, 2) around cells by key (M,); ``known`` (C, 9, 2) are those of the occupied cells.

    Keys below 0 get empty runs.
    """
    runs = np.zeros((len(around), 9, 2), np.int64)
    for i in range(len(around)):
        if around[i] < 0:
            continue
        place = np.searchsorted(keys, around[i])
        if place < len(keys) and keys[place] == around[i]:
            runs[i] = known[place]
            continue
        for k in range(9):
            centre = around[i] + steps[k]
            runs[i, k, 0] = starts[np.searchsorted(keys, centre - 1)]
            runs[i, k, 1] = starts[np.searchsorted(keys, centre + 1, side="right")]
    return runs


def runs_of_keys_plain(
    around: NDArray[np.int64], keys: NDArray[np.int64], starts: NDArray[np.int64], steps: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Twin of ``runs_of_keys``. Neighbouring cells along z have consecutive keys, so three are one run."""
    centre = around[:, None] + steps
    begin = starts[np.searchsorted(keys, centre - 1, side="left")]
    end = starts[np.searchsorted(keys, centre + 1, side="right")]
    runs = np.stack((begin, end), axis=2)
    runs[around < 0] = 0
    return runs
