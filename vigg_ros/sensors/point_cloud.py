# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""sensor_msgs/PointCloud2 in any layout to points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.header import read_header
from vigg_ros.sensors.message_limits import MAX_POINTS, MAX_RANGE_M, shortened
from vigg_ros.sensors.observation import Note, PointCloud
from vigg_ros.sensors.pixels import bytes_of, long_data_note
from vigg_ros.sensors.point_times import TIME_FIELDS, point_times

# sensor_msgs/PointField's datatype constants.
_SAMPLE_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
_MAX_FIELDS = 256
_FLOAT_DATATYPES = (7, 8)


def decode_points(msg: Any) -> PointCloud:
    """The points (N, 3) float32 with their times, in the order of the message.

    Points that are not finite, at the origin or beyond MAX_RANGE_M are dropped with their times. Raises
    DataError when the layout contradicts itself or no point is left.
    """
    header = read_header(msg.header)
    table, notes = _table(msg)
    points = _positions(table)
    kept = _in_range(points)
    if not kept.size:
        raise _empty(f"{len(points)} points, none finite and up to {MAX_RANGE_M:.0f} m away")
    times_s, time_notes = _times(table, kept, header.stamp_ns)
    notes = header.notes + notes + time_notes
    return PointCloud(header.stamp_ns, header.frame_id, _select(points, kept), times_s, notes)


def _table(msg: Any) -> tuple[NDArray[np.void], tuple[Note, ...]]:
    """The fields that are read, as a structured view (H, W) of the message."""
    fields = _fields(msg)
    width, height, step = int(msg.width), int(msg.height), int(msg.point_step)
    row_step, notes = _row_step(msg)
    data = bytes_of(msg.data)
    if data.size < row_step * height:
        raise _layout("CLOUD_DATA_SHORT", f"{data.size} bytes of data", f"{row_step * height}")
    if data.size > row_step * height:
        notes += (long_data_note(data.size, row_step * height),)
    order = ">" if msg.is_bigendian else "<"
    dtype = np.dtype(
        {
            "names": [field.name for field in fields],
            "formats": [order + _SAMPLE_TYPES[field.datatype] for field in fields],
            "offsets": [field.offset for field in fields],
            "itemsize": step,
        }
    )
    return np.ndarray((height, width), dtype, data, strides=(row_step, step)), notes


def _row_step(msg: Any) -> tuple[int, tuple[Note, ...]]:
    width, height, row_step = int(msg.width), int(msg.height), int(msg.row_step)
    points = width * height
    if min(width, height) < 1:
        raise _empty(f"{width}x{height} points")
    if points > MAX_POINTS:
        raise _layout("CLOUD_TOO_LARGE", f"{width}x{height} points", f"at most {MAX_POINTS}")
    row_bytes = width * int(msg.point_step)
    if row_step >= row_bytes:
        return row_step, ()
    if height > 1:
        raise _layout("CLOUD_LAYOUT", f"row_step {row_step}", f"at least {row_bytes} bytes")
    note = Note(
        "CLOUD_ROW_STEP", f"row_step {row_step} for a row of {row_bytes} bytes",
        "ignored, as there is one row", "set row_step to width * point_step",
    )
    return row_bytes, (note,)


def _fields(msg: Any) -> list[Any]:
    """x, y, z and a time if there is one; raises DataError unless they can be read."""
    if not 0 < len(msg.fields) <= _MAX_FIELDS:
        raise _layout("CLOUD_FIELDS", f"{len(msg.fields)} fields", f"3 to {_MAX_FIELDS}")
    for field in msg.fields:
        _check_field(field, int(msg.point_step))
    named: dict[str, list[Any]] = {}
    for field in msg.fields:
        named.setdefault(field.name, []).append(field)
    if any(len(named.get(axis, ())) != 1 for axis in "xyz"):
        names = ", ".join(shortened(name, 20) for name in list(named)[:16])
        raise _layout("CLOUD_FIELDS", f"fields {names}", "x, y and z, once each")
    for axis in "xyz":
        _check_axis(named[axis][0])
    # A normal or an intensity may stand twice; the first time counts.
    return [named[axis][0] for axis in "xyz"] + _time_field(named)


def _check_field(field: Any, point_step: int) -> None:
    sample = _SAMPLE_TYPES.get(int(field.datatype))
    shown = shortened(field.name, 20)
    if sample is None:
        raise _layout("CLOUD_FIELD_TYPE", f"field {shown} of type {field.datatype}", "a type from 1 to 8")
    end = int(field.offset) + np.dtype(sample).itemsize * max(1, int(field.count))
    if field.offset < 0 or end > point_step:
        raise _layout("CLOUD_LAYOUT", f"field {shown} up to byte {end}", f"at most point_step, {point_step}")


def _check_axis(field: Any) -> None:
    if field.datatype not in _FLOAT_DATATYPES or field.count != 1:
        found = f"{field.count} of type {_SAMPLE_TYPES[field.datatype]} in field {field.name}"
        raise _layout("CLOUD_FIELD_TYPE", found, "one float32 or float64, in metres")


def _time_field(named: dict[str, list[Any]]) -> list[Any]:
    found: Sequence[Any] = [named[name][0] for name in TIME_FIELDS if name in named]
    return [field for field in found if field.count == 1][:1]


def _positions(table: NDArray[np.void]) -> NDArray[np.float32]:
    points = np.empty((*table.shape, 3), dtype=np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        for axis, name in enumerate("xyz"):
            points[:, :, axis] = table[name]
    return points.reshape(-1, 3)


def _in_range(points: NDArray[np.float32]) -> NDArray[np.intp]:
    """Which points (K,) of (N, 3) are kept.

    NaN compares false, what overflows is infinite, and no return is (0, 0, 0) to many drivers.
    """
    x, y, z = points.T
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        squared = x * x + y * y + z * z
        return np.flatnonzero((squared > 0) & (squared <= np.float32(MAX_RANGE_M**2)))


def _select(values: NDArray[Any], kept: NDArray[np.intp]) -> NDArray[Any]:
    # take is four times as fast as a mask on rows of three.
    return values if kept.size == len(values) else values.take(kept, axis=0)


def _times(
    table: NDArray[np.void], kept: NDArray[np.intp], stamp_ns: int
) -> tuple[NDArray[np.float64] | None, tuple[Note, ...]]:
    names = [name for name in table.dtype.names or () if name in TIME_FIELDS]
    if not names:
        return None, ()
    column: NDArray[Any] = table[names[0]].reshape(-1)
    return point_times(_select(column, kept), stamp_ns)


def _layout(code: str, found: str, expected: str) -> DataError:
    remedy = "check the publisher; the cloud's header does not describe its data"
    return DataError(code, found=found, expected=expected, remedy=remedy)


def _empty(found: str) -> DataError:
    return DataError("CLOUD_EMPTY", found=found, expected="points", remedy="check the sensor and what stands before it")
