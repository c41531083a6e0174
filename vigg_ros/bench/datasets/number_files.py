# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers, matrices and numbered frames in the files of data sets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.trajectories import number_in, rows
from vigg_ros.registration.rigid import is_rigid
from vigg_ros.sensors.header import NS_PER_S

START_NS = NS_PER_S
"""Where data sets that count from 0 begin here: ROS takes a stamp of 0 for one that was not set."""


def stamp_of_number(number: int, rate_hz: float) -> int:
    """Stamp in ns of a frame by its number, so that missing frames leave their gap."""
    return START_NS + round(number * NS_PER_S / rate_hz)


def read_numbers(path: Path) -> NDArray[np.float64]:
    """All numbers (N,) of a text file in their order. Raises BagError when a word is none."""
    return np.array([number_in(path, line, word) for line, words in rows(path) for word in words])


def read_matrix_pose(path: Path) -> NDArray[np.float64] | None:
    """The pose (4, 4) in a file of 16 numbers; None if it is marked as unknown (NaN, Inf) or no pose."""
    numbers = read_numbers(path)
    return nearest_rigid(numbers.reshape(4, 4)) if numbers.size == 16 else None


def nearest_rigid(T: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """The rigid transform (4, 4) that a rounded one stands for; None if it is none."""
    if not is_rigid(T):
        return None
    U, _, Vt = np.linalg.svd(T[:3, :3])
    nearest = np.eye(4)
    nearest[:3, :3] = U @ Vt
    nearest[:3, 3] = T[:3, 3]
    return nearest
