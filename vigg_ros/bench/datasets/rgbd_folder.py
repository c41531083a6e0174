# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""RGB-D folders with numbered files and one pose file a frame: 7-Scenes, 3DMatch, exports of ScanNet.

Two spellings: ``frame-000123.color.png``, ``.depth.png``, ``.pose.txt`` in one folder (7-Scenes, 3DMatch),
and ``color/123.jpg``, ``depth/123.png``, ``pose/123.txt`` (ScanNet's SensReader). Depth is 16-bit
millimetres; poses are camera-to-world; the numbers count at 30 Hz.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from vigg_ros.bags.trajectories import DatasetPose
from vigg_ros.bench.datasets.dataset import Dataset, DatasetFile, image_size
from vigg_ros.bench.datasets.intrinsics import Intrinsics, find_intrinsics, make_camera
from vigg_ros.bench.datasets.number_files import read_matrix_pose, stamp_of_number
from vigg_ros.registration import BagError

RATE_HZ = 30.0

KINECT_INTRINSICS: Intrinsics = (585.0, 585.0, 320.0, 240.0)
"""What 7-Scenes, which ships no intrinsics, names for its depth camera (640x480)."""

_FLAT = {
    "colour": re.compile(r"frame-(\d+)\.(?:color|rgb)\.(?:png|jpe?g)$"),
    "depth": re.compile(r"frame-(\d+)\.depth\.png$"),
    "pose": re.compile(r"frame-(\d+)\.pose\.txt$"),
}
_NESTED = {
    "colour": re.compile(r"(?:color|rgb)/(?:frame-)?(\d+)\.(?:png|jpe?g)$"),
    "depth": re.compile(r"depth/(?:frame-)?(\d+)\.png$"),
    "pose": re.compile(r"poses?/(?:frame-)?(\d+)\.txt$"),
}


def open_rgbd_folder(folder: Path, *, intrinsics: Intrinsics | None = None) -> Dataset:
    """The recording in this folder, in its only ``seq-..`` folder, or in the folders beside ``color``.

    Raises BagError when there are no frames, or several sequences.
    """
    sequence = _sequence_folder(folder)
    colours, depths, poses = (_numbered(sequence, kind) for kind in ("colour", "depth", "pose"))
    if not colours or not depths:
        raise BagError(
            f"{folder} holds {len(colours)} colour and {len(depths)} depth images; expected "
            "frame-NNNNNN.color.png and .depth.png, or color/N.jpg and depth/N.png"
        )
    size = image_size(next(iter(depths.values())))
    found, note = _intrinsics(sequence, folder, intrinsics, size)
    return Dataset(
        name=sequence.name,
        camera=make_camera(size, found),
        images=_files(colours),
        depths=_files(depths),
        poses=_poses(poses),
        notes=(note,) if note else (),
    )


def _sequence_folder(folder: Path) -> Path:
    if not folder.is_dir():
        raise BagError(f"{folder} is no folder; expected one with the files of a recording")
    if _numbered(folder, "colour"):
        return folder
    sequences = [path for path in sorted(folder.iterdir()) if path.is_dir() and _numbered(path, "colour")]
    if len(sequences) > 1:
        names = ", ".join(path.name for path in sequences)
        raise BagError(f"{folder} holds several sequences: {names}; give the folder of one of them")
    return sequences[0] if sequences else folder


def _numbered(folder: Path, kind: str) -> dict[int, Path]:
    """Files of a kind by frame number, in order."""
    flat = ((_FLAT[kind].match(path.name), path) for path in folder.glob("frame-*"))
    nested = ((_NESTED[kind].match(f"{path.parent.name}/{path.name}"), path) for path in folder.glob("*/*"))
    for spelling in (flat, nested):
        found = {int(match[1]): path for match, path in spelling if match}
        if found:
            return dict(sorted(found.items()))
    return {}


def _files(paths: Mapping[int, Path]) -> tuple[DatasetFile, ...]:
    return tuple(DatasetFile(number, stamp_of_number(number, RATE_HZ), path) for number, path in paths.items())


def _poses(paths: Mapping[int, Path]) -> tuple[DatasetPose, ...]:
    """ScanNet marks frames that its reconstruction lost with -inf; they have no pose."""
    read = ((stamp_of_number(number, RATE_HZ), read_matrix_pose(path)) for number, path in paths.items())
    return tuple(DatasetPose(stamp_ns, T) for stamp_ns, T in read if T is not None)


def _intrinsics(
    sequence: Path, folder: Path, given: Intrinsics | None, size: tuple[int, int]
) -> tuple[Intrinsics, str]:
    """The intrinsics and a note, if one is due. 3DMatch keeps them beside its sequences."""
    found = given or find_intrinsics(sequence, folder, sequence.parent)
    if found is not None:
        return found, ""
    if size != (640, 480):
        raise BagError(
            f"{folder} has no camera-intrinsics.txt, and its images are {size[0]}x{size[1]} and not the "
            "640x480 of 7-Scenes; give intrinsics fx fy cx cy"
        )
    return KINECT_INTRINSICS, "no intrinsics file: taken as 585 585 320 240 px, as 7-Scenes says"
