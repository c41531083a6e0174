# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages with nothing wrong, made of plain attributes; the tests break one thing at a time."""

import struct
import tracemalloc
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from vigg_ros.registration.errors import DataError

STAMP_NS = 1_700_000_000_123_456_789


@contextmanager
def allocating_less_than(peak_bytes: int) -> Iterator[None]:
    """Fail if more memory is taken at a time, also where an error ends it."""
    tracemalloc.start()
    try:
        yield
    finally:
        _, found_bytes = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert found_bytes < peak_bytes


def reject(decode: Any, msg: Any) -> DataError:
    """The error of a message that must be refused, all of it said and nothing allocated for the message."""
    with pytest.raises(DataError):  # the first time, compiling may take memory that is not the message's
        decode(msg)
    with pytest.raises(DataError) as caught, allocating_less_than(500_000):
        decode(msg)
    error = caught.value
    assert all((error.code, error.found, error.expected, error.remedy))
    return error


def header(sec: int = 1_700_000_000, nanosec: int = 123_456_789, frame_id: str = "camera") -> Any:
    return SimpleNamespace(stamp=SimpleNamespace(sec=sec, nanosec=nanosec), frame_id=frame_id)


def image(pixels: np.ndarray, encoding: str, **changes: Any) -> Any:
    """sensor_msgs/Image of an array whose bytes are those of the message."""
    row = pixels.reshape(pixels.shape[0], -1)
    fields = {
        "header": header(),
        "height": pixels.shape[0],
        "width": pixels.shape[1],
        "encoding": encoding,
        "is_bigendian": int(pixels.dtype.byteorder == ">"),
        "step": row.shape[1] * row.itemsize,
        "data": pixels.tobytes(),
    }
    return SimpleNamespace(**{**fields, **changes})


def compressed(data: bytes, text: str, **changes: Any) -> Any:
    return SimpleNamespace(**{"header": header(), "format": text, "data": data, **changes})


def camera_info(**changes: Any) -> Any:
    """sensor_msgs/CameraInfo of a 640x480 camera without distortion."""
    fields = {
        "header": header(),
        "height": 480,
        "width": 640,
        "distortion_model": "plumb_bob",
        "d": [0.0] * 5,
        "k": [500.0, 0, 319.5, 0, 510.0, 239.5, 0, 0, 1],
        "r": [1.0, 0, 0, 0, 1, 0, 0, 0, 1],
        "p": [400.0, 0, 300.0, 0, 0, 410.0, 200.0, 0, 0, 0, 1, 0],
        "binning_x": 0,
        "binning_y": 0,
        "roi": region(),
    }
    return SimpleNamespace(**{**fields, **changes})


def region(x_offset: int = 0, y_offset: int = 0, width: int = 0, height: int = 0) -> Any:
    return SimpleNamespace(x_offset=x_offset, y_offset=y_offset, width=width, height=height, do_rectify=False)


