# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""sensor_msgs/Image with colours or greys to BGR or grey, 8 bits.

The encodings are those of sensor_msgs/image_encodings.hpp; "nv12" is of its later versions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.header import read_header
from vigg_ros.sensors.message_limits import shortened
from vigg_ros.sensors.observation import ColourImage, Note
from vigg_ros.sensors.pixels import pixel_rows


@dataclass(frozen=True, slots=True)
class ColourEncoding:
    """How an encoding lays its samples out, and which cv2 conversion makes BGR of it (None: it is)."""

    channels: int
    conversion: int | None = None
    bytes_per_sample: int = 1
    even: tuple[int, int] = (1, 1)
    """Width and height are multiples of these: pixels that share their colour."""
    least_px: int = 1
    chroma_rows: bool = False
    """Half as many rows again follow, with colour at half resolution (4:2:0)."""


# OpenCV names a Bayer pattern by its second row, ROS by its first.
_BAYER = {
    "bayer_rggb": cv2.COLOR_BayerBG2BGR,
    "bayer_bggr": cv2.COLOR_BayerRG2BGR,
    "bayer_gbrg": cv2.COLOR_BayerGR2BGR,
    "bayer_grbg": cv2.COLOR_BayerGB2BGR,
}

COLOUR_ENCODINGS = {
    "mono8": ColourEncoding(1),
    "8UC1": ColourEncoding(1),
    "mono16": ColourEncoding(1, None, 2),
    "bgr8": ColourEncoding(3),
    "8UC3": ColourEncoding(3),
    "rgb8": ColourEncoding(3, cv2.COLOR_RGB2BGR),
    "bgra8": ColourEncoding(4, cv2.COLOR_BGRA2BGR),
    "8UC4": ColourEncoding(4, cv2.COLOR_BGRA2BGR),
    "rgba8": ColourEncoding(4, cv2.COLOR_RGBA2BGR),
    "bgr16": ColourEncoding(3, None, 2),
    "rgb16": ColourEncoding(3, cv2.COLOR_RGB2BGR, 2),
    "bgra16": ColourEncoding(4, cv2.COLOR_BGRA2BGR, 2),
    "rgba16": ColourEncoding(4, cv2.COLOR_RGBA2BGR, 2),
    **{f"{name}8": ColourEncoding(1, code, least_px=3) for name, code in _BAYER.items()},
    **{f"{name}16": ColourEncoding(1, code, 2, least_px=3) for name, code in _BAYER.items()},
    **{name: ColourEncoding(2, cv2.COLOR_YUV2BGR_UYVY, even=(2, 1)) for name in ("uyvy", "yuv422")},
    **{name: ColourEncoding(2, cv2.COLOR_YUV2BGR_YUY2, even=(2, 1)) for name in ("yuyv", "yuv422_yuy2")},
    "nv12": ColourEncoding(1, cv2.COLOR_YUV2BGR_NV12, even=(2, 2), chroma_rows=True),
    "nv21": ColourEncoding(1, cv2.COLOR_YUV2BGR_NV21, even=(2, 2), chroma_rows=True),
}

DEPTH_ENCODINGS = {"16UC1": "u2", "mono16": "u2", "32FC1": "f4", "64FC1": "f8"}
"""Encodings of depth and the type of one sample."""

_DARK_16_BIT = Note(
    "DARK_16_BIT", "a 16-bit image whose samples all stay below 4096",
    "taken as it is, nearly black", "the driver should shift its 10 or 12 bits up, or publish mono8",
)


def decode_image(msg: Any) -> ColourImage:
    """The image as (H, W, 3) BGR or (H, W) grey; 16 bits keep their upper 8, alpha is dropped.

    8UC3 and 8UC4 name no order of colours and are taken as OpenCV's. Raises DataError.
    """
    header = read_header(msg.header)
    encoding = _colour_encoding(msg.encoding)
    _check_multiple(msg, encoding)
    rows = int(msg.height) * 3 // 2 if encoding.chroma_rows else int(msg.height)
    channels = encoding.channels * encoding.bytes_per_sample
    view, notes = pixel_rows(msg, "u1", channels=channels, rows=rows)
    if encoding.bytes_per_sample == 2:
        view = view[:, :, 0 if msg.is_bigendian else 1 :: 2]
        notes += (_DARK_16_BIT,) if view.max() < 16 else ()
    return ColourImage(header.stamp_ns, header.frame_id, to_bgr(view, encoding), header.notes + notes)


def to_bgr(samples: NDArray[np.uint8], encoding: ColourEncoding) -> NDArray[np.uint8]:
    """Samples (H, W, C) of an encoding as (H, W, 3) BGR or (H, W) grey."""
    samples = np.ascontiguousarray(samples[:, :, 0] if encoding.channels == 1 else samples)
    if encoding.conversion is None:
        return samples
    return np.asarray(cv2.cvtColor(samples, encoding.conversion), dtype=np.uint8)


def _colour_encoding(name: str) -> ColourEncoding:
    if name in COLOUR_ENCODINGS:
        return COLOUR_ENCODINGS[name]
    if name in DEPTH_ENCODINGS:
        raise depth_on_image_topic(f"encoding {name}")
    raise DataError(
        "IMAGE_ENCODING", found=f"encoding {shortened(name)}",
        expected=f"one of {', '.join(COLOUR_ENCODINGS)}", remedy="set the driver's pixel format to bgr8 or rgb8",
    )


def depth_on_image_topic(found: str) -> DataError:
    """The error for a depth image where a colour image should be."""
    return DataError(
        "IMAGE_IS_DEPTH", found=f"{found} on the image topic",
        expected="a colour or grey image",
        remedy="remap rgb/image to the colour camera; depth and compressedDepth go to depth/image",
    )


def _check_multiple(msg: Any, encoding: ColourEncoding) -> None:
    (even_x, even_y), least = encoding.even, encoding.least_px
    if msg.width % even_x or msg.height % even_y or min(msg.width, msg.height) < least:
        raise DataError(
            "IMAGE_DIMENSIONS", found=f"{msg.width}x{msg.height} pixels of {msg.encoding}",
            expected=f"multiples of {even_x} and {even_y}, at least {least}, as this encoding shares colours",
            remedy="check the driver's image size",
        )
