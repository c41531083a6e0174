# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""RGB-D folders (7-Scenes, 3DMatch, ScanNet, TUM): associated by stamp, loaded when asked for, refused by name."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from vigg_ros.bench.datasets.convert import open_dataset
from vigg_ros.bench.datasets.dataset import nearest
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
    tum,
)  # fmt: skip

KINECT = Camera(640, 480, 585.0, 585.0, 320.0, 240.0)


@pytest.mark.parametrize(
    ("layout", "colour"), [("7scenes", "color.png"), ("3dmatch", "color.jpg"), ("3dmatch", "rgb.png")]
)
def test_a_numbered_folder_is_read_with_its_gaps(layout: str, colour: str, tmp_path: Path) -> None:
    dataset = open_dataset(layout, seven_scenes(tmp_path / "room", colour=colour))
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


@pytest.mark.parametrize("where", ["sequence", "scene"])
def test_the_only_sequence_is_found_with_the_intrinsics_beside_it(where: str, tmp_path: Path) -> None:
    folder = seven_scenes(tmp_path / "scene" / "seq-01")
    shutil.move(folder / "camera-intrinsics.txt", tmp_path / "scene" / "camera-intrinsics.txt")
    dataset = open_dataset("3dmatch", tmp_path / "scene" if where == "scene" else folder)
    assert (dataset.name, dataset.camera) == ("seq-01", CAMERA)
    seven_scenes(tmp_path / "scene" / "seq-02", numbers=[0])
    with pytest.raises(BagError, match="several sequences: seq-01, seq-02; give the folder of one"):
        open_dataset("7scenes", tmp_path / "scene")


def test_intrinsics_are_taken_as_given_or_by_the_convention_of_7_scenes_with_a_note(tmp_path: Path) -> None:
    save_image(tmp_path / "frame-000000.color.png", 1, size=(640, 480))
    save_depth(tmp_path / "frame-000000.depth.png", 1000, size=(640, 480))
    dataset = open_dataset("7scenes", tmp_path)
    assert dataset.camera == KINECT
    assert "taken as 585 585 320 240" in dataset.notes[0]
    given = open_dataset("7scenes", tmp_path, intrinsics=(600.0, 601.0, 320.0, 240.0))
    assert (given.camera.fx_px, given.camera.fy_px, given.notes) == (600.0, 601.0, ())


@pytest.mark.parametrize("mark", [-np.inf, np.nan])
def test_an_export_of_scannet_is_read_in_the_size_of_its_depth(mark: float, tmp_path: Path) -> None:
    folder = scannet(tmp_path / "scene0000_00")
    # Marks of frames that the reconstruction lost, and a missing file.
    np.savetxt(folder / "pose" / "1.txt", np.full((4, 4), mark))
    (folder / "pose" / "2.txt").unlink()
    dataset = open_dataset("scannet", folder)
    assert dataset.camera == CAMERA
    frames = dataset.frames()
    assert [frame.number for frame in frames] == [0, 1, 2, 10]  # 10 after 2, not after 1
    assert {frame.image().shape for frame in frames} == {(6, 8, 3)}
    assert [frame.T_world_sensor is not None for frame in frames] == [True, False, False, True]


def test_a_frame_without_depth_is_no_frame(tmp_path: Path) -> None:
    folder = seven_scenes(tmp_path)
    (folder / "frame-000001.depth.png").unlink()
    dataset = open_dataset("7scenes", folder)
    assert [frame.number for frame in dataset.frames()] == [0, 2, 5]
    assert len(dataset.images) == 4
    with pytest.raises(BagError, match="frame 0 has no scan"):
        dataset.frames()[0].points()


