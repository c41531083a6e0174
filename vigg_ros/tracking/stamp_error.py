# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a motion is uncertain by because image and depth are not of one moment.

A frame has one stamp, its answer is of a moment somewhere between those of its image and its depth: an even
distribution, along the velocity. At 100 deg/s, 10 ms are a degree.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.frame import Frame


def displacement(frame: Frame, velocity_sensor: NDArray[np.float64] | None) -> NDArray[np.float64]:
    """(6,) translation (m) and rotation (rad) in the frame's axes: one standard deviation along its velocity (6,)."""
    if velocity_sensor is None:
        return np.zeros(6)
    return np.asarray(velocity_sensor * frame.apart_s / math.sqrt(3.0))


def stamp_covariance(
    T_target_source: NDArray[np.float64], of_target: NDArray[np.float64], of_source: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(6, 6) of the motion, as ``Registration.covariance`` means it, from the ``displacement`` of either frame."""
    R, t = T_target_source[:3, :3], T_target_source[:3, 3]
    by_source = np.concatenate((R @ of_source[:3], R @ of_source[3:]))
    # The source's origin is seen from a target that has moved: -(v + w x t), turned by -w.
    by_target = -np.concatenate((of_target[:3] + np.cross(of_target[3:], t), of_target[3:]))
    return np.outer(by_source, by_source) + np.outer(by_target, by_target)
