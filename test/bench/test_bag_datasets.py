# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Frames of data sets: associated by stamp, loaded when asked for, refused by name."""

from __future__ import annotations

from pathlib import Path

import pytest

from vigg_ros.bench.datasets.convert import open_dataset
from vigg_ros.bench.datasets.dataset import mutual_nearest, nearest
from vigg_ros.registration import BagError
from vigg_ros_testing.dataset_samples import save_depth, save_image, seven_scenes


@pytest.mark.parametrize("layout", ["7scenes", "tum", "images", "kitti", "kitti-raw"])
@pytest.mark.parametrize("kind", ["empty", "missing", "file"])
def test_folders_that_hold_no_recording_are_refused(layout: str, kind: str, tmp_path: Path) -> None:
    if kind == "empty":
        (tmp_path / "x").mkdir()
    elif kind == "file":
        (tmp_path / "x").write_text("")
    with pytest.raises(BagError, match="x"):
        open_dataset(layout, tmp_path / "x")


@pytest.mark.parametrize("broken", ["frame-000001.color.png", "frame-000001.depth.png"])
def test_a_broken_image_is_named_when_it_is_asked_for(broken: str, tmp_path: Path) -> None:
    folder = seven_scenes(tmp_path)
    (folder / broken).write_bytes(b"no image")
    frame = open_dataset("7scenes", folder).frames()[1]
    with pytest.raises(BagError, match=rf"{broken} is no readable image"):
        frame.image() if "color" in broken else frame.depth_m()


def test_images_of_another_shape_are_refused(tmp_path: Path) -> None:
    folder = seven_scenes(tmp_path)
    save_image(folder / "frame-000001.color.png", 1, size=(8, 8))
    save_depth(folder / "frame-000001.depth.png", 1, size=(16, 12))
    frame = open_dataset("7scenes", folder).frames()[1]
    with pytest.raises(BagError, match="is 8x8, the calibration is for 8x6"):
        frame.image()
    with pytest.raises(BagError, match=r"expected 16-bit depth of shape \(6, 8\)"):
        frame.depth_m()


def test_colour_is_no_depth(tmp_path: Path) -> None:
    folder = seven_scenes(tmp_path)
    save_image(folder / "frame-000001.depth.png", 1)
    with pytest.raises(BagError, match="expected 16-bit depth"):
        open_dataset("7scenes", folder).frames()[1].depth_m()


def test_an_rgbd_frame_has_no_scan(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="frame 0 has no scan"):
        open_dataset("7scenes", seven_scenes(tmp_path)).frames()[0].points()


def test_nothing_is_loaded_before_it_is_asked_for(tmp_path: Path) -> None:
    folder = seven_scenes(tmp_path)
    for path in folder.glob("*.color.png"):
        path.write_bytes(b"")
    assert len(open_dataset("7scenes", folder).frames()) == 4


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


def test_two_never_share_a_partner() -> None:
    assert mutual_nearest([10, 12], [11, 30], 5) == [(0, 0)]
    assert mutual_nearest([10, 13], [12], 5) == [(1, 0)]
