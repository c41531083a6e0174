# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""KITTI's folders: calibrations composed by hand, and the real ones."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from vigg_ros.bench.datasets.convert import open_dataset
from vigg_ros.registration import BagError, Camera
from vigg_ros.registration.rigid import inverse, transform
from vigg_ros_testing.dataset_samples import kitti, kitti_raw, real_data
from vigg_ros_testing.trajectory_samples import pose

# A point of the Velodyne in camera 2: p2 = p0 + K^-1 b with p0 = Tr p; see KITTI_P2 and KITTI_TR.
T_CAMERA2_LIDAR = np.array([[0.0, -1, 0, 0.1], [0, 0, -1, 0.2], [1, 0, 0, 0.3], [0, 0, 0, 1]])
T_CAMERA2_LIDAR[:3, 3] += (14 - 3.5 * 0.5) / 7, (-7 - 2.5 * 0.5) / 7, 0.5

BOTH_LAYOUTS = pytest.mark.parametrize(("layout", "make"), [("kitti", kitti), ("kitti-raw", kitti_raw)])


@BOTH_LAYOUTS
def test_the_extrinsics_lead_from_the_velodyne_into_camera_2(layout: str, make, tmp_path: Path) -> None:
    dataset = open_dataset(layout, make(tmp_path))
    assert dataset.camera == Camera(8, 6, 7.0, 7.0, 3.5, 2.5)
    np.testing.assert_allclose(np.linalg.inv(dataset.T_lidar_camera), T_CAMERA2_LIDAR, atol=1e-12)


def test_a_sequence_of_the_odometry_benchmark(tmp_path: Path) -> None:
    frames = open_dataset("kitti", kitti(tmp_path)).frames()
    assert [frame.stamp_ns for frame in frames] == [1_000_000_000, 1_104_128_400, 1_208_256_800]
    for k, frame in enumerate(frames):
        assert (frame.image() == k).all()
        np.testing.assert_array_equal(frame.points(), [[k, 1, 2], [4, 5, 6]])
        # 2 m a frame along the Velodyne's x, from the origin on, without a turn.
        np.testing.assert_allclose(frame.T_world_sensor, pose(2.0 * k), atol=1e-12)


def test_poses_are_found_where_the_benchmark_puts_them_or_a_note_says_that_there_are_none(tmp_path: Path) -> None:
    folder = kitti(tmp_path / "dataset" / "sequences" / "04")
    poses = tmp_path / "dataset" / "poses" / "04.txt"
    poses.parent.mkdir()
    shutil.move(folder / "poses.txt", poses)
    assert len(open_dataset("kitti", folder).poses) == 3
    poses.unlink()
    dataset = open_dataset("kitti", folder)
    assert [frame.T_world_sensor for frame in dataset.frames()] == [None] * 3
    assert "no ground truth" in dataset.notes[0]


@BOTH_LAYOUTS
def test_missing_scans_leave_their_gap(layout: str, make, tmp_path: Path) -> None:
    folder = make(tmp_path)
    next(folder.glob("velodyne*/**/*1.bin")).unlink()
    frames = open_dataset(layout, folder).frames()
    assert [frame.number for frame in frames] == [0, 2]
    assert frames[1].T_world_sensor[0, 3] == pytest.approx({"kitti": 4, "kitti-raw": 2}[layout])


@pytest.mark.parametrize("content", [b"", b"12345"])
def test_a_broken_scan_is_named_when_it_is_asked_for(content: bytes, tmp_path: Path) -> None:
    folder = kitti(tmp_path)
    (folder / "velodyne" / "000001.bin").write_bytes(content)
    frames = open_dataset("kitti", folder).frames()
    with pytest.raises(BagError, match=r"000001\.bin holds \d+ floats"):
        frames[1].points()
    with pytest.raises(BagError, match="frame 1 has no depth image"):
        frames[1].depth_m()


