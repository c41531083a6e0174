# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Limits to what a message may announce, checked before anything is allocated for it."""

from __future__ import annotations

from vigg_ros.registration.errors import DataError

MAX_PIXELS = 64_000_000
MAX_SIDE_PX = 32_766
"""OpenCV's remap counts pixels in 16 bits."""

MAX_POINTS = 16_000_000
"""10 million are accepted. 16 million take 192 MB as float32, and as much again while some are dropped."""

MAX_RANGE_M = 10_000.0
"""No sensor this package is for sees farther; 1e30 is a driver's word for "no return"."""

MAX_PIXELS_PER_BYTE = 8_256
"""Deflate packs at most 1,032 bytes into one and PNG at most 8 pixels into a byte; JPEG stays below."""

MAX_RVL_PIXELS_PER_BYTE = 1_000
"""RVL writes at least half a byte for a pixel with depth, so beyond this under 0.2 % of them have any."""


def check_image_size(width_px: int, height_px: int) -> None:
    """Raise DataError unless an image of this size may be allocated."""
    sides_good = 0 < width_px <= MAX_SIDE_PX and 0 < height_px <= MAX_SIDE_PX
    if not sides_good or width_px * height_px > MAX_PIXELS:
        raise DataError(
            "IMAGE_DIMENSIONS", found=f"an image of {width_px}x{height_px} pixels",
            expected=f"1 to {MAX_SIDE_PX} pixels a side and at most {MAX_PIXELS} in all",
            remedy="check the camera driver; the header of this message is broken",
        )


def check_payload(width_px: int, height_px: int, payload_bytes: int, *, most_per_byte: int) -> None:
    """Raise DataError if compressed data of this length cannot hold an image of this size."""
    check_image_size(width_px, height_px)
    if width_px * height_px > most_per_byte * payload_bytes:
        raise DataError(
            "IMAGE_DIMENSIONS",
            found=f"{width_px}x{height_px} pixels announced by {payload_bytes} bytes of compressed data",
            expected=f"at most {most_per_byte} pixels a byte",
            remedy="check the publisher; the data is corrupted or hostile",
        )


def shortened(text: object, length: int = 40) -> str:
    """Text of a message as it may be shown: quoted, escaped, cut."""
    shown = str(text)
    return repr(shown) if len(shown) <= length else f"{shown[:length]!r}... ({len(shown)} characters)"
