# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A drive of KITTI's raw data (synced and rectified): camera 2 and the Velodyne, each with its own stamps.

``image_02`` and ``velodyne_points`` with ``data/`` and ``timestamps.txt``, ``oxts``, and in this folder or
the one above ``calib_cam_to_cam.txt``, ``calib_velo_to_cam.txt``, ``calib_imu_to_velo.txt``. Format and the
conversion of GPS to metres: the readme and the development kit of the raw data.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from datetime import datetime, timezone
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vigg_ros.bags.trajectories import DatasetPose, rows
from vigg_ros.bench.datasets import kitti
from vigg_ros.bench.datasets.dataset import Dataset, DatasetFile, image_size
from vigg_ros.bench.datasets.number_files import read_numbers
from vigg_ros.registration import BagError
from vigg_ros.registration.rigid import inverse
from vigg_ros.sensors.header import NS_PER_S

_EARTH_RADIUS_M = 6_378_137.0


def open_kitti_raw(folder: Path) -> Dataset:
    """The drive in this folder. Raises BagError when a part is missing or the images are not rectified."""
    images, scans = _stamped(folder / "image_02", ".png"), _stamped(folder / "velodyne_points", ".bin")
    cameras = kitti.read_calibration(_find(folder, "calib_cam_to_cam.txt"))
    P = kitti.take_projection(cameras, "P_rect_02", folder)
    size = image_size(images[0].path)
    if size != tuple(kitti.take(cameras, "S_rect_02", 2, folder).astype(int)):
        raise BagError(f"{folder}: images of {size[0]}x{size[1]} are not the rectified ones; get the _sync drive")
    R_rect = np.eye(4)
    R_rect[:3, :3] = kitti.take(cameras, "R_rect_00", 9, folder).reshape(3, 3)
    T_camera0_lidar = _rotation_translation(folder, "calib_velo_to_cam.txt")
    poses, note = _read_poses(folder, [file.stamp_ns for file in (*images, *scans)])
    return Dataset(
        name=folder.name,
        camera=kitti.rectified_camera(size, P),
        images=images,
        scans=scans,
        poses=poses,
        T_lidar_camera=inverse(
            kitti.rigid_or_refuse(kitti.camera_offset(P) @ R_rect @ T_camera0_lidar, f"{folder}: R_rect_00")
        ),
        slop_ns=kitti.SLOP_NS,
        notes=(note,) if note else (),
    )


def _stamped(folder: Path, suffix: str) -> tuple[DatasetFile, ...]:
    """The files of a sensor; some drives lack a few scans."""
    return kitti.stamped_files(folder / "data", suffix, _read_timestamps(folder / "timestamps.txt"))


def _read_timestamps(path: Path) -> list[int]:
    """Rows ``2011-09-26 13:02:25.964389445``, taken as UTC, in exact ns."""
    try:
        return [_parse_timestamp_ns(" ".join(words)) for _, words in rows(path)]
    except ValueError as error:
        raise BagError(f"{path}: {error}") from error


def _parse_timestamp_ns(text: str) -> int:
    whole, _, fraction = text.partition(".")
    moment = datetime.strptime(whole, "%Y-%m-%d %H:%M:%S").replace(tzinfo=timezone.utc)
    return int(moment.timestamp()) * NS_PER_S + int(fraction.ljust(9, "0")[:9])


def _find(folder: Path, name: str) -> Path:
    for path in (folder / name, folder.parent / name):
        if path.is_file():
            return path
    raise BagError(f"{name} is neither in {folder} nor in {folder.parent}; unpack the drive's calibration")


def _rotation_translation(folder: Path, name: str) -> NDArray[np.float64]:
    path = _find(folder, name)
    calibration = kitti.read_calibration(path)
    T = np.eye(4)
    T[:3, :3] = kitti.take(calibration, "R", 9, path).reshape(3, 3)
    T[:3, 3] = kitti.take(calibration, "T", 3, path)
    return kitti.rigid_or_refuse(T, str(path))


def _read_poses(folder: Path, used_ns: Sequence[int]) -> tuple[tuple[DatasetPose, ...], str]:
    """The Velodyne's poses in its first frame by GPS and IMU while files were taken, and a note if there are none."""
    try:
        T_lidar_imu = _rotation_translation(folder, "calib_imu_to_velo.txt")
        packets = _spanning(_stamped(folder / "oxts", ".txt"), min(used_ns), max(used_ns))
    except BagError as error:
        return (), f"no ground truth: {error}"
    T_earth_imu = _imu_poses([read_numbers(packet.path) for packet in packets], folder)
    T_first_earth = T_lidar_imu @ inverse(T_earth_imu[0])
    poses = (T_first_earth @ T @ inverse(T_lidar_imu) for T in T_earth_imu)
    return tuple(DatasetPose(file.stamp_ns, T) for file, T in zip(packets, poses, strict=True)), ""


def _spanning(files: Sequence[DatasetFile], first_ns: int, last_ns: int) -> Sequence[DatasetFile]:
    """The files from the last one before the first stamp to the first one after the last, by stamp."""
    ordered = sorted(files, key=lambda file: file.stamp_ns)
    stamps_ns = [file.stamp_ns for file in ordered]
    begin = max(bisect_right(stamps_ns, first_ns) - 1, 0)
    return ordered[begin : bisect_left(stamps_ns, last_ns) + 1]


def _imu_poses(packets: list[NDArray[np.float64]], where: Path) -> list[NDArray[np.float64]]:
    """East-north-up poses (4, 4) of packets ``lat lon alt roll pitch yaw ..`` by the kit's Mercator scale."""
    if not all(packet.size >= 6 and np.isfinite(packet[:6]).all() and abs(packet[0]) < 90 for packet in packets):
        raise BagError(f"{where}: an oxts packet has no position; expected lat lon alt roll pitch yaw ..")
    scale = math.cos(math.radians(packets[0][0]))
    poses = []
    for latitude_deg, longitude_deg, altitude_m, roll, pitch, yaw in (packet[:6] for packet in packets):
        T = np.eye(4)
        T[:3, :3] = Rotation.from_euler("ZYX", (yaw, pitch, roll)).as_matrix()
        T[0, 3] = scale * _EARTH_RADIUS_M * math.radians(longitude_deg)
        north = math.log(math.tan(math.pi / 4 + math.radians(latitude_deg) / 2))
        T[1:3, 3] = scale * _EARTH_RADIUS_M * north, altitude_m
        poses.append(T)
    return poses
