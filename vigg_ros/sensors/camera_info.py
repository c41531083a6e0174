# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""sensor_msgs/CameraInfo to a calibration (image_pipeline's CameraInfo, REP-104).

One CameraInfo serves two kinds of topics: K and D describe the image as taken (``image_raw``), P the
rectified one (``image_rect``). The message does not say which it accompanies; the image topic's name does.
The matrices are d, k, r, p in ROS 2 and D, K, R, P in ROS 1.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.header import read_header
from vigg_ros.sensors.message_limits import check_image_size
from vigg_ros.sensors.observation import Calibration, Note
from vigg_ros.sensors.rectification import IDENTITY_ROTATION, Rectifier, scaled

ImageKind = Literal["raw", "rectified"]
RectifyPolicy = Literal["auto", "assume_rectified", "undistort"]

_RECTIFIED_NAME = re.compile(r"(?:^|[/_])rect(?:ified)?(?:[/_]|$)")


def images_on(topic: str, rectify: RectifyPolicy = "auto") -> ImageKind:
    """Whether the images of a topic are raw or rectified.

    ``auto`` goes by the names of image_pipeline: "rect" as a word of the topic (image_rect, image_rect_color,
    rgb/rect/image). The other two policies say it for all topics.
    """
    if rectify == "auto":
        return "rectified" if _RECTIFIED_NAME.search(topic.lower()) else "raw"
    return "rectified" if rectify == "assume_rectified" else "raw"


def decode_camera_info(msg: Any, *, images: ImageKind) -> Calibration:
    """The camera of the images that come with this CameraInfo, raw or rectified.

    Rectified images: P, or K where P is zero. Raw images: a rectifier to the camera of P (or K) if the lens
    distorts, K itself if it does not. Binning and region of interest are applied. A zero stamp is allowed,
    as a calibration holds at any time. Raises DataError for what cannot be used.
    """
    header = read_header(msg.header, zero_stamp_allowed=True)
    size = (int(msg.width), int(msg.height))
    check_image_size(*size)
    K, D, R, P = (_matrix(msg, name) for name in "kdrp")
    taken = _camera(msg, K.reshape(3, 3), size)
    rectified = _camera(msg, P.reshape(3, 4), size) if P[0] else taken
    notes = header.notes + _stereo_notes(P)
    rectifier = None
    if images == "raw":
        rectifier = _rectifier(msg.distortion_model, D, R if P[0] else np.zeros(9), taken, rectified)
    camera = taken if images == "raw" and rectifier is None else rectified
    return Calibration(header.stamp_ns, header.frame_id, camera, rectifier, _is_cropped(msg), notes)


def _matrix(msg: Any, name: str) -> NDArray[np.float64]:
    values: Any = getattr(msg, name) if hasattr(msg, name) else getattr(msg, name.upper())
    matrix = np.asarray(values, dtype=np.float64).reshape(-1)
    length = {"k": 9, "r": 9, "p": 12}.get(name, matrix.size)
    if matrix.size != length or not np.isfinite(matrix).all():
        raise DataError(
            "BAD_INTRINSICS",
            found=f"{name.upper()} of {matrix.size} numbers, {np.isfinite(matrix).sum()} of them finite",
            expected=f"{length} finite numbers", remedy="calibrate the camera, or publish the calibration it has",
        )
    return matrix


def _camera(msg: Any, K: NDArray[np.float64], size: tuple[int, int]) -> Camera:
    """The camera of the published image from a matrix for the full sensor."""
    if K[0, 1] != 0:
        raise DataError(
            "BAD_INTRINSICS", found=f"a skew of {K[0, 1]}", expected="0", remedy="calibrate with a model without skew"
        )
    full = Camera(*size, float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]))
    return _binned(_cropped(full, msg), msg)


def _cropped(full: Camera, msg: Any) -> Camera:
    if not _is_cropped(msg):
        return full
    left, top, width, height = _region(msg)
    if not (width and height and left + width <= full.width_px and top + height <= full.height_px):
        raise DataError(
            "BAD_REGION",
            found=f"region {width}x{height} at ({left}, {top}) of {full.width_px}x{full.height_px} pixels",
            expected="a window of the image, or all zeros", remedy="check the driver's region of interest",
        )
    return replace(full, width_px=width, height_px=height, cx_px=full.cx_px - left, cy_px=full.cy_px - top)


def _region(msg: Any) -> tuple[int, int, int, int]:
    return int(msg.roi.x_offset), int(msg.roi.y_offset), int(msg.roi.width), int(msg.roi.height)


def _is_cropped(msg: Any) -> bool:
    return _region(msg) not in ((0, 0, 0, 0), (0, 0, int(msg.width), int(msg.height)))


def _binned(camera: Camera, msg: Any) -> Camera:
    factor_x, factor_y = max(1, int(msg.binning_x)), max(1, int(msg.binning_y))
    if factor_x > camera.width_px or factor_y > camera.height_px:
        raise DataError(
            "BAD_BINNING", found=f"binning {factor_x}x{factor_y} of {camera.width_px}x{camera.height_px} pixels",
            expected="fewer than the image has", remedy="check the driver's binning",
        )
    if factor_x == factor_y == 1:
        return camera
    return scaled(camera, (camera.width_px // factor_x, camera.height_px // factor_y), (1 / factor_x, 1 / factor_y))


def _rectifier(
    model: str, D: NDArray[np.float64], R: NDArray[np.float64], taken: Camera, rectified: Camera
) -> Rectifier | None:
    """What undistorts the images, None if there is nothing to undistort."""
    rotation = tuple(R.tolist()) if R.any() else IDENTITY_ROTATION
    if D.any():
        return Rectifier(taken, rectified, model, tuple(D.tolist()), rotation)
    if rotation == IDENTITY_ROTATION:
        return None
    # A lens without distortion in a rig that is rotated: any model will do.
    return Rectifier(taken, rectified, "plumb_bob", (0.0,) * 4, rotation)


def _stereo_notes(P: NDArray[np.float64]) -> tuple[Note, ...]:
    if not (P[3] or P[7]):
        return ()
    return (
        Note(
            "STEREO_OFFSET", f"P with an offset of ({P[3]:.6g}, {P[7]:.6g}), the second camera of a stereo pair",
            "taken as a camera at the origin of its own frame",
            "use the first camera, or give this one its own frame_id",
        ),
    )
