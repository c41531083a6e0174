# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a real sensor adds to a rendered view. A model is applied to arrays; rendering stays exact."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration import Camera, ConfigError


@dataclass(frozen=True, slots=True)
class KinectNoise:
    """A structured-light depth camera (Khoshelham and Elberink 2012; Nguyen, Izadi and Lovell 2012).

    Its error is even in disparity, hence grows with the square of the distance: sigma_z = z^2 * c.
    """

    sigma_per_m2: float = 0.00145
    """c above, metres per square metre: 1.4 mm at 1 m, 13 mm at 3 m (Khoshelham and Elberink)."""
    focal_baseline_px_m: float = 585.0 * 0.075
    """Focal length times baseline: disparity in pixels = this / z."""
    disparity_step_px: float = 0.125
    """Disparities come in steps; 0 measures continuously."""
    correlation_px: float = 1.5
    """Neighbouring errors go together, as the sensor matches windows: the blur of the error; 0 = white."""
    steepest_deg: float = 80.0
    """Surfaces seen at a more grazing angle, and depth edges, give no depth."""
    dropout: float = 0.004
    """Share of the image lost in patches, as on dark or shiny things."""
    range_min_m: float = 0.4
    range_max_m: float = 6.0

    def __post_init__(self) -> None:
        amounts = (self.sigma_per_m2, self.disparity_step_px, self.correlation_px, self.dropout)
        if min(amounts) < 0 or self.focal_baseline_px_m <= 0 or not 0 < self.steepest_deg <= 90:
            raise ConfigError(f"found {self}; expected numbers from 0 up and an angle up to 90; correct it")

    def sigma_m(self, depth_m: NDArray[np.floating]) -> NDArray[np.float64]:
        """Standard deviation of the error before quantisation, at depths of any shape."""
        return self.sigma_per_m2 * np.asarray(depth_m, dtype=np.float64) ** 2

    def apply(self, depth_m: NDArray[np.float32], camera: Camera, rng: np.random.Generator) -> NDArray[np.float32]:
        """Measured depth (H, W) float32 from exact depth (H, W), metres; 0 where there is none."""
        error_m = self.sigma_m(depth_m) * _grain(rng, depth_m.shape, self.correlation_px)
        measured_m = self._quantise(depth_m + error_m)
        lost = (depth_m <= 0) | (measured_m < self.range_min_m) | (measured_m > self.range_max_m)
        lost |= self._too_steep(depth_m, camera)
        if self.dropout > 0:
            patches = _grain(rng, depth_m.shape, 4.0)
            lost |= patches > np.quantile(patches, 1 - self.dropout)
        return np.where(lost, 0, measured_m).astype(np.float32)

    def _quantise(self, depth_m: NDArray[np.float64]) -> NDArray[np.float64]:
        if self.disparity_step_px == 0:
            return depth_m
        scale = self.focal_baseline_px_m / self.disparity_step_px
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(depth_m > 0, scale / np.rint(scale / depth_m), 0.0)

    def _too_steep(self, depth_m: NDArray[np.float32], camera: Camera) -> NDArray[np.bool_]:
        """Where depth changes faster than on a plane of the steepest angle: dz/du = z / f * tan(angle)."""
        down_m = np.pad(np.abs(np.diff(depth_m, axis=0)), ((1, 1), (0, 0)))
        right_m = np.pad(np.abs(np.diff(depth_m, axis=1)), ((0, 0), (1, 1)))
        steps = np.maximum.reduce((down_m[1:], down_m[:-1], right_m[:, 1:], right_m[:, :-1]))
        limit = math.tan(math.radians(self.steepest_deg)) / camera.fx_px
        return np.asarray(steps > limit * depth_m)


@dataclass(frozen=True, slots=True)
class ImageNoise:
    """A camera's gain and grain."""

    gain: float = 1.0
    """Brightness factor, as exposure changes it between frames."""
    sigma: float = 2.0
    """Standard deviation of the error of a pixel, grey levels."""

    def apply(self, image: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
        """Measured image, same shape and type."""
        noisy = self.gain * image.astype(np.float64) + rng.normal(0, self.sigma, image.shape)
        return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def _grain(rng: np.random.Generator, shape: tuple[int, ...], blur_px: float) -> NDArray[np.float64]:
    """Gaussian noise of unit variance at every pixel, correlated over blur_px."""
    if blur_px == 0:
        return rng.standard_normal(shape)
    margin_px = math.ceil(3 * blur_px)
    kernel = cv2.getGaussianKernel(2 * margin_px + 1, blur_px).ravel()
    white = rng.standard_normal((shape[0] + 2 * margin_px, shape[1] + 2 * margin_px))
    blurred = cv2.sepFilter2D(white, cv2.CV_64F, kernel, kernel)
    inner = blurred[margin_px : margin_px + shape[0], margin_px : margin_px + shape[1]]
    return np.asarray(inner / (kernel @ kernel))
