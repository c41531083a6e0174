# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""RVL, lossless compression of 16-bit depth (Wilson, "Fast Lossless Depth Image Compression", ISS 2017).

The stream is made of numbers; a number is made of nibbles of three bits, least significant first, the
fourth bit saying that more follow. The numbers are: a count of pixels without depth, a count of pixels
with depth, for each of the latter the zigzag-coded difference to the one before, and so on. Nibbles fill
little-endian 32-bit words from the top.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.message_limits import MAX_RVL_PIXELS_PER_BYTE, check_payload

MAX_NIBBLES = 11
"""A 32-bit number takes no more."""

_TOO_LONG = 1 << 40


def decode_rvl(payload: NDArray[np.uint8], *, width_px: int, height_px: int) -> NDArray[np.uint16]:
    """The image (H, W) uint16, 0 = no depth, of an RVL stream (N,) uint8.

    Raises DataError for sizes the stream cannot hold and for streams that do not fill the image exactly.
    """
    # Here, because numba takes half a second to import and most cameras do not speak RVL.
    from vigg_ros.sensors.rvl_kernel import fill_from_rvl

    check_payload(width_px, height_px, payload.size, most_per_byte=MAX_RVL_PIXELS_PER_BYTE)
    image = np.zeros(height_px * width_px, dtype=np.uint16)
    if not fill_from_rvl(payload, image, MAX_NIBBLES):
        raise DataError(
            "RVL_OVERRUN",
            found=f"an RVL stream of {payload.size} bytes that ends early or runs over",
            expected=f"exactly the {width_px}x{height_px} pixels it announces",
            remedy="check the publisher and the link; the depth image is corrupted",
        )
    return image.reshape(height_px, width_px)


def fill_from_rvl_plain(payload: NDArray[np.uint8], image: NDArray[np.uint16], max_nibbles: int) -> bool:
    """Fill a zeroed image (H * W,) from a stream (N,); False if the stream is not one of this image.

    The twin of the kernel: all numbers at once, only the runs of pixels are walked one by one.
    """
    numbers = _numbers(_nibbles(payload), max_nibbles)
    counts = _runs(numbers, image.size)
    if counts is None:
        return False
    per_run, pixels = counts
    zigzag = numbers[_alternating(per_run)]
    if zigzag.max(initial=0) >= _TOO_LONG:
        return False
    differences = (zigzag >> 1) ^ -(zigzag & 1)
    # Sums wrap at 16 bits, as the encoder's differences do.
    image[_alternating(pixels)] = np.cumsum(differences).astype(np.uint16)
    return True


def _nibbles(payload: NDArray[np.uint8]) -> NDArray[np.uint8]:
    words = payload[: payload.size // 4 * 4].reshape(-1, 4)[:, ::-1]
    return np.stack((words >> 4, words & 15), axis=-1).reshape(-1)


def _numbers(nibbles: NDArray[np.uint8], max_nibbles: int) -> NDArray[np.int64]:
    """The numbers (M,) that the nibbles (K,) spell; an unfinished last one is left out."""
    ends = np.flatnonzero(nibbles < 8)
    starts = np.concatenate(([0], ends + 1))[: ends.size]
    lengths = ends - starts + 1
    numbers = np.zeros(ends.size, dtype=np.int64)
    for place in range(min(max_nibbles, int(lengths.max(initial=0)))):
        has_place = np.flatnonzero(lengths > place)
        digits = nibbles[starts[has_place] + place] & 7
        numbers[has_place] |= digits.astype(np.int64) << 3 * place
    numbers[lengths > max_nibbles] = _TOO_LONG
    return numbers


def _runs(numbers: NDArray[np.int64], pixels: int) -> tuple[list[int], list[int]] | None:
    """Alternating lengths of what is no difference and what is, among the numbers and among the pixels."""
    per_run: list[int] = []
    per_image: list[int] = []
    left, position, values = pixels, 0, numbers.data
    while left > 0 and position + 1 < len(values):
        empty, full = values[position], values[position + 1]
        per_run += (2, full)
        per_image += (empty, full)
        left -= empty + full
        position += 2 + full
    if left != 0 or position > len(values):
        return None
    return [*per_run, len(values) - position], per_image


def _alternating(lengths: list[int]) -> NDArray[np.bool_]:
    flags = np.zeros(len(lengths), dtype=np.bool_)
    flags[1::2] = True
    return np.repeat(flags, lengths)
