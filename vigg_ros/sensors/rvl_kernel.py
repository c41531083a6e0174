# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The RVL decoder, compiled; ``rvl.fill_from_rvl_plain`` is its twin in NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np

from vigg_ros.registration.kernels.compilation import compiled


@compiled  # type: ignore[untyped-decorator, unused-ignore]
def _number(payload: Any, nibble: int, max_nibbles: int) -> tuple[int, int]:
    """The number that begins at a nibble, and the nibble after it; -1 if it has no end."""
    number: Any = 0
    for place in range(max_nibbles):
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


@compiled  # type: ignore[untyped-decorator, unused-ignore]
def fill_from_rvl(payload: Any, image: Any, max_nibbles: int) -> bool:
    """Fill a zeroed image (H * W,) uint16 from a stream (N,) uint8; False if it is not one of this image."""
    pixel, nibble, previous = 0, 0, 0
    while pixel < image.size:
        empty, nibble = _number(payload, nibble, max_nibbles)
        full, nibble = _number(payload, nibble, max_nibbles)
        if empty < 0 or full < 0 or empty + full > image.size - pixel:
            return False
        pixel += empty
        for _ in range(full):
            zigzag, nibble = _number(payload, nibble, max_nibbles)
            if zigzag < 0:
                return False
            previous = (previous + ((zigzag >> 1) ^ -(zigzag & 1))) & 0xFFFF
            image[pixel] = previous
            pixel += 1
    return True
