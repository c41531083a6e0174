# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A frame: an image, 3-D points, and which pixel sees which point."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.errors import DataError
from vigg_ros.registration.geometry import DepthMap, ProjectedScan
from vigg_ros.registration.rigid import is_rigid

MAX_COORDINATE_M = 1e5
"""Points beyond are no measurements of any scanner."""

MIN_PROJECTED = 50
"""Points that must fall into the image; fewer come from wrong extrinsics more often than from an open view."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One look at the world. Results of registration are in the frame of its points.

    For a depth image that is the camera's optical frame.
    """

    image: NDArray[np.uint8]
    """(H, W) grey or (H, W, 3) BGR."""
    camera: Camera
    geometry: DepthMap | ProjectedScan
    stamp_ns: int
    apart_s: float = 0.0
    """How far apart image and points were taken, seconds."""

    @classmethod
    def from_depth(
        cls, image: NDArray[np.uint8], depth_m: NDArray[np.floating], camera: Camera, *, stamp_ns: int = 0
    ) -> Frame:
        """A frame of an RGB-D camera whose depth is aligned to the image.

        image: (H, W) grey or (H, W, 3) BGR, uint8. depth_m: (H, W), metres along the optical axis;
        0, NaN, Inf and negative mean "no depth here". Raises DataError when the sizes disagree.
        """
        image = _check_image(image, camera)
        if depth_m.shape != image.shape[:2] or not np.issubdtype(depth_m.dtype, np.floating):
            raise DataError(
                "DEPTH_SIZE", found=f"a depth image of shape {depth_m.shape} and type {depth_m.dtype}",
                expected=f"floating-point metres of shape {image.shape[:2]}, as the colour image",
                remedy="publish depth registered to the colour image",
            )
        with np.errstate(over="ignore"):  # what float32 cannot hold is infinite in it
            metres = depth_m.astype(np.float32)
        metres[~((metres > 0) & (metres < MAX_COORDINATE_M))] = 0  # nor does NaN pass
        return cls(image, camera, DepthMap(camera, metres), int(stamp_ns))

    @classmethod
    def from_points(
        cls,
        image: NDArray[np.uint8], points: NDArray[np.floating], camera: Camera, T_camera_points: NDArray[np.float64],
        *,
        stamp_ns: int = 0, times_s: NDArray[np.float64] | None = None, within_view: bool = False,
    ) -> Frame:
        """A frame of a camera and a scan of the same moment. Results are in the points' frame.

        image: as in ``from_depth``. points: (N, 3) metres, any frame whose origin is the scanner; points
        that are not finite are dropped. T_camera_points: (4, 4). times_s: (N,) seconds from the stamp on,
        for de-skewing. ``within_view`` drops what the camera does not see (the paper's unified field of
        view). Raises DataError for wrong shapes, a transform that is none, and points of which next to
        none projects into the image.
        """
        image = _check_image(image, camera)
        finite = _check_points(points)
        cloud = np.ascontiguousarray(points[finite], np.float32)
        times_s = None if times_s is None else _check_times(times_s, len(points))[finite]
        scan = ProjectedScan(camera, cloud, _check_rigid(T_camera_points), times_s)
        rows, _ = scan.visible()
        if len(rows) < MIN_PROJECTED:
            raise DataError(
                "NO_DEPTH", found=f"{len(rows)} of {len(cloud)} points projecting into the image",
                expected=f"at least {MIN_PROJECTED}",
                remedy="check the extrinsics: T_camera_points takes points to the optical frame (z forward)",
            )
        if within_view:
            times_s = None if times_s is None else times_s[rows]
            scan = ProjectedScan(camera, cloud[rows], scan.T_camera_points, times_s)
        return cls(image, camera, scan, int(stamp_ns))

    def scan_with_times(self) -> tuple[NDArray[np.float32], NDArray[np.float64]] | None:
        """Points (N, 3) and their times (N,), seconds from the stamp on; None where no times are known."""
        if not isinstance(self.geometry, ProjectedScan) or self.geometry.times_s is None:
            return None
        return self.geometry.cloud, self.geometry.times_s

    def with_points(self, points: NDArray[np.float32]) -> Frame:
        """The same frame with its scan replaced by corrected points (N, 3), which have no times any more."""
        assert isinstance(self.geometry, ProjectedScan), "depth images are not corrected"
        scan = replace(self.geometry, cloud=points, times_s=None)
        return replace(self, geometry=scan)

    def masked(self, ignore: NDArray[np.bool_]) -> Frame:
        """The same frame without what is seen where ``ignore`` (H, W) holds: no points, and keypoints see none."""
        return replace(self, geometry=self.geometry.masked(ignore))

    def points_at(self, pixels: NDArray[np.floating]) -> NDArray[np.float64]:
        """Points (K, 3) seen by the pixels (K, 2); NaN where a pixel sees none."""
        return self.geometry.points_at(pixels)

    def points(self) -> NDArray[np.float32]:
        """All points (N, 3), metres, in the frame of the results, whose origin is the sensor."""
        return self.geometry.points()


def _check_image(image: NDArray[np.uint8], camera: Camera) -> NDArray[np.uint8]:
    good_shape = image.ndim == 2 or (image.ndim == 3 and image.shape[2] == 3)
    if not good_shape or image.dtype != np.uint8 or image.shape[:2] != (camera.height_px, camera.width_px):
        raise DataError(
            "IMAGE_SIZE", found=f"an image of shape {image.shape} and type {image.dtype}",
            expected=f"uint8 of shape ({camera.height_px}, {camera.width_px}) or ... x 3, as the camera says",
            remedy="use the CameraInfo that belongs to this image",
        )
    return image


def _check_points(points: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Which points are finite."""
    if points.ndim != 2 or points.shape[1] != 3 or not np.issubdtype(points.dtype, np.floating):
        raise DataError(
            "POINTS_SHAPE", found=f"points of shape {points.shape} and type {points.dtype}",
            expected="floating-point metres of shape (N, 3)", remedy="pass x, y and z only",
        )
    # Before the cast to float32, in which greater numbers overflow; comparisons with NaN are false.
    return np.asarray((np.abs(points) < MAX_COORDINATE_M).all(axis=1))


def _check_times(times_s: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    if times_s.shape != (count,) or not np.isfinite(times_s).all():
        raise DataError(
            "POINT_TIMES",
            found=f"times_s of shape {times_s.shape}" + ("" if np.isfinite(times_s).all() else ", not all finite"),
            expected=f"one finite time for each of {count} points",
            remedy="pass the seconds from the stamp on, or None where no times are known",
        )
    return times_s


def _check_rigid(T_camera_points: NDArray[np.float64]) -> NDArray[np.float64]:
    T = np.asarray(T_camera_points, np.float64)
    if not is_rigid(T):
        raise DataError(
            "BAD_EXTRINSICS", found=f"T_camera_points = {T.tolist()}",
            expected="a rigid transform (4, 4) with an orthonormal rotation",
            remedy="check the calibration between camera and scanner",
        )
    return T
