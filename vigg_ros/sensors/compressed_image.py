# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""sensor_msgs/CompressedImage with colours or greys, as compressed_image_transport publishes it.

Its format says "jpeg", "png" or "<encoding>; jpeg compressed <encoding of the compressed image>".
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.colour_image import DEPTH_ENCODINGS, ENCODINGS, to_bgr
from vigg_ros.sensors.header import read_header
from vigg_ros.sensors.image_files import unpack_still
from vigg_ros.sensors.message_limits import shortened
from vigg_ros.sensors.message_shapes import CompressedImageMessage
from vigg_ros.sensors.observation import ColourImage
from vigg_ros.sensors.pixels import bytes_of


def decode_compressed_image(msg: CompressedImageMessage) -> ColourImage:
    """A JPEG or PNG as (H, W, 3) BGR or (H, W) grey. Raises DataError."""
    header = read_header(msg.header)
    _refuse_depth(msg.format)
    pixels = unpack_still(bytes_of(msg.data))
    source = ENCODINGS.get(msg.format.split(";")[0].strip())
    if pixels.dtype == np.uint16:
        pixels = (pixels >> 8).astype(np.uint8)
    if source is not None and source.least_px > 1 and pixels.ndim == 2 and min(pixels.shape) >= 3:
        # The transport compresses a Bayer mosaic as if it were a grey image.
        return ColourImage(header.stamp_ns, header.frame_id, to_bgr(pixels[:, :, None], source), header.notes)
    return ColourImage(header.stamp_ns, header.frame_id, _grey_or_bgr(pixels), header.notes)


def _grey_or_bgr(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    if pixels.ndim == 3 and pixels.shape[2] == 4:
        pixels = cv2.cvtColor(pixels, cv2.COLOR_BGRA2BGR)
    if pixels.dtype != np.uint8 or not (pixels.ndim == 2 or pixels.shape[2] == 3):
        raise DataError(
            "COMPRESSED_FORMAT",
            found=f"an image of shape {pixels.shape} and type {pixels.dtype}",
            expected="1, 3 or 4 channels of 8 or 16 bits",
            remedy="publish bgr8 or mono8",
        )
    return np.asarray(pixels, dtype=np.uint8)


def _refuse_depth(text: str) -> None:
    source = text.split(";")[0].strip()
    if "compressedDepth" in text or (source in DEPTH_ENCODINGS and source not in ENCODINGS):
        raise DataError(
            "IMAGE_IS_DEPTH",
            found=f"format {shortened(text)} on the image topic",
            expected="a colour or grey image as JPEG or PNG",
            remedy="remap rgb/image to the colour camera; compressedDepth goes to depth/image",
        )