def _placed(names: tuple[str, str], position: dict[str, float], orientation: dict[str, float]) -> Any:
    """x 1, y 2, z 3 without rotation, but for what is given."""
    place = SimpleNamespace(**{"x": 1.0, "y": 2.0, "z": 3.0, **position})
    rotation = SimpleNamespace(**{"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0, **orientation})
    return SimpleNamespace(**dict(zip(names, (place, rotation), strict=True)))


def pose_stamped(position: Any = {}, orientation: Any = {}, **changes: Any) -> Any:  # noqa: B006
    pose = _placed(("position", "orientation"), position, orientation)
    return SimpleNamespace(**{"header": header(frame_id="odom"), "pose": pose, **changes})


def transform_stamped(position: Any = {}, orientation: Any = {}, **changes: Any) -> Any:  # noqa: B006
    inner = _placed(("translation", "rotation"), position, orientation)
    fields = {"header": header(frame_id="odom"), "child_frame_id": "base", "transform": inner}
    return SimpleNamespace(**{**fields, **changes})


DATATYPES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}


def point_field(name: str, offset: int, sample: str = "f4", count: int = 1) -> Any:
    return SimpleNamespace(name=name, offset=offset, datatype=DATATYPES[sample], count=count)


def cloud(table: np.ndarray, **changes: Any) -> Any:
    """sensor_msgs/PointCloud2 of a structured array (N,) or (H, W), laid out as its dtype says."""
    rows = np.atleast_2d(table)
    dtype_fields = rows.dtype.fields or {}
    big = any(dtype.str.startswith(">") for dtype, _ in dtype_fields.values())
    fields = {
        "header": header(frame_id="lidar"),
        "height": rows.shape[0],
        "width": rows.shape[1],
        "fields": [point_field(name, at, dtype.str[1:]) for name, (dtype, at) in dtype_fields.items()],
        "is_bigendian": big,
        "point_step": rows.itemsize,
        "row_step": rows.shape[1] * rows.itemsize,
        "data": rows.tobytes(),
        "is_dense": False,
    }
    return SimpleNamespace(**{**fields, **changes})


def xyz_table(points: Any, dtype: str = "<f4", **columns: np.ndarray) -> np.ndarray:
    """A structured array of points (N, 3) and further columns (N,)."""
    points = np.asarray(points)
    layout = [(axis, dtype) for axis in "xyz"] + [(name, col.dtype) for name, col in columns.items()]
    table = np.zeros(len(points), layout)
    for i, axis in enumerate("xyz"):
        table[axis] = points[:, i]
    for name, column in columns.items():
        table[name] = column
    return table


def png(pixels: np.ndarray, *, claimed: tuple[int, int] | None = None) -> bytes:
    """A PNG file by the specification (ISO 15948), not by a library: (H, W) or (H, W, 3), RGB.

    claimed: a width and height to lie about.
    """
    height, width = pixels.shape[:2]
    depth = 8 * pixels.itemsize
    colour_type = 2 if pixels.ndim == 3 else 0
    rows = b"".join(b"\0" + row.astype(f">u{pixels.itemsize}").tobytes() for row in pixels)
    head = struct.pack(">IIBBBBB", *(claimed or (width, height)), depth, colour_type, 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(rows)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in chunks
    )


def jpeg(pixels: np.ndarray, quality: int = 95) -> bytes:
    return cv2.imencode(".jpg", pixels, (cv2.IMWRITE_JPEG_QUALITY, quality))[1].tobytes()


def rvl_stream(pixels: np.ndarray) -> bytes:
    """Compress depth (H, W) uint16 one pixel after the other, as the paper's listing does."""
    nibbles: list[int] = []
    values = [int(value) for value in pixels.reshape(-1)]
    previous = position = 0
    while position < len(values):
        filled = next((i for i in range(position, len(values)) if values[i]), len(values))
        end = next((i for i in range(filled, len(values)) if not values[i]), len(values))
        _write_number(nibbles, filled - position)
        _write_number(nibbles, end - filled)
        for value in values[filled:end]:
            difference, previous = value - previous, value
            _write_number(nibbles, 2 * difference if difference >= 0 else -2 * difference - 1)
        position = end
    nibbles += [0] * (-len(nibbles) % 8)
    words = (nibbles[i : i + 8] for i in range(0, len(nibbles), 8))
    return b"".join(bytes.fromhex("".join(f"{nibble:x}" for nibble in word))[::-1] for word in words)


def _write_number(nibbles: list[int], number: int) -> None:
    while number > 7:
        nibbles.append(8 | number & 7)
        number >>= 3
    nibbles.append(number)


def rvl_payload(pixels: np.ndarray, a: float = 0.0, b: float = 0.0) -> bytes:
    """The data of a compressedDepth message with RVL."""
    height, width = pixels.shape
    return struct.pack("<iffII", 0, a, b, width, height) + rvl_stream(pixels)


def png_payload(pixels: np.ndarray, a: float = 0.0, b: float = 0.0) -> bytes:
    """The data of a compressedDepth message with PNG."""
    return struct.pack("<iff", 0, a, b) + png(pixels)
