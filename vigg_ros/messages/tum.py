# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses as lines of a TUM trajectory.

Format: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vigg_ros.messages.header import NS_PER_S
from vigg_ros.messages.rotation import quaternion_from_rotation


def tum_line(stamp_ns: int, T_world_sensor: NDArray[np.float64]) -> str:
    """Stamp (s), position (m), quaternion x y z w; the stamp from integer nanoseconds, all nine digits of them."""
    seconds, nanoseconds = divmod(stamp_ns, NS_PER_S)
    numbers = (*T_world_sensor[:3, 3], *quaternion_from_rotation(T_world_sensor[:3, :3]))
    return f"{seconds}.{nanoseconds:09d} " + " ".join(f"{number:.9f}" for number in numbers)
