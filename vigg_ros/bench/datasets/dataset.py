# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings kept as folders of image files: what they hold, loaded when asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.trajectories import DatasetPose
from vigg_ros.registration import BagError, Camera, Frame
from vigg_ros.registration.rigid import inverse
from vigg_ros.sensors.depth_image import NO_RETURN_16_BIT
from vigg_ros.tracking.pairing import assign


@dataclass(frozen=True, slots=True)
class DatasetFile:
    """A file of one image or scan, the stamp it was taken at, and its number in the data set."""

    number: int
    stamp_ns: int
    path: Path


@dataclass(frozen=True, slots=True)
class DatasetFrame:
    """An image with depth or a scan, and the pose if it is known. Nothing is loaded before it is asked for."""

    number: int
    stamp_ns: int
    camera: Camera
    image_path: Path
    depth_path: Path | None
    points_path: Path | None
    depth_unit_m: float
    T_world_sensor: NDArray[np.float64] | None
    """(4, 4): of the camera's optical frame, or of the LiDAR where there are scans."""
    T_lidar_camera: NDArray[np.float64] | None
    """(4, 4) where there are scans."""

    @property
    def name(self) -> str:
        return str(self.number)

    def load(self) -> Frame:
        """The frame to register. Raises DataError or BagError where the files cannot be used."""
        if self.points_path is None:
            return Frame.from_depth(self.image(), self.depth_m(), self.camera, stamp_ns=self.stamp_ns)
        assert self.T_lidar_camera is not None, "data sets with scans have extrinsics"
        T_camera_lidar = inverse(self.T_lidar_camera)
        return Frame.from_points(self.image(), self.points(), self.camera, T_camera_lidar, stamp_ns=self.stamp_ns)

    def image(self) -> NDArray[np.uint8]:
        """(H, W, 3) BGR in the size of the camera. Raises BagError when the file is no image."""
        return load_image(self.image_path, self.camera)

    def depth_m(self) -> NDArray[np.float32]:
        """(H, W) metres, 0 where there is none. Raises BagError without a readable depth image."""
        if self.depth_path is None:
            raise BagError(f"frame {self.number} has no depth image")
        return load_depth_raw(self.depth_path, self.camera) * np.float32(self.depth_unit_m)

    def points(self) -> NDArray[np.float32]:
        """(N, 3) metres in the frame of the LiDAR. Raises BagError without a readable scan."""
        if self.points_path is None:
            raise BagError(f"frame {self.number} has no scan")
        return load_scan(self.points_path)[:, :3]


@dataclass(frozen=True, slots=True)
class Dataset:
    """One recording: a camera's images with depth images or LiDAR scans, each with its own stamps."""

    name: str
    camera: Camera
    images: tuple[DatasetFile, ...]
    depths: tuple[DatasetFile, ...] = ()
    scans: tuple[DatasetFile, ...] = ()
    poses: tuple[DatasetPose, ...] = ()
    depth_unit_m: float = 0.001
    T_lidar_camera: NDArray[np.float64] | None = None
    """(4, 4): the camera in the frame of the scans."""
    slop_ns: int = 20_000_000
    """How far apart the stamps of an image and of its depth or pose may be (inclusive)."""
    notes: tuple[str, ...] = ()

    def frames(self) -> tuple[DatasetFrame, ...]:
        """Each image with a depth image or scan of its own, assigned as in a replay; images without are left out."""
        others = self.scans or self.depths
        images_ns, others_ns = ([file.stamp_ns for file in files] for files in (self.images, others))
        partners = assign(images_ns, others_ns, self.slop_ns)
        pairs = [(index, other) for index, other in enumerate(partners) if other is not None]
        # Results are in the frame of the points; so with scans it is the scan's stamp that counts.
        timed = [others[other] if self.scans else self.images[index] for index, other in pairs]
        poses = nearest([file.stamp_ns for file in timed], [pose.stamp_ns for pose in self.poses], self.slop_ns)
        return tuple(
            self._frame(self.images[index], others[other], file.stamp_ns, pose)
            for (index, other), file, pose in zip(pairs, timed, poses, strict=True)
        )

    def _frame(self, image: DatasetFile, other: DatasetFile, stamp_ns: int, pose: int | None) -> DatasetFrame:
        return DatasetFrame(
            number=image.number,
            stamp_ns=stamp_ns,
            camera=self.camera,
            image_path=image.path,
            depth_path=None if self.scans else other.path,
            points_path=other.path if self.scans else None,
            depth_unit_m=self.depth_unit_m,
            T_world_sensor=None if pose is None else self.poses[pose].T_world_sensor,
            T_lidar_camera=self.T_lidar_camera,
        )


