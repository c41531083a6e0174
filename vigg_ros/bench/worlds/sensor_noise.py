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

_EDGE_PX = 1.0
"""A step in disparity within three pixels, in pixels, that stereo does not match across."""


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
class StereoNoise:
    """An active stereo camera with Intel's D4 chip, by default a RealSense D435 at 640x480.

    Depth is z = f b / d of a disparity d in pixels of its own imagers, whose error does not depend on the distance:
    sigma_z = z^2 sigma_d / (f b), 8 cm (2 %) at 4 m, whatever the resolution of the image that the depth is laid on
    (Grunnet-Jepsen, Sweetser and Woodfill, "Tuning depth cameras for best performance", Intel). Lengths in pixels
    are those of the imagers. Where no source is named the number is an assumption, made to look like such a camera.
    """

    focal_px: float = 383.0
    """Of the imagers, about what cameras of this kind report in camera_info at 640x480."""
    baseline_m: float = 0.05
    """D435: 50 mm (data sheet of the D400 series)."""
    sigma_px: float = 0.1
    """Standard deviation of a disparity, on objects in a room; a well textured wall squarely before the camera has
    less."""
    step_px: float = 1 / 32
    """Disparities come in steps (Grunnet-Jepsen et al., "Subpixel linearity improvement for Intel RealSense depth
    cameras"); 0 measures continuously."""
    correlation_px: float = 2.0
    """Windows of about seven pixels are matched: the blur of the error that makes neighbours err together."""
    least_texture: float = 1.5
    """Standard deviation of the grey levels of a window below which it is not matched: about what grain hides."""
    projector_m: float = 3.0
    """Up to here the camera's own dots are texture enough on any surface (what they are for: Grunnet-Jepsen et al.,
    "Projectors for D400 series depth cameras"; the distance is an assumption)."""
    range_min_m: float = 0.28
    """Disparities end somewhere: 68 px here."""
    range_max_m: float = 10.0
    """The range that the maker states."""

    def __post_init__(self) -> None:
        amounts = (self.sigma_px, self.step_px, self.correlation_px, self.least_texture, self.projector_m)
        if min(amounts) < 0 or min(self.focal_px, self.baseline_m) <= 0:
            raise ConfigError(f"found {self}; expected numbers from 0 up, focal length and baseline above; correct it")

    def sigma_m(self, depth_m: NDArray[np.floating]) -> NDArray[np.float64]:
        """Standard deviation of the error before quantisation, at depths of any shape."""
        return self.sigma_px / (self.focal_px * self.baseline_m) * np.asarray(depth_m, dtype=np.float64) ** 2

    def apply(
        self,
        depth_m: NDArray[np.float32],
        camera: Camera,
        rng: np.random.Generator,
        *,
        image: NDArray[np.uint8] | None = None,
    ) -> NDArray[np.float32]:
        """Measured depth (H, W) float32 from exact depth (H, W), metres; 0 where there is none.

        The image (H, W, 3) is what the imagers see, without grain; without it there is texture everywhere.
        """
        per_native = camera.fx_px / self.focal_px
        with np.errstate(divide="ignore"):
            disparity_px = np.where(depth_m > 0, self.focal_px * self.baseline_m / depth_m, 0.0)
        measured_px = disparity_px + self.sigma_px * _grain(rng, depth_m.shape, self.correlation_px * per_native)
        if self.step_px > 0:
            measured_px = self.step_px * np.rint(measured_px / self.step_px)
        lost = self._unmatched(disparity_px * per_native) | (measured_px <= 0) | (depth_m <= 0)
        measured_m = self.focal_px * self.baseline_m / np.where(measured_px > 0, measured_px, 1.0)
        lost |= (measured_m < self.range_min_m) | (measured_m > self.range_max_m)
        if image is not None:
            lost |= (_texture(image, per_native) < self.least_texture) & (depth_m > self.projector_m)
        return np.where(lost, 0, measured_m).astype(np.float32)

    def _unmatched(self, disparity_px: NDArray[np.float64]) -> NDArray[np.bool_]:
        """What the right imager does not see, for disparities (H, W) in pixels of this image, and the edges of things.

        The left imager is the reference, as in this image: a band at its left has no partner (data sheet), nor has what
        a nearer thing to its right hides. Windows across an edge hold two disparities.
        """
        right_px = np.arange(disparity_px.shape[1]) - disparity_px
        hidden = right_px > np.minimum.accumulate(right_px[:, ::-1], axis=1)[:, ::-1]
        window = np.ones((3, 3), np.uint8)
        jump = cv2.dilate(disparity_px, window) - cv2.erode(disparity_px, window)
        return np.asarray((right_px < 0) | hidden | (jump > _EDGE_PX))


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


def _texture(image: NDArray[np.uint8], per_native: float) -> NDArray[np.float64]:
    """Standard deviation of the grey levels (H, W) in windows of seven pixels of the imagers."""
    side_px = 2 * round(3.5 * per_native) + 1
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY).astype(np.float64)
    mean, square = (cv2.blur(values, (side_px, side_px)) for values in (grey, grey**2))
    return np.asarray(np.sqrt(np.maximum(square - mean**2, 0)))
