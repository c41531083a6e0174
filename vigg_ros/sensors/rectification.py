# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From the image a camera takes to the image of a pinhole camera: lens distortion and rotation."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.errors import DataError
from vigg_ros.registration.rigid import is_rotation

COEFFICIENT_COUNTS = {"plumb_bob": (4, 5), "rational_polynomial": (8, 12, 14), "equidistant": (4,)}
"""Distortion models of sensor_msgs/distortion_models.hpp and how many coefficients each may have."""

IDENTITY_ROTATION = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def scaled(camera: Camera, size_px: tuple[int, int], scales: tuple[float, float]) -> Camera:
    """The camera of the image scaled along x and y and cut to a size (width, height).

    The origin is the centre of the first pixel, half a pixel inside the image's edge, and it is the edge that stays
    where it is.
    """
    (width_px, height_px), (scale_x, scale_y) = size_px, scales
    cx_px, cy_px = (camera.cx_px + 0.5) * scale_x - 0.5, (camera.cy_px + 0.5) * scale_y - 0.5
    return Camera(width_px, height_px, camera.fx_px * scale_x, camera.fy_px * scale_y, cx_px, cy_px)


def resized(camera: Camera, width_px: int, height_px: int) -> Camera:
    """The camera of the image resized to another size."""
    return scaled(camera, (width_px, height_px), (width_px / camera.width_px, height_px / camera.height_px))


