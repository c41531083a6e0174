# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scans from files: --extrinsics means the same for `vigg register` as for `vigg replay`."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vigg_ros.cli.main import main
from vigg_ros_testing.doctor_bags import looking_along_x
from vigg_ros_testing.scene_folder import VIEWED_BY


def camera_points(depth_m: np.ndarray) -> np.ndarray:
    v, u = np.nonzero(depth_m)
    z = depth_m[v, u]
    x, y = (u - VIEWED_BY.cx_px) / VIEWED_BY.fx_px * z, (v - VIEWED_BY.cy_px) / VIEWED_BY.fy_px * z
    return np.column_stack((x, y, z))


def test_the_motion_is_that_of_the_scanner(scene_folder: Path, tmp_path: Path, capsys) -> None:
    T_points_camera = looking_along_x()
    T_points_camera[:3, 3] = 0.3, -0.2, 0.1
    poses, names = [], []
    for k in (0, 2):
        depth = cv2.imread(str(scene_folder / f"frame-{k:06d}.depth.png"), cv2.IMREAD_UNCHANGED)
        points = camera_points(depth / 1000) @ T_points_camera[:3, :3].T + T_points_camera[:3, 3]
        np.save(tmp_path / f"{k}.npy", points.astype(np.float32))
        names += [str(scene_folder / f"frame-{k:06d}.color.png"), str(tmp_path / f"{k}.npy")]
        poses.append(np.loadtxt(scene_folder / f"frame-{k:06d}.pose.txt"))
    quaternion = Rotation.from_matrix(T_points_camera[:3, :3]).as_quat()
    extrinsics = ["--extrinsics", *(f"{value:.9f}" for value in (*T_points_camera[:3, 3], *quaternion))]
    intrinsics = ["--intrinsics", "131", "131", "79.5", "59.5"]
    assert main(["register", *names, *intrinsics, *extrinsics, "--output", str(tmp_path / "out")]) == 0
    shown = capsys.readouterr().out.splitlines()
    T_printed = np.array([[float(word) for word in line.split()] for line in shown[1:5]])
    T_truth = T_points_camera @ np.linalg.inv(poses[0]) @ poses[1] @ np.linalg.inv(T_points_camera)
    # Millimetre depth images; the rest is the voxel grid's.
    np.testing.assert_allclose(T_printed, T_truth, atol=0.01)


@pytest.mark.parametrize(
    ("extrinsics", "words"), [([], "needs --extrinsics X Y Z"), (["0"] * 7, "quaternion"), (["nan"] * 7, "finite")]
)
def test_extrinsics_that_are_none_are_refused(extrinsics, words, scene_folder: Path, tmp_path: Path, capsys) -> None:
    np.save(tmp_path / "scan.npy", np.ones((10, 3), np.float32))
    image, scan = str(scene_folder / "frame-000000.color.png"), str(tmp_path / "scan.npy")
    given = ["--extrinsics", *extrinsics] if extrinsics else []
    intrinsics = ["--intrinsics", "131", "131", "79.5", "59.5"]
    assert main(["register", image, scan, image, scan, *intrinsics, *given]) == 2
    assert words in capsys.readouterr().err
