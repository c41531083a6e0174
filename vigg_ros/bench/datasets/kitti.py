# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A sequence of the KITTI odometry benchmark: camera 2 (rectified colour) and the Velodyne.

``image_2/NNNNNN.png``, ``velodyne/NNNNNN.bin``, ``calib.txt`` (P0..P3, Tr), ``times.txt``, and the poses of
camera 0 in ``poses.txt`` or ``../../poses/<sequence>.txt``. Format: the benchmark's readme.
Ground truth is given for the Velodyne, in its first frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.trajectories import DatasetPose, rows, stamp_in
from vigg_ros.bench.datasets.dataset import Dataset, DatasetFile, image_size
from vigg_ros.bench.datasets.intrinsics import make_camera
from vigg_ros.bench.datasets.number_files import START_NS, nearest_rigid, read_numbers
from vigg_ros.registration import BagError, Camera
from vigg_ros.registration.rigid import inverse

SLOP_NS = 50_000_000

Calibration = dict[str, NDArray[np.float64]]
"""The numbers (N,) of each row by the row's name."""


def open_kitti(folder: Path) -> Dataset:
    """The sequence in this folder. Raises BagError when a part is missing or does not fit the others."""
    times = folder / "times.txt"
    stamps_ns = [START_NS + stamp_in(times, words[0]) for _, words in rows(times)]
    images = stamped_files(folder / "image_2", ".png", stamps_ns)
    calibration = read_calibration(folder / "calib.txt")
    P = take_projection(calibration, "P2", folder)
    T_camera0_lidar = rigid_or_refuse(_matrix(take(calibration, "Tr", 12, folder)), f"{folder}: the calibration's Tr")
    poses, note = _read_poses(folder, T_camera0_lidar)
    return Dataset(
        name=folder.name,
        camera=rectified_camera(image_size(images[0].path), P),
        images=images,
        scans=stamped_files(folder / "velodyne", ".bin", stamps_ns),
        poses=tuple(DatasetPose(stamp, T) for stamp, T in zip(stamps_ns, poses, strict=False) if T is not None),
        T_lidar_camera=inverse(camera_offset(P) @ T_camera0_lidar),
        slop_ns=SLOP_NS,
        notes=(note,) if note else (),
    )


def stamped_files(folder: Path, suffix: str, stamps_ns: Sequence[int]) -> tuple[DatasetFile, ...]:
    """Files named by nothing but a number, in order, each with the stamp in the row of that number.

    Some may be missing. Raises BagError when all are, or when a file has no row.
    """
    found = {int(path.stem): path for path in folder.glob(f"*{suffix}") if path.stem.isdecimal()}
    if not found:
        raise BagError(f"{folder} holds no files NNNNNN{suffix}")
    if max(found) >= len(stamps_ns):
        raise BagError(f"{folder} has files up to number {max(found)}, but there are {len(stamps_ns)} stamps")
    return tuple(DatasetFile(number, stamps_ns[number], path) for number, path in sorted(found.items()))


def read_calibration(path: Path) -> Calibration:
    """Rows ``name: numbers``; those that hold words, like dates, are left out."""
    found: Calibration = {}
    for _, words in rows(path):
        try:
            found[words[0].rstrip(":")] = np.array([float(word) for word in words[1:]])
        except ValueError:
            continue
    return found


def camera_offset(P: NDArray[np.float64]) -> NDArray[np.float64]:
    """T_camera_camera0 (4, 4) of a rectified camera by its projection P (3, 4)."""
    T = np.eye(4)
    T[:3, 3] = np.linalg.solve(P[:, :3], P[:, 3])
    return T


def take(calibration: Calibration, name: str, size: int, where: Path) -> NDArray[np.float64]:
    """The finite numbers (size,) of a row. Raises BagError when they are missing."""
    numbers = calibration.get(name, np.empty(0))
    if numbers.size != size or not np.isfinite(numbers).all():
        raise BagError(f"{where}: the calibration has no row {name} of {size} numbers")
    return numbers


def take_projection(calibration: Calibration, name: str, where: Path) -> NDArray[np.float64]:
    """The row P (3, 4) = K [I | t] of a rectified camera. Raises BagError when it is missing or singular."""
    P = take(calibration, name, 12, where).reshape(3, 4)
    if abs(np.linalg.det(P[:, :3])) < 1e-9:
        raise BagError(f"{where}: the calibration's {name} is no projection")
    return P


def rectified_camera(size_px: tuple[int, int], P: NDArray[np.float64]) -> Camera:
    """The camera of images of this width and height, with the intrinsics in P (3, 4)."""
    return make_camera(size_px, (P[0, 0], P[1, 1], P[0, 2], P[1, 2]))


def rigid_or_refuse(matrix: NDArray[np.float64], what: str) -> NDArray[np.float64]:
    """The rigid transform (4, 4) that a rounded matrix (4, 4) means. Raises BagError when it is none."""
    T = nearest_rigid(matrix)
    if T is None:
        raise BagError(f"{what} is no rigid transform")
    return T


def _matrix(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4, 4) from the upper three rows."""
    return np.vstack((numbers.reshape(3, 4), (0.0, 0.0, 0.0, 1.0)))


def _read_poses(folder: Path, T_camera0_lidar: NDArray[np.float64]) -> tuple[list[NDArray[np.float64] | None], str]:
    """T_world_lidar of each row, in the Velodyne's first frame, and a note if there are none."""
    candidates = (folder / "poses.txt", folder.parent.parent / "poses" / f"{folder.name}.txt")
    path = next((path for path in candidates if path.is_file()), None)
    if path is None:
        return [], "no poses.txt: the sequence has no ground truth"
    numbers = read_numbers(path)
    if numbers.size % 12:
        raise BagError(f"{path} holds {numbers.size} numbers; expected 12 for each pose")
    T_lidar_camera0 = inverse(T_camera0_lidar)
    poses = [nearest_rigid(_matrix(row)) for row in numbers.reshape(-1, 12)]
    return [None if T is None else T_lidar_camera0 @ T @ T_camera0_lidar for T in poses], ""