def test_a_raw_drive(tmp_path: Path) -> None:
    dataset = open_dataset("kitti-raw", kitti_raw(tmp_path))
    # 2011-09-26 13:02:25 UTC is 1,317,042,145 s.
    assert dataset.images[0].stamp_ns == 1317042145_964389445
    assert dataset.scans[2].stamp_ns == 1317042147_951199337
    frames = dataset.frames()
    # Results are in the frame of the scan, so its stamp is the frame's.
    assert [frame.stamp_ns for frame in frames] == [file.stamp_ns for file in dataset.scans]
    # One metre a frame to the east; the IMU looks east (yaw 0), and the Velodyne with it.
    np.testing.assert_allclose([f.T_world_sensor[:3, 3] for f in frames], [[0, 0, 0], [1, 0, 0], [2, 0, 0]], atol=1e-9)


def test_a_raw_drive_turns_about_the_imu(tmp_path: Path) -> None:
    drive = kitti_raw(tmp_path)
    (drive / "oxts" / "data" / "0000000001.txt").write_text(f"0 0 5 0 0 {np.pi / 2}")
    frames = open_dataset("kitti-raw", drive).frames()
    # The Velodyne is 0.8 m before, 0.3 m right of and 0.8 m above the IMU (T of imu to velo: -0.8 0.3 -0.8).
    # A left turn by 90 degrees takes (0.8, -0.3) to (0.3, 0.8).
    np.testing.assert_allclose(frames[1].T_world_sensor[:3, 3], [0.3 - 0.8, 0.8 + 0.3, 0], atol=1e-9)


@pytest.mark.parametrize("what", ["calib_imu_to_velo.txt", "2011_09_26_drive_0001_sync/oxts"])
def test_a_raw_drive_without_imu_has_no_truth(what: str, tmp_path: Path) -> None:
    drive = kitti_raw(tmp_path)
    path = drive.parent / what
    shutil.rmtree(path) if path.is_dir() else path.unlink()
    dataset = open_dataset("kitti-raw", drive)
    assert dataset.poses == ()
    assert "no ground truth" in dataset.notes[0]


@pytest.mark.parametrize(("used", "kept"), [(range(3, 6), range(2, 7)), (range(3), range(4)), (range(9), range(9))])
def test_a_part_of_a_raw_drive_has_the_poses_of_that_part(used: range, kept: range, tmp_path: Path) -> None:
    # Packets come 4 ms before the images and 9 ms after the scans: those of the part, and one on either side.
    drive = kitti_raw(tmp_path, frames=9)
    for path in (*drive.glob("image_02/data/*"), *drive.glob("velodyne_points/data/*")):
        if int(path.stem) not in used:
            path.unlink()
    poses = open_dataset("kitti-raw", drive).poses
    assert [pose.stamp_ns for pose in poses] == [1317042145_960000001 + k * 10**9 for k in kept]
    # In the Velodyne's first frame: that of the first pose.
    np.testing.assert_allclose([pose.T_world_sensor[0, 3] for pose in poses], np.arange(len(kept)), atol=1e-9)


def test_the_real_sequence() -> None:
    folder = real_data("kitti_04")
    dataset = open_dataset("kitti", folder)
    frames = dataset.frames()
    assert len(frames) == 21
    assert dataset.camera == Camera(1226, 370, 707.0912, 707.0912, 601.8873, 183.1104)
    # poses.txt is off from the GICP-refined pairs by about 10 cm over 11 m (shared data's README).
    rows = np.loadtxt(folder / "refined_pairs.txt")
    assert len(rows) > 20
    for target, source, *refined in rows:
        T_target_source = inverse(frames[int(target)].T_world_sensor) @ frames[int(source)].T_world_sensor
        difference = np.abs(T_target_source - np.reshape(refined, (4, 4)))
        assert difference[:3, 3].max() < 0.25
        assert difference[:3, :3].max() < 0.01
    frame = frames[0]
    pixels = frame.camera.project(transform(inverse(dataset.T_lidar_camera), frame.points()))
    # The camera sees 82 of the 360 degrees the Velodyne does (2 atan(613 / 707)), the ground behind less.
    assert 0.1 < frame.camera.contains(pixels).mean() < 0.25
    assert frame.image().shape == (370, 1226, 3)
