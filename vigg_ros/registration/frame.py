# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A frame: an image, 3-D points, and which pixel sees which point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.errors import DataError


@dataclass(frozen=True, slots=True)
class Frame:
    """One look at the world. Results of registration are in the frame of its points.

    For a depth image that is the camera's optical frame.
    """

    image: NDArray[np.uint8]
    """(H, W) grey or (H, W, 3) BGR."""
    camera: Camera
    depth_m: NDArray[np.float32]
    """(H, W), metres along z, 0 where there is none."""
    stamp_ns: int

    @classmethod
    def from_depth(
        cls,
        image: NDArray[np.uint8],
        depth_m: NDArray[np.floating],
        camera: Camera,
        *,
        stamp_ns: int = 0,
    ) -> Frame:
        """A frame of an RGB-D camera whose depth is aligned to the image.

        image: (H, W) grey or (H, W, 3) BGR, uint8. depth_m: (H, W), metres along the optical axis;
        0, NaN, Inf and negative mean "no depth here". Raises DataError when the sizes disagree.
        """
        image = _check_image(image, camera)
        if depth_m.shape != image.shape[:2] or not np.issubdtype(depth_m.dtype, np.floating):
            raise DataError(
                "DEPTH_SIZE",
                found=f"a depth image of shape {depth_m.shape} and type {depth_m.dtype}",
                expected=f"floating-point metres of shape {image.shape[:2]}, as the colour image",
                remedy="publish depth registered to the colour image",
            )
        valid = np.isfinite(depth_m) & (depth_m > 0)
        return cls(image, camera, np.where(valid, depth_m, 0).astype(np.float32), int(stamp_ns))

    def points_at(self, pixels: NDArray[np.floating]) -> NDArray[np.float64]:
        """Points (N, 3) seen by the pixels (N, 2); NaN where a pixel sees none."""
        column, row = np.rint(pixels).astype(np.intp).T
        depth_m = self.depth_m[row, column].astype(np.float64)
        return self.camera.lift(pixels, np.where(depth_m > 0, depth_m, np.nan))

    def sensor_position(self) -> NDArray[np.float64]:
        """Where the points were seen from (3,), metres, in the frame of the results."""
        return np.zeros(3)

    def points(self) -> NDArray[np.float32]:
        """All points (N, 3), metres, in the frame of the results."""
        row, column = np.nonzero(self.depth_m)
        pixels = np.column_stack((column, row))
        return self.camera.lift(pixels, self.depth_m[row, column]).astype(np.float32)


def _check_image(image: NDArray[np.uint8], camera: Camera) -> NDArray[np.uint8]:
    good_shape = image.ndim == 2 or (image.ndim == 3 and image.shape[2] == 3)
    if not good_shape or image.dtype != np.uint8 or image.shape[:2] != (camera.height_px, camera.width_px):
        raise DataError(
            "IMAGE_SIZE",
            found=f"an image of shape {image.shape} and type {image.dtype}",
            expected=f"uint8 of shape ({camera.height_px}, {camera.width_px}) or ... x 3, as the camera says",
            remedy="use the CameraInfo that belongs to this image",
        )
    return image
