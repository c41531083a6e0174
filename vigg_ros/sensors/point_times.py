# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When each point of a scan was measured.

Drivers agree on nothing: Velodyne has ``time``, float32 seconds from the stamp; Ouster ``t``, uint32
nanoseconds from the stamp; Hesai and RoboSense ``timestamp``, float64 seconds of the clock; Livox the same
in nanoseconds; others count microseconds. The numbers tell the unit: a scan takes between a millisecond
and a second, a factor of 1,000 as between the units, and was taken near its stamp.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.sensors.observation import Note

TIME_FIELDS = ("t", "time", "timestamp", "timestamps", "time_stamp", "stamps", "offset_time", "time_offset")

_UNITS_S = (1.0, 1e-6, 1e-9)
_SPAN_S = (1e-3, 1.0)
_MAX_OFFSET_S = 2.0


def point_times(column: NDArray[Any], stamp_ns: int) -> tuple[NDArray[np.float64] | None, tuple[Note, ...]]:
    """Times (N,) in seconds from the stamp, of the numbers (N,) in the field; None with a note if unclear.

    All points at one time is no information, and gives None without a note.
    """
    low, high = column.min(), column.max()
    if low == high:
        return None, ()
    reading = _reading(low, high, stamp_ns)
    if reading is None:
        note = Note(
            "POINT_TIMES", f"times of points from {low} to {high}",
            "ignored, so motion during the scan is not corrected",
            "publish seconds, micro- or nanoseconds, from the stamp or of its clock",
        )
        return None, (note,)
    seconds, zero = reading
    return (column.astype(np.float64) - zero) * seconds, ()


def _reading(low: Any, high: Any, stamp_ns: int) -> tuple[float, float] | None:
    """Unit in seconds, and the number that stands for the stamp; None if no reading is plausible."""
    readings = [
        (seconds, zero)
        for seconds in _UNITS_S
        for zero in (0.0, stamp_ns * 1e-9 / seconds)
        if _is_plausible(float(low) - zero, float(high) - zero, seconds)
    ]
    # In the first seconds of a simulation's clock both an offset and a time of the clock are small; the
    # right one begins nearer to the stamp.
    return min(readings, key=lambda reading: abs(float(low) - reading[1]) * reading[0], default=None)


def _is_plausible(low: float, high: float, seconds: float) -> bool:
    span_s = (high - low) * seconds
    return _SPAN_S[0] <= span_s < _SPAN_S[1] and max(abs(low), abs(high)) * seconds <= _MAX_OFFSET_S
