# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""De-skewing: a scan that was taken over a tenth of a second, as if it had been taken at its stamp."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vigg_ros.registration.frame import Frame
from vigg_ros.registration.rigid import inverse
from vigg_ros.tracking.chain import MAX_INTERVAL_S


def velocity(
    T_odom_before: NDArray[np.float64], T_odom_last: NDArray[np.float64], interval_ns: int
) -> NDArray[np.float64] | None:
    """Mean velocity (6,) between two poses in the sensor's frame: linear (m/s), angular (rad/s).

    None over more than MAX_INTERVAL_S.
    """
    interval_s = interval_ns * 1e-9
    if not 0 < interval_s <= MAX_INTERVAL_S:
        return None
    T_before_last = inverse(T_odom_before) @ T_odom_last
    turned = Rotation.from_matrix(T_before_last[:3, :3]).as_rotvec()
    return np.concatenate((T_before_last[:3, 3], turned)) / interval_s


def deskew(frame: Frame, velocity_sensor: NDArray[np.float64] | None) -> Frame:
    """The frame with each point moved to where it was seen from at the stamp, at a constant velocity.

    A frame without times per point, or of unknown velocity, is returned as it is. A point measured at time t
    is carried by T_stamp_t = (exp(angular t), linear t): the poses of ``velocity``, read backwards.
    """
    scan = frame.scan_with_times()
    if scan is None or velocity_sensor is None:
        return frame
    points, times_s = scan
    turned = Rotation.from_rotvec(times_s[:, None] * velocity_sensor[3:])
    moved = turned.apply(points) + times_s[:, None] * velocity_sensor[:3]
    return frame.with_points(moved.astype(np.float32))


def mean_skew_m(frame: Frame, velocity_sensor: NDArray[np.float64]) -> float:
    """How far its points lie from where they belong, in the mean, if this velocity is not accounted for.

    At most: turning and driving are added up. 0 for a frame without times.
    """
    scan = frame.scan_with_times()
    if scan is None:
        return 0.0
    points, times_s = scan
    linear, angular = np.linalg.norm(velocity_sensor[:3]), np.linalg.norm(velocity_sensor[3:])
    return float(np.mean(np.abs(times_s) * (linear + angular * np.linalg.norm(points, axis=1))))
