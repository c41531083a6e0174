# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plain folders of images: numbers, stamps and poses that must fit together."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vigg_ros.bench.datasets.convert import open_dataset
from vigg_ros.registration import BagError
from vigg_ros_testing.dataset_samples import QUARTER_TURN, save_depth, save_image, save_intrinsics, stamps_after_start


def plain_folder(folder: Path, names: list[str], poses: str = "", flat: bool = False) -> Path:
    for k, name in enumerate(names):
        save_image(folder / (f"color_{name}.png" if flat else f"color/{name}.png"), k)
        save_depth(folder / (f"depth_{name}.png" if flat else f"depth/{name}.png"), 1000 + k)
    save_intrinsics(folder / "camera-intrinsics.txt")
    if poses:
        (folder / "poses.txt").write_text(poses)
    return folder


def tum_row(stamp: str, x: int) -> str:
    return f"{stamp} {x} 0 0 {QUARTER_TURN}\n"


@pytest.mark.parametrize("flat", [False, True])
def test_numbered_images_with_numbered_poses(flat: bool, tmp_path: Path) -> None:
    poses = tum_row("4", 4) + tum_row("0003", 3)
    dataset = open_dataset("images", plain_folder(tmp_path, ["0003", "0004", "0010"], poses, flat=flat))
    frames = dataset.frames()
    assert [frame.number for frame in frames] == [3, 4, 10]
    assert stamps_after_start(dataset) == [100_000_000, 133_333_333, 333_333_333]
    assert [None if f.T_world_sensor is None else f.T_world_sensor[0, 3] for f in frames] == [3, 4, None]


@pytest.mark.parametrize(
    ("stamps", "stamps_ns"),
    [
        (("1305031102.5", "1305031102.75"), [1305031102_500000000, 1305031102_750000000]),
        (("0.0", "0.1"), [1_000_000_000, 1_100_000_000]),  # what begins at 0 begins a second later
    ],
)
def test_numbered_images_take_the_stamps_of_as_many_poses(stamps, stamps_ns, tmp_path: Path) -> None:
    dataset = open_dataset("images", plain_folder(tmp_path, ["0", "1"], "".join(map(tum_row, stamps, (0, 1)))))
    assert [frame.stamp_ns for frame in dataset.frames()] == stamps_ns
    assert [frame.T_world_sensor[0, 3] for frame in dataset.frames()] == [0, 1]


@pytest.mark.parametrize("name", ["1305031102.175304", "1305031102175304000"])
def test_images_named_by_stamps_keep_them(name: str, tmp_path: Path) -> None:
    dataset = open_dataset("images", plain_folder(tmp_path, [name], tum_row("1305031102.180", 7)))
    (frame,) = dataset.frames()
    assert frame.stamp_ns == 1305031102_175304000
    assert frame.T_world_sensor[0, 3] == 7


def test_a_rate_and_a_scale_may_be_given(tmp_path: Path) -> None:
    dataset = open_dataset("images", plain_folder(tmp_path, ["0", "1"]), rate_hz=10.0, depth_scale=500.0)
    assert stamps_after_start(dataset) == [0, 100_000_000]
    np.testing.assert_allclose(dataset.frames()[0].depth_m()[1:], 2.0, rtol=1e-6)
    assert "the recording has no poses" in dataset.notes[0]


@pytest.mark.parametrize(
    ("names", "missing", "complaint"),
    [
        (["a"], None, "has no number in its name"),
        (["1", "01"], None, "have the same number"),
        (["1"], "depth/1.png", "1 colour and 0 depth images"),
        (["1"], "camera-intrinsics.txt", r"no camera-intrinsics\.txt; write one \(3x3\)"),
        (["0", "1"], None, r"1 stamps for 2 numbers; name the images by stamps"),
    ],
)
def test_plain_folders_that_are_not_clear_are_refused(names, missing, complaint, tmp_path: Path) -> None:
    folder = plain_folder(tmp_path, names, tum_row("5.5", 0))
    if missing:
        (folder / missing).unlink()
    with pytest.raises(BagError, match=complaint):
        open_dataset("images", folder)
