# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What surfaces look like, coarsely: whether two images show the same things in the same places.

Blur, other exposure and a wide baseline leave no keypoint to match, yet a red chair stays red: the images
can still contradict an answer that the shapes alone have given.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.rigid import transform

REDUCED_SIDE_PX = 80
"""Pixels of the small image: what blur and a motion error of a voxel hardly change."""

MIN_COMMON_PLACES = 30
"""Places that both images must show before they are compared."""

MIN_CONTRAST_GREY = 4.0
"""Standard deviation in grey levels below which an image shows nothing that could be recognised."""


@dataclass(frozen=True, slots=True)
class Appearance:
    """The image of a frame, much reduced."""

    image: NDArray[np.float32]
    """(h, w, C) grey levels of C channels."""
    camera: Camera
    """Of the image in full size."""
    T_camera_points: NDArray[np.float64]

    @classmethod
    def of(cls, frame: Frame) -> Appearance:
        """Each pixel is the mean of those that it stands for."""
        height, width = frame.image.shape[:2]
        scale = min(1.0, REDUCED_SIDE_PX / max(height, width))
        size = max(round(scale * width), 1), max(round(scale * height), 1)
        small = cv2.resize(frame.image, size, interpolation=cv2.INTER_AREA).astype(np.float32)
        return cls(small.reshape(size[1], size[0], -1), frame.camera, frame.geometry.T_camera_points)

    def at(self, points: NDArray[np.float64]) -> NDArray[np.float32]:
        """Colours (N, C) where points (N, 3) are seen; NaN outside the image and behind the camera."""
        pixels = self.camera.project(transform(self.T_camera_points, points))
        inside = self.camera.contains(pixels)
        colours = np.full((len(points), self.image.shape[2]), np.nan, np.float32)
        ratio = np.array((self.image.shape[1] / self.camera.width_px, self.image.shape[0] / self.camera.height_px))
        places = ((pixels[inside] + 0.5) * ratio - 0.5)[:, ::-1].T  # row, column
        for channel in range(self.image.shape[2]):
            colours[inside, channel] = map_coordinates(self.image[..., channel], places, order=1, mode="nearest")
        return colours


def correlation(first: NDArray[np.float32], second: NDArray[np.float32]) -> float:
    """How alike two images show N places, colours (N, C) each: the mean correlation of the channels in [-1, 1].

    It ignores gain and offset, and channels in which one of the images shows nothing. NaN where fewer than
    MIN_COMMON_PLACES places are seen by both, or nothing is to be seen.
    """
    if first.shape[1] != second.shape[1]:
        first, second = (colours.mean(axis=1, keepdims=True) for colours in (first, second))
    both = np.isfinite(first).all(axis=1) & np.isfinite(second).all(axis=1)
    if np.count_nonzero(both) < MIN_COMMON_PLACES:
        return math.nan
    x, y = (colours[both].astype(np.float64) - colours[both].mean(axis=0) for colours in (first, second))
    spread = x.std(axis=0), y.std(axis=0)
    shown = np.minimum(*spread) >= MIN_CONTRAST_GREY
    if not shown.any():
        return math.nan
    return float(np.mean((x * y).mean(axis=0)[shown] / (spread[0] * spread[1])[shown]))
