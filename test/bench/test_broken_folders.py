# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Data set folders of which a part is missing or broken: what is wrong is named."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from vigg_ros.bench.datasets.convert import open_dataset
from vigg_ros.registration import BagError
from vigg_ros_testing.dataset_samples import KITTI_TR, kitti, kitti_raw, save_image, seven_scenes, tum

P2, PACKET = "P2: 7 0 3 0 0 7 2 0 0 0 1 0", "oxts/data/0000000001.txt"


@pytest.mark.parametrize("layout", ["7scenes", "tum", "images", "kitti", "kitti-raw"])
@pytest.mark.parametrize("kind", ["empty", "missing", "file"])
def test_folders_that_hold_no_recording_are_refused(layout: str, kind: str, tmp_path: Path) -> None:
    if kind == "empty":
        (tmp_path / "x").mkdir()
    elif kind == "file":
        (tmp_path / "x").write_text("")
    with pytest.raises(BagError, match="x"):
        open_dataset(layout, tmp_path / "x")


@pytest.mark.parametrize(
    ("layout", "make", "name", "content", "complaint"),
    [
        ("7scenes", seven_scenes, "camera-intrinsics.txt", "7 0 3.5", "holds 3 numbers; expected a matrix"),
        ("7scenes", seven_scenes, "camera-intrinsics.txt", "0 0 0 0 0 0 0 0 1", "intrinsics cannot be used"),
        ("7scenes", seven_scenes, "camera-intrinsics.txt", None, r"images are 8x6 .*give intrinsics"),
        ("tum", tum, "depth.txt", "", r"depth\.txt lists no images"),
        ("tum", tum, "depth.txt", "1.0\n", r"depth\.txt, line 1: 1 columns"),
        ("tum", tum, "depth.txt", "one a.png\n", r"depth\.txt: 'one' is no stamp"),
        ("kitti", partial(kitti, frames=1), "velodyne/000000.bin", None, r"velodyne holds no files NNNNNN\.bin"),
        ("kitti", kitti, "calib.txt", f"Tr: {KITTI_TR}", "no row P2 of 12 numbers"),
        ("kitti", kitti, "calib.txt", f"P2: {'0 ' * 12}\nTr: {KITTI_TR}", "P2 is no projection"),
        ("kitti", kitti, "calib.txt", f"{P2}\nTr: {'2 ' * 12}", "Tr is no rigid transform"),
        ("kitti", kitti, "calib.txt", f"{P2}\nTr: {'nan ' * 12}", "no row Tr of 12 numbers"),
        ("kitti", kitti, "times.txt", "0.0\n", "files up to number 2, but there are 1 stamps"),
        ("kitti", kitti, "times.txt", "0.0\nsoon\n1\n", "'soon' is no stamp"),
        ("kitti", kitti, "poses.txt", "1 2 3", "holds 3 numbers; expected 12 for each pose"),
        ("kitti-raw", kitti_raw, PACKET, "95 0 5 0 0 0", "oxts packet has no position"),
        ("kitti-raw", kitti_raw, PACKET, "50 0 5", "oxts packet has no position"),
        ("kitti-raw", kitti_raw, "image_02/timestamps.txt", "yesterday", "does not match format"),
        ("kitti-raw", kitti_raw, "../calib_cam_to_cam.txt", None, r"neither in .*; unpack the drive's calibration"),
        ("kitti-raw", kitti_raw, "../calib_velo_to_cam.txt", None, r"neither in .*; unpack the drive's calibration"),
        ("kitti-raw", kitti_raw, "../calib_velo_to_cam.txt", f"R: {'2 ' * 9}\nT: 0 0 0", "is no rigid transform"),
        ("kitti-raw", kitti_raw, "image_02/data/0000000000.png", (10, 8), "images of 10x8 are not the rectified ones"),
    ],
)
def test_what_is_broken_is_named(layout: str, make, name: str, content, complaint: str, tmp_path: Path) -> None:
    folder = make(tmp_path / "folder")
    if content is None:
        (folder / name).unlink()
    elif isinstance(content, str):
        (folder / name).write_text(content)
    else:
        save_image(folder / name, 0, size=content)
    with pytest.raises(BagError, match=complaint):
        open_dataset(layout, folder)
