# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""JPEG and PNG: sizes are read from their headers, and checked, before anything is unpacked."""

from __future__ import annotations

import struct
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.message_limits import MAX_PIXELS_PER_BYTE, check_payload

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_JPEG_START = b"\xff\xd8\xff"
_JPEG_END = b"\xff\xd9"
_MAX_JPEG_SEGMENTS = 4_096
_START_OF_SCAN = 0xDA
# Start-of-frame markers; 0xC4, 0xC8 and 0xCC in between are tables (ITU-T T.81, table B.1).
_START_OF_FRAME = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}


def decode_image_file(payload: NDArray[np.uint8]) -> NDArray[Any]:
    """The pixels of a JPEG or PNG, (H, W) or (H, W, C), uint8 or uint16, colours in OpenCV's order.

    Raises DataError for anything else, for cut data, and for sizes the data cannot hold.
    """
    width_px, height_px = _size_in_header(payload.tobytes())
    check_payload(width_px, height_px, payload.size, most_per_byte=MAX_PIXELS_PER_BYTE)
    try:
        # Unchanged also means not turned by an orientation tag, of which the calibration knows nothing.
        image = cv2.imdecode(payload, cv2.IMREAD_UNCHANGED)
    except cv2.error:
        image = None
    if image is None or image.shape[:2] != (height_px, width_px):
        raise _broken("data that does not decode")
    return np.asarray(image)


def _size_in_header(data: bytes) -> tuple[int, int]:
    if data.startswith(PNG_SIGNATURE):
        if data[12:16] != b"IHDR" or len(data) < 33:
            raise _broken("a PNG without a header")
        width_px, height_px = struct.unpack_from(">II", data, 16)
        return width_px, height_px
    if data.startswith(_JPEG_START):
        return _jpeg_size(data)
    raise DataError(
        "COMPRESSED_FORMAT", found=f"{len(data)} bytes that begin with {data[:8].hex(' ') or 'nothing'}",
        expected="a JPEG or PNG image", remedy="set the publisher's compression format to jpeg or png",
    )


def _jpeg_size(data: bytes) -> tuple[int, int]:
    size: tuple[int, int] | None = None
    offset = 2
    for _ in range(_MAX_JPEG_SEGMENTS):
        if offset + 9 > len(data) or data[offset] != 0xFF:
            break
        marker = data[offset + 1]
        if marker == 0xFF:  # fill bytes may stand before a marker
            offset += 1
            continue
        if marker in _START_OF_FRAME:
            height_px, width_px = struct.unpack_from(">HH", data, offset + 5)
            size = (width_px, height_px)
        if marker == _START_OF_SCAN and size:
            # Up to OpenCV 4, a cut image is filled with grey. Scans cannot contain the end marker.
            if data.find(_JPEG_END, offset) < 0:
                raise _broken("a JPEG without an end")
            return size
        offset += 2 + int(struct.unpack_from(">H", data, offset + 2)[0])
    raise _broken("a JPEG without an image")


def _broken(what: str) -> DataError:
    return DataError(
        "COMPRESSED_BROKEN", found=what,
        expected="a whole JPEG or PNG image", remedy="check the publisher and the link; the image is cut or corrupted",
    )
