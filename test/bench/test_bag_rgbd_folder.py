# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""RGB-D folders of numbered files: 7-Scenes, 3DMatch and exports of ScanNet."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from vigg_ros.bench.datasets.convert import open_dataset
from vigg_ros.registration import BagError, Camera
from vigg_ros_testing.dataset_samples import (
    CAMERA,
    pose_at,
    real_data,
    save_depth,
    save_image,
    scannet,
    seven_scenes,
    stamps_after_start,
)


@pytest.mark.parametrize("layout", ["7scenes", "3dmatch"])
def test_a_numbered_folder_is_read_with_its_gaps(layout: str, tmp_path: Path) -> None:
    dataset = open_dataset(layout, seven_scenes(tmp_path / "room"))
    assert (dataset.name, dataset.camera, dataset.notes) == ("room", CAMERA, ())
    frames = dataset.frames()
    assert [frame.number for frame in frames] == [0, 1, 2, 5]
    assert stamps_after_start(dataset) == [0, 33_333_333, 66_666_667, 166_666_667]
    for frame in frames:
        assert (frame.image() == frame.number).all()
        depth_m = frame.depth_m()
        assert depth_m.dtype == np.float32
        assert depth_m[0, :2].tolist() == [0, 0]
        np.testing.assert_allclose(depth_m[1:], 1 + frame.number / 1000, rtol=1e-6)
        np.testing.assert_allclose(frame.T_world_sensor, pose_at(frame.number), atol=1e-12)


@pytest.mark.parametrize("spelling", ["{}.color.jpg", "{}.rgb.png"])
def test_other_spellings_of_colour_are_read(spelling: str, tmp_path: Path) -> None:
    folder = seven_scenes(tmp_path, numbers=[3])
    (folder / "frame-000003.color.png").unlink()
    save_image(folder / spelling.format("frame-000003"), 3)
    assert len(open_dataset("7scenes", folder).frames()) == 1


@pytest.mark.parametrize("where", ["sequence", "scene"])
def test_the_only_sequence_is_found_with_the_intrinsics_beside_it(where: str, tmp_path: Path) -> None:
    folder = seven_scenes(tmp_path / "scene" / "seq-01")
    shutil.move(folder / "camera-intrinsics.txt", tmp_path / "scene" / "camera-intrinsics.txt")
    dataset = open_dataset("3dmatch", tmp_path / "scene" if where == "scene" else folder)
    assert (dataset.name, dataset.camera) == ("seq-01", CAMERA)


def test_several_sequences_are_listed(tmp_path: Path) -> None:
    for name in ("seq-01", "seq-02"):
        seven_scenes(tmp_path / name, numbers=[0])
    with pytest.raises(BagError, match="several sequences: seq-01, seq-02; give the folder of one"):
        open_dataset("7scenes", tmp_path)


def test_7scenes_without_intrinsics_takes_its_own_with_a_note(tmp_path: Path) -> None:
    save_image(tmp_path / "frame-000000.color.png", 1, size=(640, 480))
    save_depth(tmp_path / "frame-000000.depth.png", 1000, size=(640, 480))
    dataset = open_dataset("7scenes", tmp_path)
    assert dataset.camera == Camera(640, 480, 585.0, 585.0, 320.0, 240.0)
    assert "taken as 585 585 320 240" in dataset.notes[0]


def test_another_size_without_intrinsics_is_asked_for(tmp_path: Path) -> None:
    folder = seven_scenes(tmp_path)
    (folder / "camera-intrinsics.txt").unlink()
    with pytest.raises(BagError, match=r"images are 8x6 .*give intrinsics"):
        open_dataset("7scenes", folder)
    assert open_dataset("7scenes", folder, intrinsics=(7, 6, 3.5, 2.5)).camera == CAMERA


def test_an_export_of_scannet_is_read_in_the_size_of_its_depth(tmp_path: Path) -> None:
    dataset = open_dataset("scannet", scannet(tmp_path / "scene0000_00"))
    assert dataset.camera == CAMERA
    assert [frame.number for frame in dataset.frames()] == [0, 1, 2, 10]  # 10 after 2, not after 1
    assert {frame.image().shape for frame in dataset.frames()} == {(6, 8, 3)}


@pytest.mark.parametrize("mark", [-np.inf, np.nan])
def test_frames_that_the_reconstruction_lost_have_no_pose(mark: float, tmp_path: Path) -> None:
    folder = scannet(tmp_path)
    np.savetxt(folder / "pose" / "1.txt", np.full((4, 4), mark))
    (folder / "pose" / "2.txt").unlink()
    poses = [frame.T_world_sensor is not None for frame in open_dataset("scannet", folder).frames()]
    assert poses == [True, False, False, True]


def test_a_frame_without_depth_is_no_frame(tmp_path: Path) -> None:
    folder = seven_scenes(tmp_path)
    (folder / "frame-000001.depth.png").unlink()
    dataset = open_dataset("7scenes", folder)
    assert [frame.number for frame in dataset.frames()] == [0, 2, 5]
    assert len(dataset.images) == 4


@pytest.mark.parametrize(
    ("content", "complaint"),
    [("7 0 3.5", "holds 3 numbers; expected a matrix"), ("0 0 0 0 0 0 0 0 1", "intrinsics cannot be used")],
)
def test_broken_intrinsics_are_refused(content: str, complaint: str, tmp_path: Path) -> None:
    folder = seven_scenes(tmp_path)
    (folder / "camera-intrinsics.txt").write_text(content)
    with pytest.raises(BagError, match=complaint):
        open_dataset("7scenes", folder)


def test_the_kitchen_is_read() -> None:
    dataset = open_dataset("7scenes", real_data("redkitchen"))
    frames = dataset.frames()
    assert [frame.number for frame in frames] == list(range(300))
    assert dataset.camera == Camera(640, 480, 585.0, 585.0, 320.0, 240.0)
    assert all(frame.T_world_sensor is not None for frame in frames)
    depth_m = frames[150].depth_m()
    assert 0.5 < np.median(depth_m[depth_m > 0]) < 5  # a kitchen
    assert depth_m.max() < 20
    # 30 Hz: a hand moves less than 10 cm from frame to frame (3 m/s).
    positions = np.array([frame.T_world_sensor[:3, 3] for frame in frames])
    assert np.linalg.norm(np.diff(positions, axis=0), axis=1).max() < 0.1
