# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Keypoints, descriptors and visual matches (C_vis)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.frame import Frame
from vigg_ros.registration.matches import Matches
from vigg_ros.registration.options import VisualConfig
from vigg_ros.registration.stages import stage

Detector = Callable[[NDArray[np.uint8], int], tuple[NDArray[np.float32], NDArray[Any]]]
"""Grey image (H, W) and a number of keypoints -> pixels (K, 2) as (u, v), descriptors (K, D).

Descriptors are float32 of unit length, compared by angle, or uint8 bit strings, compared by Hamming
distance. A new detector, learned or not, is one more entry of ``DETECTORS``.
"""


MIN_CONTRAST = 0.02
"""Of SIFT keypoints. Half of OpenCV's usual threshold, as a reduced image has half the noise."""

SIFT_OFFSET_PX = np.float32(0.25)
"""OpenCV's SIFT doubles the image without minding where the pixels' centres go, so that keypoints lie a quarter of a
pixel too far right and down (so in 4.6 to 5.0; from 4.8 on ``enable_precise_upscale`` mends it, by default off)."""

ORB_PATCH_PX = 31
"""Side of the patch that an ORB descriptor covers."""


@dataclass(frozen=True, slots=True)
class Keypoints:
    """K keypoints that see a point."""

    pixels: NDArray[np.float32]
    """(K, 2) as (u, v)."""
    points: NDArray[np.float64]
    """(K, 3), metres, in the frame of the results."""
    descriptors: NDArray[Any]
    """(K, D) float32 of unit length, or uint8 bit strings."""
    detected: int
    """How many keypoints the image has, those that see no point included."""
    sigma_m: NDArray[np.float64]
    """(K,) standard deviation of the points along the line of sight; 0 until the frame's noise is known."""

    def __len__(self) -> int:
        return len(self.pixels)

    def select(self, rows: NDArray[Any]) -> Keypoints:
        """Some of the keypoints, by mask or index."""
        return Keypoints(
            self.pixels[rows], self.points[rows], self.descriptors[rows], self.detected, self.sigma_m[rows]
        )


def detect_sift(grey: NDArray[np.uint8], max_keypoints: int) -> tuple[NDArray[np.float32], NDArray[Any]]:
    """SIFT (Lowe 2004), the strongest, descriptors of unit length; see ``Detector``."""
    sift = cv2.SIFT_create(nfeatures=max_keypoints, contrastThreshold=MIN_CONTRAST)
    keypoints, descriptors = sift.detectAndCompute(grey, None)
    if descriptors is None:
        return np.empty((0, 2), np.float32), np.empty((0, 128), np.float32)
    length = np.linalg.norm(descriptors, axis=1, keepdims=True)
    pixels = np.maximum(cv2.KeyPoint.convert(keypoints) - SIFT_OFFSET_PX, 0)
    return pixels, (descriptors / np.maximum(length, 1e-9)).astype(np.float32)


def detect_orb(grey: NDArray[np.uint8], max_keypoints: int) -> tuple[NDArray[np.float32], NDArray[Any]]:
    """ORB (Rublee 2011), the strongest, 256-bit descriptors; see ``Detector``."""
    keypoints, descriptors = (), None
    if min(grey.shape) >= ORB_PATCH_PX:  # OpenCV fails on images that vanish in its pyramid
        keypoints, descriptors = cv2.ORB_create(nfeatures=max_keypoints).detectAndCompute(grey, None)
    if descriptors is None:
        return np.empty((0, 2), np.float32), np.empty((0, 32), np.uint8)
    return cv2.KeyPoint.convert(keypoints), descriptors


DETECTORS: dict[str, Detector] = {"sift": detect_sift, "orb": detect_orb}


