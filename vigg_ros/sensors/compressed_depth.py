# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""sensor_msgs/CompressedImage with depth, as compressed_depth_image_transport publishes it.

Its format says "<16UC1|32FC1>; compressedDepth[ png| rvl]"; the data begins with 12 bytes: an int32
without meaning and two float32 (A, B) for 32FC1, whose depths are A / (value - B), 0 = none. Then comes
a 16-bit PNG, or width and height as uint32 and an RVL stream. All numbers are little-endian.
"""

from __future__ import annotations

import math
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.depth_image import UNIT_FLOAT_M, depth_image, depth_sample
from vigg_ros.sensors.header import read_header
from vigg_ros.sensors.image_files import PNG_SIGNATURE, decode_image_file
from vigg_ros.sensors.message_limits import shortened
from vigg_ros.sensors.observation import DepthImage, Note
from vigg_ros.sensors.pixels import bytes_of

HEADER_BYTES = 12


def decode_compressed_depth(msg: Any, *, depth_scale_m: float | None = None) -> DepthImage:
    """The depth image as (H, W) float32 metres, 0 where there is none; see ``decode_depth``.

    A 16-bit PNG without the header is accepted with a note, as 16UC1. Raises DataError.
    """
    header = read_header(msg.header)
    encoding, codec = _read_format(msg.format)
    payload = bytes_of(msg.data)
    if encoding == "u2" and payload[:8].tobytes() == PNG_SIGNATURE:
        return depth_image(header, _unpack_png(payload), depth_scale_m, (_BARE_PNG,))
    _check_header(payload.size)
    unpack = _unpack_rvl if codec == "rvl" else _unpack_png
    samples = unpack(payload[HEADER_BYTES:])
    if encoding == "u2":
        return depth_image(header, samples, depth_scale_m)
    a, b = struct.unpack("<ff", payload[4:HEADER_BYTES].tobytes())
    scale_m = UNIT_FLOAT_M if depth_scale_m is None else depth_scale_m
    return depth_image(header, _from_inverse(samples, a, b), scale_m)


_BARE_PNG = Note(
    "DEPTH_HEADER_MISSING", "a PNG without the 12 bytes of compressedDepth before it",
    "taken as 16-bit depth", "publish through compressed_depth_image_transport",
)


def _read_format(text: str) -> tuple[str, str]:
    """Type of a sample and codec. Early versions of the transport name neither codec nor transport."""
    encoding, _, transport = (part.strip() for part in text.partition(";"))
    sample = depth_sample(encoding)
    words = transport.split()
    plain_png = words[:1] == ["png"] and sample == "u2"
    if sample == "f8" or not (plain_png or words in ([], *_TRANSPORTS)):
        raise DataError(
            "COMPRESSED_FORMAT", found=f"format {shortened(text)} on the depth topic",
            expected="16UC1 or 32FC1; compressedDepth, png or rvl",
            remedy="subscribe to the topic that ends in /compressedDepth; JPEG loses depth",
        )
    return sample, "rvl" if words[-1:] == ["rvl"] else "png"


_TRANSPORTS = (["compressedDepth"], ["compressedDepth", "png"], ["compressedDepth", "rvl"])


def _check_header(size_bytes: int) -> None:
    if size_bytes <= HEADER_BYTES:
        raise DataError(
            "DEPTH_HEADER", found=f"{size_bytes} bytes of compressedDepth",
            expected=f"a header of {HEADER_BYTES} bytes and an image",
            remedy="check the publisher; the data is cut off",
        )


def _unpack_png(compressed: NDArray[np.uint8]) -> NDArray[np.uint16]:
    samples = decode_image_file(compressed)
    if samples.ndim != 2 or samples.dtype != np.uint16:
        raise DataError(
            "DEPTH_IS_COLOUR", found=f"an image of shape {samples.shape} and type {samples.dtype} on the depth topic",
            expected="one channel of 16 bits",
            remedy="remap depth/image to the compressedDepth topic of the depth camera",
        )
    return samples


def _unpack_rvl(compressed: NDArray[np.uint8]) -> NDArray[np.uint16]:
    # Here, because numba takes half a second to import and most cameras do not speak RVL.
    from vigg_ros.sensors.rvl import decode_rvl

    _check_header(HEADER_BYTES + max(0, compressed.size - 8))
    width_px, height_px = struct.unpack("<II", compressed[:8].tobytes())
    return decode_rvl(compressed[8:], width_px=width_px, height_px=height_px)


def _from_inverse(samples: NDArray[np.uint16], a: float, b: float) -> NDArray[np.float32]:
    """Metres (H, W) of quantised inverse depths; 0 and what no depth maps to become 0."""
    if not (math.isfinite(a) and math.isfinite(b) and a > 0):
        raise DataError(
            "DEPTH_QUANTISATION", found=f"quantisation A = {a}, B = {b}",
            expected="finite numbers, A > 0", remedy="check the publisher; the header of compressedDepth is broken",
        )
    steps = np.arange(65_536, dtype=np.float32) - np.float32(b)
    table = np.divide(np.float32(a), steps, out=np.zeros_like(steps), where=steps > 0)
    table[0] = 0
    return np.take(table, samples)
