# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""RVL, lossless compression of 16-bit depth (Wilson, "Fast Lossless Depth Image Compression", ISS 2017).

The stream is made of numbers; a number is made of nibbles of three bits, least significant first, the
fourth bit saying that more follow. The numbers are: a count of pixels without depth, a count of pixels
with depth, for each of the latter the zigzag-coded difference to the one before, and so on. Nibbles fill
little-endian 32-bit words from the top. Compiled: importing this takes half a second.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import DataError
from vigg_ros.registration.kernels.compilation import compiled
from vigg_ros.sensors.message_limits import MAX_RVL_PIXELS_PER_BYTE, check_payload

MAX_NIBBLES = 11
"""A 32-bit number takes no more."""


def decode_rvl(payload: NDArray[np.uint8], *, width_px: int, height_px: int) -> NDArray[np.uint16]:
    """The image (H, W) uint16, 0 = no depth, of an RVL stream (N,) uint8.

    Raises DataError for sizes the stream cannot hold and for streams that do not fill the image exactly.
    """
    check_payload(width_px, height_px, payload.size, most_per_byte=MAX_RVL_PIXELS_PER_BYTE)
    image = np.zeros(height_px * width_px, dtype=np.uint16)
    if not fill_from_rvl(payload, image):
        raise DataError(
            "RVL_OVERRUN", found=f"an RVL stream of {payload.size} bytes that ends early or runs over",
            expected=f"exactly the {width_px}x{height_px} pixels it announces",
            remedy="check the publisher and the link; the depth image is corrupted",
        )
    return image.reshape(height_px, width_px)


@compiled  # type: ignore[untyped-decorator, unused-ignore]
def fill_from_rvl(payload: Any, image: Any) -> bool:
    """Fill a zeroed image (H * W,) uint16 from a stream (N,) uint8; False if it is not one of this image."""
    pixel, nibble, previous = 0, 0, 0
    while pixel < image.size:
        empty, nibble = _number(payload, nibble)
        full, nibble = _number(payload, nibble)
        if empty < 0 or full < 0 or empty + full > image.size - pixel:
            return False
        pixel += empty
        for _ in range(full):
            zigzag, nibble = _number(payload, nibble)
            if zigzag < 0:
                return False
            # Sums wrap at 16 bits, as the encoder's differences do.
            previous = (previous + ((zigzag >> 1) ^ -(zigzag & 1))) & 0xFFFF
            image[pixel] = previous
            pixel += 1
    return True


@compiled  # type: ignore[untyped-decorator, unused-ignore]
def _number(payload: Any, nibble: int) -> tuple[int, int]:
    """The number that begins at a nibble, and the nibble after it; -1 if it has no end."""
    number: Any = 0
    for place in range(MAX_NIBBLES):
        word = nibble >> 3 << 2
        if word + 4 > payload.size:
            return -1, nibble
        byte = np.int64(payload[word + 3 - ((nibble & 7) >> 1)])
        digit = byte & 15 if nibble & 1 else byte >> 4
        number |= (digit & 7) << 3 * place
        nibble += 1
        if digit < 8:
            return number, nibble
    return -1, nibble


def fill_from_rvl_plain(payload: bytes, image: NDArray[np.uint16]) -> bool:
    """Twin of ``fill_from_rvl``, by the paper's words."""
    numbers, pixel, previous = _numbers_plain(payload), 0, 0
    try:
        while pixel < image.size:
            empty, full = next(numbers), next(numbers)
            if empty + full > image.size - pixel:
                return False
            pixel += empty
            for _ in range(full):
                zigzag = next(numbers)
                previous += -(zigzag + 1) // 2 if zigzag % 2 else zigzag // 2
                image[pixel] = previous % 65_536
                pixel += 1
    except StopIteration:
        return False
    return True


def _numbers_plain(payload: bytes) -> Iterator[int]:
    """The numbers of a stream up to its end or to one that is too long."""
    words = [payload[at : at + 4][::-1].hex() for at in range(0, len(payload) - 3, 4)]
    number = place = 0
    for nibble in (int(digit, 16) for digit in "".join(words)):
        number, place = number | (nibble & 7) << 3 * place, place + 1
        if nibble < 8:
            yield number
            number = place = 0
        elif place == MAX_NIBBLES:
            return