def nearest(stamps_ns: Sequence[int], others_ns: Sequence[int], slop_ns: int) -> list[int | None]:
    """For each stamp the index of the nearest other one, or None if that is further away than the slop.

    The others are sorted. Of two equally near ones it is the earlier.
    """
    stamps, others = np.asarray(stamps_ns, dtype=np.int64), np.asarray(others_ns, dtype=np.int64)
    if not len(others):
        return [None] * len(stamps)
    after = np.searchsorted(others, stamps).clip(0, len(others) - 1)
    before = (after - 1).clip(0)
    best = np.where(np.abs(others[before] - stamps) <= np.abs(others[after] - stamps), before, after)
    close = np.abs(others[best] - stamps) <= slop_ns
    return [int(index) if near else None for index, near in zip(best, close, strict=True)]


def load_image(path: Path, camera: Camera) -> NDArray[np.uint8]:
    """(H, W, 3) BGR, scaled to the camera's size if only that differs. Raises BagError if it is no image."""
    image = _load(path, cv2.IMREAD_COLOR)
    size = camera.width_px, camera.height_px
    height_px, width_px = image.shape[:2]
    if (width_px, height_px) == size:
        return image
    # Cameras with sensors of their own for depth differ by a pixel or two in aspect (ScanNet: 1296x968).
    if abs(width_px / height_px * size[1] / size[0] - 1) > 0.01:
        raise BagError(f"{path} is {width_px}x{height_px}, the calibration is for {size[0]}x{size[1]}")
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))


def load_depth_raw(path: Path, camera: Camera) -> NDArray[np.uint16]:
    """(H, W) in the data set's unit, 0 where there is none. Raises BagError if it is no depth image."""
    depth = _load(path, cv2.IMREAD_UNCHANGED)
    if depth.dtype != np.uint16 or depth.shape != (camera.height_px, camera.width_px):
        raise BagError(
            f"{path} is {depth.dtype} of shape {depth.shape}; expected 16-bit depth of shape "
            f"({camera.height_px}, {camera.width_px}), as the calibration says"
        )
    depth[depth == NO_RETURN_16_BIT] = 0
    return depth


def load_scan(path: Path) -> NDArray[np.float32]:
    """(N, 4) x y z (m) and intensity of a KITTI .bin file. Raises BagError if it is none."""
    try:
        values = np.fromfile(path, dtype="<f4")
    except OSError as error:
        raise BagError(f"{path} cannot be read: {error.strerror}") from error
    if values.size == 0 or values.size % 4:
        raise BagError(f"{path} holds {values.size} floats; expected x y z intensity for each point")
    return values.reshape(-1, 4)


def image_size(path: Path) -> tuple[int, int]:
    """Width and height in pixels. Raises BagError if it is no image."""
    height_px, width_px = _load(path, cv2.IMREAD_UNCHANGED).shape[:2]
    return width_px, height_px


def _load(path: Path, flags: int) -> NDArray[Any]:
    # Read here and not by cv2.imread, which takes no path beyond ASCII on some systems and only warns.
    try:
        image = cv2.imdecode(np.frombuffer(path.read_bytes(), dtype=np.uint8), flags)
    except (OSError, cv2.error) as error:
        raise BagError(f"{path} cannot be read: {error}") from error
    if image is None:
        raise BagError(f"{path} is no readable image")
    return np.asarray(image)