@stage("keypoints")
def detect(frame: Frame, config: VisualConfig, *, max_pixels: int | None = None) -> Keypoints:
    """Keypoints of the frame's image, lifted to 3-D; those that see no point are dropped.

    The image is reduced to at most ``max_pixels`` first, if given; pixels are always those of the full image.
    """
    grey = frame.image if frame.image.ndim == 2 else cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY)
    grey = np.ascontiguousarray(grey)
    searched = grey if max_pixels is None else reduce_image(grey, max_pixels)
    pixels, descriptors = DETECTORS[config.detector](searched, config.max_keypoints)
    pixels = _in_full_image(pixels, searched.shape, grey.shape)
    points = frame.points_at(pixels)
    found = Keypoints(pixels, points, descriptors, len(pixels), np.zeros(len(pixels)))
    return found.select(np.flatnonzero(np.isfinite(points).all(axis=1)))


def is_reduced(frame: Frame, config: VisualConfig) -> bool:
    """Whether the frame's image has more pixels than are searched at first."""
    height, width = frame.image.shape[:2]
    return bool(height * width > config.max_pixels)


def reduce_image(grey: NDArray[np.uint8], max_pixels: int) -> NDArray[np.uint8]:
    """The image (H, W) with at most about so many pixels; each is the mean of those that it stands for."""
    height, width = grey.shape
    scale = math.sqrt(max_pixels / (height * width))
    if scale >= 1.0:
        return grey
    size = max(round(width * scale), 1), max(round(height * scale), 1)
    return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), np.uint8)


def _in_full_image(
    pixels: NDArray[np.float32], searched: tuple[int, ...], full: tuple[int, ...]
) -> NDArray[np.float32]:
    """Pixels (K, 2) of a reduced image in the full one; a pixel's centre has whole coordinates in both."""
    if searched == full:
        return pixels
    ratio = np.array((full[1] / searched[1], full[0] / searched[0]), np.float32)
    inside = np.array((full[1] - 1, full[0] - 1), np.float32)
    return np.asarray(np.clip((pixels + np.float32(0.5)) * ratio - np.float32(0.5), 0, inside))


@stage("visual matches")
def match_visual(target: Keypoints, source: Keypoints, config: VisualConfig) -> Matches:
    """C_vis: for each source keypoint its nearest target keypoint, if clearly nearer than the second.

    The ratio is of squared distances (the paper's authors use 0.8). At most ``top_k``, the most similar first.
    """
    if len(target) < 2 or len(source) < 1:
        nearest, squared = np.empty(0, np.int64), np.empty((0, 2))
    else:
        nearest, squared = _nearest_two(target.descriptors, source.descriptors)
    kept = np.flatnonzero(squared[:, 0] < config.ratio * squared[:, 1])
    kept = kept[np.argsort(squared[kept, 0], kind="stable")][: config.top_k]
    rows = nearest[kept]
    sigma_m = np.hypot(target.sigma_m[rows], source.sigma_m[kept])
    return Matches(target.points[rows], source.points[kept], 1.0 - squared[kept, 0] / 2, rows, kept, sigma_m)


def _nearest_two(target: NDArray[Any], source: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Index (M,) of the nearest target descriptor and squared distances (M, 2) to the nearest two, in [0, 2]."""
    cosine = closeness(target, source)
    every = np.arange(len(source))
    nearest = cosine.argmax(axis=1)
    best = cosine[every, nearest].astype(np.float64)
    cosine[every, nearest] = -np.inf
    squared = 2.0 - 2.0 * np.column_stack((best, cosine.max(axis=1)))
    return nearest, np.clip(squared, 0.0, 2.0)


def closeness(target: NDArray[Any], source: NDArray[Any]) -> NDArray[np.float32]:
    """Cosine (M, N) between M source and N target descriptors of either kind."""
    return np.asarray(_hamming_cosine(target, source) if target.dtype == np.uint8 else source @ target.T)


def _hamming_cosine(target: NDArray[np.uint8], source: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Bit strings as vectors of +-1: their cosine is 1 - 2 * Hamming / bits, so ratios mean the same for both."""
    signs_target, signs_source = (np.unpackbits(d, axis=1).astype(np.float32) * 2 - 1 for d in (target, source))
    return np.asarray(signs_source @ signs_target.T / signs_target.shape[1])
