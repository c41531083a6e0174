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
from vigg_ros.sensors.colour_image import COLOUR_ENCODINGS, DEPTH_ENCODINGS, depth_on_image_topic, to_bgr
from vigg_ros.sensors.header import read_header
from vigg_ros.sensors.image_files import decode_image_file
from vigg_ros.sensors.message_limits import shortened
from vigg_ros.sensors.observation import ColourImage
from vigg_ros.sensors.pixels import bytes_of


def decode_compressed_image(msg: Any) -> ColourImage:
    """A JPEG or PNG as (H, W, 3) BGR or (H, W) grey. Raises DataError."""
    header = read_header(msg.header)
    source = msg.format.split(";")[0].strip()
    if "compressedDepth" in msg.format or source in DEPTH_ENCODINGS.keys() - COLOUR_ENCODINGS.keys():
        raise depth_on_image_topic(f"format {shortened(msg.format)}")
    pixels = decode_image_file(bytes_of(msg.data))
    if pixels.dtype == np.uint16:
        pixels = (pixels >> 8).astype(np.uint8)
    image = _grey_or_bgr(pixels)
    if source.startswith("bayer_") and source in COLOUR_ENCODINGS and image.ndim == 2 and min(image.shape) >= 3:
        # The transport compresses a Bayer mosaic as if it were a grey image.
        image = to_bgr(image[:, :, None], COLOUR_ENCODINGS[source])
    return ColourImage(header.stamp_ns, header.frame_id, image, header.notes)


def _grey_or_bgr(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    if pixels.ndim == 3 and pixels.shape[2] == 4:
        pixels = cv2.cvtColor(pixels, cv2.COLOR_BGRA2BGR)
    if pixels.dtype != np.uint8 or not (pixels.ndim == 2 or pixels.shape[2] == 3):
        raise DataError(
            "COMPRESSED_FORMAT", found=f"an image of shape {pixels.shape} and type {pixels.dtype}",
            expected="1, 3 or 4 channels of 8 or 16 bits", remedy="publish bgr8 or mono8",
        )
    return np.asarray(pixels, dtype=np.uint8)
