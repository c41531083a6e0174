# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The bytes of a sensor_msgs/Image as an array, without a copy.

``data`` is anything with the buffer protocol: bytes, array.array or uint8 in NumPy.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.message_limits import check_image_size, shortened
from vigg_ros.sensors.observation import Note


def bytes_of(data: Any) -> NDArray[np.uint8]:
    """The payload of a message as a read-only array (N,) of bytes that shares its memory."""
    view = np.frombuffer(data, dtype=np.uint8)
    view.flags.writeable = False
    return view


def long_data_note(found_bytes: int, expected_bytes: int) -> Note:
    """The note on a payload with bytes left over."""
    return Note(
        "DATA_LONG", f"{found_bytes} bytes of data where {expected_bytes} were announced",
        "the rest ignored", "check the publisher's step and height",
    )


def pixel_rows(
    msg: Any, dtype: str, *, channels: int = 1, rows: int | None = None
) -> tuple[NDArray[Any], tuple[Note, ...]]:
    """The pixels as a strided view (rows, W, channels) of the message, and what is odd about them.

    dtype: of one sample, with its byte order. rows: how many rows the data holds, the height if not
    given. Raises DataError for sizes that are empty, too large or more than the data.
    """
    width, height, step = int(msg.width), int(msg.height), int(msg.step)
    check_image_size(width, height)
    sample_bytes = np.dtype(dtype).itemsize
    _check_step(msg, width * channels * sample_bytes)
    rows = height if rows is None else rows
    data = bytes_of(msg.data)
    if data.size < step * rows:
        _refuse_short(msg, data.size, step * rows)
    view: NDArray[Any] = np.ndarray(
        (rows, width, channels), dtype, data, strides=(step, channels * sample_bytes, sample_bytes)
    )
    notes = (long_data_note(data.size, step * rows),) if data.size > step * rows else ()
    return view, notes


def _check_step(msg: Any, row_bytes: int) -> None:
    if msg.step < row_bytes:
        raise DataError(
            "IMAGE_STEP", found=f"step {msg.step} for rows of {msg.width} pixels of {shortened(msg.encoding)}",
            expected=f"at least {row_bytes} bytes", remedy="check the publisher's step and encoding",
        )


def _refuse_short(msg: Any, found_bytes: int, expected_bytes: int) -> None:
    raise DataError(
        "IMAGE_DATA_SHORT",
        found=f"{found_bytes} bytes for {msg.width}x{msg.height} {shortened(msg.encoding)}, step {msg.step}",
        expected=f"{expected_bytes} bytes", remedy="check the publisher; the image is cut off",
    )
