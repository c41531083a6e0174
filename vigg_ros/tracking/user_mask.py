# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the user says is in view but not of the world: the robot's own body, as an image or as boxes."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.errors import ConfigError, DataError
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.options import InputConfig, mask_boxes


class UserMask:
    """``input.mask_image`` and ``input.mask_boxes``, in pixels of the rectified image. Raises ConfigError."""

    def __init__(self, config: InputConfig) -> None:
        self._image = _read(config.mask_image) if config.mask_image else None
        self._boxes = mask_boxes(config.mask_boxes)

    def apply(self, frame: Frame) -> Frame:
        """The frame without what is masked. Raises DataError for a camera that the mask was not made for."""
        if self._image is None and not self._boxes:
            return frame
        return frame.masked(self._ignored(frame.camera))

    def _ignored(self, camera: Camera) -> NDArray[np.bool_]:
        height, width = shape = camera.height_px, camera.width_px
        ends = [(y1, x1) for _, _, x1, y1 in self._boxes]
        image = np.zeros(shape, bool) if self._image is None else self._image
        if image.shape != shape or any(y1 > height or x1 > width for y1, x1 in ends):
            found = f"mask_image of {image.shape[1]}x{image.shape[0]} pixels" if image.shape != shape else "mask_boxes"
            raise DataError(
                "MASK_SIZE", found=f"input.{found} beyond or unlike an image of {width}x{height}",
                expected="a mask of the camera's size, and boxes inside its image",
                remedy="make the mask for the size and the rectified image of this camera",
            )
        ignored = image.copy()
        for x0, y0, x1, y1 in self._boxes:
            ignored[y0:y1, x0:x1] = True
        return ignored


def _read(path: str) -> NDArray[np.bool_]:
    image = cv2.imread(path, cv2.IMREAD_UNCHANGED)
    if image is None or image.ndim != 2 or image.dtype != np.uint8:
        found = "no image" if image is None else f"an image of shape {image.shape} and type {image.dtype}"
        raise ConfigError(f"input.mask_image: found {found} at {path}, expected an 8-bit image of one channel")
    return np.asarray(image != 0)
