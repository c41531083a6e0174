# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What one message says, as arrays: the type between decode and pairing."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.rectification import Rectifier, resized


@dataclass(frozen=True, slots=True)
class Note:
    """Something odd about a message that was accepted; said once per topic and code."""

    code: str
    found: str
    taken: str
    """What was made of it."""
    remedy: str

    def __str__(self) -> str:
        return f"found {self.found}, {self.taken}; {self.remedy}"


@dataclass(frozen=True, slots=True)
class ColourImage:
    """A colour or grey image: (H, W, 3) BGR or (H, W), uint8; it may be a read-only view of the message."""

    stamp_ns: int
    frame_id: str
    image: NDArray[np.uint8]
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True, slots=True)
class DepthImage:
    """A depth image: (H, W) float32, metres along z, 0 where there is none."""

    stamp_ns: int
    frame_id: str
    depth_m: NDArray[np.float32]
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True, slots=True)
class Calibration:
    """A camera: the intrinsics of its rectified image, and how to get there from the image it publishes."""

    stamp_ns: int
    frame_id: str
    camera: Camera
    rectifier: Rectifier | None = None
    """None where the published images are rectified already."""
    cropped: bool = False
    """A region of interest is set: an image of another size is then not a scaled one."""
    notes: tuple[Note, ...] = ()

    def same_camera(self, other: Calibration) -> bool:
        """Whether the other one, of another message, says the same of the camera."""
        return (self.camera, self.rectifier) == (other.camera, other.rectifier)

    def fitted_to(self, image_shape: tuple[int, ...]) -> Calibration:
        """This calibration for images of shape (H, W, ...): itself, or scaled if the aspect is the same.

        Raises DataError when images of this size cannot come from this camera.
        """
        height_px, width_px = image_shape[:2]
        camera = self.camera
        if (width_px, height_px) == (camera.width_px, camera.height_px):
            return self
        if self.cropped or not _same_aspect((width_px, height_px), (camera.width_px, camera.height_px)):
            raise DataError(
                "CALIBRATION_SIZE",
                found=f"an image of {width_px}x{height_px} with a CameraInfo for {camera.width_px}x{camera.height_px}",
                expected="equal sizes, or equal aspect without a region of interest",
                remedy="use the CameraInfo that belongs to this image",
            )
        rectifier = None if self.rectifier is None else self.rectifier.resized(width_px, height_px)
        return replace(self, camera=resized(camera, width_px, height_px), rectifier=rectifier)


def _same_aspect(*sizes: tuple[int, int]) -> bool:
    """Whether one image is the other one scaled: to less than a pixel of the smaller, and to 1 %."""
    (width, height), large = sorted(sizes)
    mismatch = abs(width * large[1] - height * large[0])
    return mismatch < min(large) and 100 * mismatch < width * large[1]


@dataclass(frozen=True, slots=True)
class PointCloud:
    """A scan: points (N, 3) float32, metres, all finite; times_s (N,) from the stamp on, if known."""

    stamp_ns: int
    frame_id: str
    points: NDArray[np.float32]
    times_s: NDArray[np.float64] | None = None
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True, slots=True)
class StampedPose:
    """A frame as seen from another: p_frame = T_frame_child @ p_child, (4, 4) float64.

    ``child_frame_id`` is empty where the message does not name it (PoseStamped).
    """

    stamp_ns: int
    frame_id: str
    child_frame_id: str
    T_frame_child: NDArray[np.float64]
    notes: tuple[Note, ...] = ()


Observation = ColourImage | DepthImage | Calibration | PointCloud | StampedPose