def test_a_broken_image_is_named_when_it_is_asked_for_and_not_before(tmp_path: Path) -> None:
    folder = seven_scenes(tmp_path)
    for name in ("color", "depth"):
        (folder / f"frame-000001.{name}.png").write_bytes(b"no image")
        frame = open_dataset("7scenes", folder).frames()[1]
        with pytest.raises(BagError, match=rf"frame-000001\.{name}\.png is no readable image"):
            frame.image() if name == "color" else frame.depth_m()
    save_image(folder / "frame-000001.color.png", 1, size=(8, 8))
    with pytest.raises(BagError, match="is 8x8, the calibration is for 8x6"):
        frame.image()
    for save, size in ((save_image, (8, 6)), (save_depth, (16, 12))):  # colour is no depth, nor depth of another size
        save(folder / "frame-000001.depth.png", 1, size=size)
        with pytest.raises(BagError, match=r"expected 16-bit depth of shape \(6, 8\)"):
            frame.depth_m()


@pytest.mark.parametrize(
    ("stamps", "others", "expected"),
    [
        ([10, 20, 30], [11, 19, 33], [0, 1, 2]),
        ([10], [15], [0]),  # at the slop: inclusive
        ([10], [16], [None]),
        ([10], [5, 15], [0]),  # equally near: the earlier
        ([10], [], [None]),
        ([], [1], []),
    ],
)
def test_the_nearest_within_the_slop_is_taken(stamps, others, expected) -> None:
    assert nearest(stamps, others, 5) == expected


def test_tum_keeps_every_stamp_and_associates_within_20_ms(tmp_path: Path) -> None:
    dataset = open_dataset("tum", tum(tmp_path / "fr1"), intrinsics=(7, 6, 3.5, 2.5))
    stamps_ns = [1305031102_175304000, 1305031102_211214000, 1305031102_243211000]
    assert [file.stamp_ns for file in dataset.images] == stamps_ns
    assert dataset.depths[1].stamp_ns == 1305031102_226738000
    assert len(dataset.poses) == 12
    frames = dataset.frames()
    # The third image is 16 ms from the second depth image, which is nearer to the second image.
    assert [frame.number for frame in frames] == [0, 1]
    np.testing.assert_allclose(frames[0].depth_m()[1:], 1.0, rtol=1e-6)
    # Poses stand at .150, .160, ..: the nearest to .175304 is .180, number 3; to .211214 .210, number 6.
    np.testing.assert_allclose([frame.T_world_sensor[0, 3] for frame in frames], [3, 6])


def test_tum_without_intrinsics_and_truth_has_notes(tmp_path: Path) -> None:
    folder = tum(tmp_path)
    (folder / "groundtruth.txt").unlink()
    dataset = open_dataset("tum", folder)
    assert (dataset.camera.fx_px, dataset.camera.cx_px, dataset.camera.cy_px, dataset.poses) == (525, 319.5, 239.5, ())
    assert "no groundtruth.txt" in dataset.notes[0]
    assert "free of" in dataset.notes[-1]
    assert "525 525 319.5 239.5" in dataset.notes[1]


def test_real_tum_images_are_read_by_their_scale() -> None:
    dataset = open_dataset("tum", real_data("tum_fr1_rpy"))
    assert (len(dataset.images), dataset.images[0].path.name[:10]) == (361, f"{dataset.images[0].stamp_ns // 10**9}")
    frames = dataset.frames()
    assert len(frames) > 300
    depth_m = frames[0].depth_m()
    assert 0.5 < np.median(depth_m[depth_m > 0]) < 4  # a desk
    # 30 Hz: the camera turns in place.
    motion = np.linalg.inv(frames[0].T_world_sensor) @ frames[1].T_world_sensor
    assert np.linalg.norm(motion[:3, 3]) < 0.1


def test_the_real_kitchen_is_read() -> None:
    dataset = open_dataset("7scenes", real_data("redkitchen"))
    frames = dataset.frames()
    assert [frame.number for frame in frames] == list(range(300))
    assert dataset.camera == KINECT
    assert frames[150].image().shape == (480, 640, 3)
    depth_m = frames[150].depth_m()
    assert 0.5 < np.median(depth_m[depth_m > 0]) < 5  # a kitchen
    assert depth_m.max() < 20
    # 30 Hz: a hand moves less than 10 cm from frame to frame (3 m/s).
    positions = np.array([frame.T_world_sensor[:3, 3] for frame in frames])
    assert np.linalg.norm(np.diff(positions, axis=0), axis=1).max() < 0.1
