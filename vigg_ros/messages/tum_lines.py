# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses as lines of a TUM trajectory.

Format: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.rigid import quaternions_from_rotations
from vigg_ros.sensors.header import NS_PER_S

_LINE = "%d.%09d" + " %.9f" * 7


def tum_line(stamp_ns: int, T_world_sensor: NDArray[np.float64]) -> str:
    """The line of one pose (4, 4); see ``tum_lines``."""
    return tum_lines(np.array([stamp_ns]), T_world_sensor[None])[0]


def tum_lines(stamps_ns: NDArray[np.int64], T_world_sensor: NDArray[np.float64]) -> list[str]:
    """Stamp (s), position (m), quaternion x y z w of stamps (N,) and poses (N, 4, 4) or their upper rows (N, 3, 4).

    The stamps are from integer nanoseconds, all nine digits of them.
    """
    seconds, nanoseconds = np.divmod(stamps_ns, NS_PER_S)
    numbers = np.hstack((T_world_sensor[:, :3, 3], quaternions_from_rotations(T_world_sensor[:, :3, :3])))
    rows = zip(seconds.tolist(), nanoseconds.tolist(), numbers.tolist(), strict=True)
    return [_LINE % (second, nanosecond, *row) for second, nanosecond, row in rows]
