# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The layout of the TUM RGB-D benchmark: rgb.txt, depth.txt and groundtruth.txt with stamps of their own.

Format: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats
"""

from __future__ import annotations

from pathlib import Path

from vigg_ros.bags.trajectories import read_stamped_poses, rows, stamp_in
from vigg_ros.bench.datasets.dataset import Dataset, DatasetFile, image_size
from vigg_ros.bench.datasets.intrinsics import Intrinsics, find_intrinsics, make_camera
from vigg_ros.registration import BagError

DEPTH_SCALE = 5000.0
"""Depth values a metre."""

DEFAULT_INTRINSICS: Intrinsics = (525.0, 525.0, 319.5, 239.5)
"""The calibration by which the benchmark aligned its depth images, and which it recommends."""


def open_tum(folder: Path, *, intrinsics: Intrinsics | None = None, depth_scale: float = DEPTH_SCALE) -> Dataset:
    """The recording in this folder; nothing is associated, each file keeps its stamp.

    Raises BagError when a list is missing or broken.
    """
    images, depths = _read_list(folder / "rgb.txt"), _read_list(folder / "depth.txt")
    truth = folder / "groundtruth.txt"
    notes = [] if truth.is_file() else ["no groundtruth.txt: the recording has no poses"]
    intrinsics = intrinsics or find_intrinsics(folder)
    if intrinsics is None:
        notes.append("no intrinsics file: taken as 525 525 319.5 239.5 px, as the benchmark recommends")
    notes.append("no lens distortion is known here: images are taken as free of it")
    return Dataset(
        name=folder.name,
        camera=make_camera(image_size(depths[0].path), intrinsics or DEFAULT_INTRINSICS),
        images=images,
        depths=depths,
        poses=read_stamped_poses(truth) if truth.is_file() else (),
        depth_unit_m=1 / depth_scale,
        notes=tuple(notes),
    )


def _read_list(path: Path) -> tuple[DatasetFile, ...]:
    """Rows ``stamp file``; the number of a file is its place in the list."""
    found = []
    for line, words in rows(path):
        if len(words) != 2:
            raise BagError(f"{path}, line {line}: {len(words)} columns; expected a stamp and a file name")
        found.append((stamp_in(path, words[0]), path.parent / words[1]))
    if not found:
        raise BagError(f"{path} lists no images")
    return tuple(DatasetFile(number, *row) for number, row in enumerate(sorted(found)))