@dataclass(frozen=True, slots=True)
class Rectifier:
    """Turns images of a raw camera into images of a rectified one. Raises DataError if it cannot.

    ``R_rectified_raw`` is a rotation in row-major order, p_rectified = R @ p_raw: CameraInfo's R.
    """

    raw: Camera
    rectified: Camera
    model: str
    coefficients: tuple[float, ...]
    R_rectified_raw: tuple[float, ...] = IDENTITY_ROTATION

    def __post_init__(self) -> None:
        _check_model(self.model, self.coefficients)
        _check_rotation(self.R_rectified_raw)

    def image(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The rectified image, (H, W) or (H, W, 3) uint8, bilinear; 0 where the raw image does not reach."""
        self._check_size(image.shape)
        return np.asarray(cv2.remap(image, *_maps(self).bilinear, cv2.INTER_LINEAR), dtype=np.uint8)

    def depth(self, depth_m: NDArray[np.float32]) -> NDArray[np.float32]:
        """The rectified depth image (H, W), metres along the *rectified* z; nearest pixel, 0 = none.

        Depths are never interpolated: between an edge and its background there is nothing.
        """
        self._check_size(depth_m.shape)
        maps = _maps(self)
        undistorted = cv2.remap(depth_m, maps.nearest, np.empty((0, 0), np.uint16), cv2.INTER_NEAREST)
        turned = maps.z_rectified_per_raw
        return np.asarray(undistorted if turned is None else undistorted * turned, dtype=np.float32)

    def resized(self, width_px: int, height_px: int) -> Rectifier:
        """The same lens, for images resized to another size; the coefficients do not depend on it."""
        return replace(
            self, raw=resized(self.raw, width_px, height_px), rectified=resized(self.rectified, width_px, height_px)
        )

    def _check_size(self, shape: tuple[int, ...]) -> None:
        if shape[:2] != (self.raw.height_px, self.raw.width_px):
            raise DataError(
                "IMAGE_SIZE", found=f"an image of shape {shape}",
                expected=f"({self.raw.height_px}, {self.raw.width_px}), as the camera says",
                remedy="use the CameraInfo that belongs to this image",
            )


def _check_model(model: str, coefficients: tuple[float, ...]) -> None:
    if len(coefficients) in COEFFICIENT_COUNTS.get(model, ()) and all(map(math.isfinite, coefficients)):
        return
    known = ", ".join(f"{name} with {'/'.join(map(str, n))}" for name, n in COEFFICIENT_COUNTS.items())
    raise DataError(
        "BAD_DISTORTION",
        found=f"distortion model {model[:40]!r} with {len(coefficients)} coefficients {coefficients[:14]}",
        expected=f"finite coefficients of {known}",
        remedy="calibrate with one of these models, or publish rectified images",
    )


def _check_rotation(rotation: tuple[float, ...]) -> None:
    R = np.asarray(rotation, dtype=np.float64)
    if R.shape != (9,) or not is_rotation(R.reshape(3, 3)):
        raise DataError(
            "BAD_RECTIFICATION", found=f"rectification matrix R = {rotation}",
            expected="a rotation, or all zeros",
            remedy="calibrate the camera again; a monocular camera has the identity",
        )


@dataclass(frozen=True, slots=True)
class _Maps:
    """Where each rectified pixel comes from, in the forms cv2.remap is fast with."""

    bilinear: tuple[NDArray[Any], NDArray[Any]]
    nearest: NDArray[Any]
    z_rectified_per_raw: NDArray[np.float32] | None
    """(H, W), what a depth is multiplied with because the optical axis has turned; None if it has not."""


@lru_cache(maxsize=4)
def _maps(rectifier: Rectifier) -> _Maps:
    u, v = _source_pixels(rectifier)
    rays = _raw_rays(rectifier)
    folded = np.hypot(rays[0], rays[1]) > _fold_radius(rectifier) * rays[2]
    u[folded] = v[folded] = -2.0
    fixed, fraction = cv2.convertMaps(u, v, cv2.CV_16SC2)
    # remap with INTER_NEAREST reads only the integer map, so that one must be rounded, not cut.
    nearest, _ = cv2.convertMaps(u, v, cv2.CV_16SC2, nninterpolation=True)
    if rectifier.R_rectified_raw == IDENTITY_ROTATION:
        return _Maps((fixed, fraction), nearest, None)
    z_ratio = np.divide(1.0, rays[2], out=np.zeros_like(rays[2]), where=rays[2] > 0)
    return _Maps((fixed, fraction), nearest, z_ratio.astype(np.float32))


def _source_pixels(rectifier: Rectifier) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    raw, rectified = rectifier.raw, rectifier.rectified
    lens, R = np.asarray(rectifier.coefficients), np.reshape(rectifier.R_rectified_raw, (3, 3))
    u, v = _module(rectifier).initUndistortRectifyMap(
        raw.matrix, lens, R, rectified.matrix, (rectified.width_px, rectified.height_px), cv2.CV_32FC1
    )
    # Lenses that no glass has give coordinates beyond any integer; they are outside all the same.
    limits = (-2.0, 2.0 * max(raw.width_px, raw.height_px))
    u, v = (np.nan_to_num(np.clip(pixel, *limits), nan=-2.0) for pixel in (u, v))
    return u, v


def _module(rectifier: Rectifier) -> Any:
    """Where OpenCV has the functions of this model."""
    return cv2.fisheye if rectifier.model == "equidistant" else cv2


def _raw_rays(rectifier: Rectifier) -> NDArray[np.float64]:
    """Rays (3, H, W) of the rectified pixels in the raw camera's frame, of length 1 along rectified z."""
    camera = rectifier.rectified
    x = (np.arange(camera.width_px) - camera.cx_px) / camera.fx_px
    y = (np.arange(camera.height_px) - camera.cy_px) / camera.fy_px
    R = np.reshape(rectifier.R_rectified_raw, (3, 3))
    rays = R[0, :, None, None] * x + R[1, :, None, None] * y[:, None] + R[2, :, None, None]
    return np.asarray(rays, dtype=np.float64)


def _fold_radius(rectifier: Rectifier) -> float:
    """The radius x / z up to which the lens maps outwards rays to outwards pixels.

    Fitted polynomials turn back somewhere beyond the image; rays from there on would show a mirrored
    copy of its rim (OpenCV's undistortion shows it).
    """
    radius = np.linspace(0, 20, 20_001)
    points = np.column_stack((radius, np.zeros_like(radius), np.ones_like(radius)))[:, None, :]
    lens, module = np.array(rectifier.coefficients), _module(rectifier)
    if module is cv2:
        lens[2:4] = 0  # tangential terms shift the image, they do not fold it
    pixels, _ = module.projectPoints(points, np.zeros(3), np.zeros(3), np.eye(3), lens)
    turns = np.flatnonzero(~(np.diff(pixels[..., 0].ravel()) > 0))
    return float(radius[turns[0] if turns.size else -1])
