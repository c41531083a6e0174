# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Folders become bags that say the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vigg_ros.bench.datasets.convert import LAYOUTS, convert, open_dataset
from vigg_ros.registration import BagError
from vigg_ros.sensors.colour_image import decode_image
from vigg_ros.sensors.depth_image import decode_depth
from vigg_ros.sensors.point_cloud import decode_points
from vigg_ros.sensors.stamped_pose import decode_pose, decode_transform
from vigg_ros_testing.dataset_samples import kitti, kitti_raw, messages_of, pose_at, scannet, seven_scenes, tum

COLOUR, INFO = "/camera/color/image_raw", "/camera/color/camera_info"
DEPTH, TRUTH = "/camera/aligned_depth_to_color/image_raw", "/ground_truth/pose"
RECTIFIED, POINTS = "/camera/color/image_rect_color", "/velodyne_points"


@pytest.mark.parametrize(("layout", "make"), [("7scenes", seven_scenes), ("scannet", scannet)])
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_an_rgbd_folder_becomes_a_bag(layout: str, make, storage: str, tmp_path: Path) -> None:
    folder = make(tmp_path / "folder")
    summary = convert(layout, folder, tmp_path / "bag", storage=storage)
    assert summary.counts == {COLOUR: 4, INFO: 4, DEPTH: 4, TRUTH: 4}
    frames = open_dataset(layout, folder).frames()
    assert summary.duration_s == pytest.approx((frames[-1].stamp_ns - frames[0].stamp_ns) / 1e9)
    held = messages_of(tmp_path / "bag")
    for k, frame in enumerate(frames):
        image, depth = decode_image(held[COLOUR][k]), decode_depth(held[DEPTH][k])
        pose = decode_pose(held[TRUTH][k])
        assert {image.stamp_ns, depth.stamp_ns, pose.stamp_ns} == {frame.stamp_ns}
        np.testing.assert_array_equal(image.image, frame.image())
        np.testing.assert_allclose(depth.depth_m, frame.depth_m(), rtol=1e-6)
        np.testing.assert_allclose(pose.T_frame_child, pose_at(frame.number), atol=1e-12)
        assert held[DEPTH][k].encoding == "16UC1"
        assert held[INFO][k].p.tolist() == [7, 0, 3.5, 0, 0, 6, 2.5, 0, 0, 0, 1, 0]


def test_tum_keeps_stamps_and_depth_exactly(tmp_path: Path) -> None:
    folder = tum(tmp_path / "fr1")
    summary = convert("tum", folder, tmp_path / "bag", intrinsics=(7, 6, 3.5, 2.5))
    assert summary.counts == {COLOUR: 3, INFO: 3, DEPTH: 3, TRUTH: 12}
    held = messages_of(tmp_path / "bag")
    dataset = open_dataset("tum", folder)
    assert [decode_image(one).stamp_ns for one in held[COLOUR]] == [f.stamp_ns for f in dataset.images]
    assert [decode_depth(one).stamp_ns for one in held[DEPTH]] == [f.stamp_ns for f in dataset.depths]
    # 5,001 / 5,000 m is not a whole number of millimetres: metres keep it.
    assert held[DEPTH][1].encoding == "32FC1"
    np.testing.assert_allclose(decode_depth(held[DEPTH][1]).depth_m[1:], 5001 / 5000, rtol=1e-7)


@pytest.mark.parametrize(("layout", "make"), [("kitti", kitti), ("kitti-raw", kitti_raw)])
def test_kitti_becomes_a_bag_with_scans_and_extrinsics(layout: str, make, tmp_path: Path) -> None:
    folder = make(tmp_path / "04")
    seen: list[tuple[int, int]] = []
    summary = convert(layout, folder, tmp_path / "bag", progress=lambda done, total: seen.append((done, total)))
    assert seen == [(k, 13) for k in range(1, 14)]
    assert summary.counts == {"/tf_static": 1, RECTIFIED: 3, INFO: 3, POINTS: 3, TRUTH: 3}
    held = messages_of(tmp_path / "bag")
    dataset = open_dataset(layout, folder, intrinsics=None)  # as if it had not been given
    transform = decode_transform(held["/tf_static"][0].transforms[0])
    assert (transform.frame_id, transform.child_frame_id) == ("velodyne", "camera_color_optical_frame")
    np.testing.assert_allclose(transform.T_frame_child, dataset.T_lidar_camera, atol=1e-12)
    for message, frame in zip(held[POINTS], dataset.frames(), strict=True):
        cloud = decode_points(message)
        assert (cloud.stamp_ns, cloud.frame_id) == (frame.stamp_ns, "velodyne")
        np.testing.assert_array_equal(cloud.points, frame.points())
        assert [field.name for field in message.fields] == ["x", "y", "z", "intensity"]
        assert (message.width, message.point_step, message.row_step) == (2, 16, 32)
        table = np.frombuffer(message.data, "<f4").reshape(-1, 4)
        np.testing.assert_array_equal(table, np.fromfile(frame.points_path, "<f4").reshape(-1, 4))


def test_the_same_folder_gives_the_same_bytes(tmp_path: Path) -> None:
    folder = seven_scenes(tmp_path / "folder")
    for parent in "ab":
        convert("7scenes", folder, tmp_path / parent / "bag")
    a, b = ((tmp_path / parent / "bag" / "bag.mcap").read_bytes() for parent in "ab")
    assert a == b


def test_a_file_that_cannot_be_read_is_left_out_and_noted(tmp_path: Path) -> None:
    folder = seven_scenes(tmp_path / "folder")
    (folder / "frame-000001.color.png").write_bytes(b"")
    (folder / "frame-000002.depth.png").write_bytes(b"broken")
    summary = convert("7scenes", folder, tmp_path / "bag")
    assert summary.counts == {COLOUR: 3, INFO: 4, DEPTH: 3, TRUTH: 4}
    assert "2 files were left out; the first: " in summary.notes[-1]
    assert "frame-000001.color.png" in summary.notes[-1]


def test_an_existing_bag_is_refused_and_a_folder_that_does_not_fit_leaves_none(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="not there"):
        convert("7scenes", tmp_path / "not there", tmp_path / "bag")
    (tmp_path / "bag").mkdir(exist_ok=False)  # which says that the refused folder left none
    with pytest.raises(BagError, match="exists already"):
        convert("7scenes", tmp_path / "not there", tmp_path / "bag")


@pytest.mark.parametrize("layout", LAYOUTS)
def test_layouts_and_options_that_there_are_not_are_refused(layout: str, tmp_path: Path) -> None:
    with pytest.raises(BagError, match=f"layout {layout} has no option speed; it takes"):
        open_dataset(layout, tmp_path, speed=3)
    with pytest.raises(BagError, match="unknown layout 'euroc'; known ones: 7scenes, 3dmatch"):
        open_dataset("euroc", tmp_path)
