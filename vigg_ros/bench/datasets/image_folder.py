# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plain folders of colour and depth images with a poses file, as people export them by themselves.

Colour and depth lie in folders of their own (``color``, ``rgb``, ``images`` and ``depth``), or together
with ``color``, ``rgb`` or ``image`` and ``depth`` in their names. The last number in a name says which
belong together: a frame number, a stamp in seconds with decimals, or one of 16 to 19 digits in nanoseconds.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from decimal import Decimal
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.trajectories import DatasetPose, parse_stamp_ns, read_tum_poses
from vigg_ros.bench.datasets.dataset import Dataset, DatasetFile, image_size
from vigg_ros.bench.datasets.intrinsics import Intrinsics, find_intrinsics, make_camera
from vigg_ros.bench.datasets.number_files import START_NS, stamp_of_number
from vigg_ros.registration import BagError

RATE_HZ = 30.0
DEPTH_SCALE = 1000.0
"""Depth values a metre."""

POSE_FILES = ("poses.txt", "trajectory.txt", "groundtruth.txt", "trajectory.tum", "poses.tum")

PoseRow = tuple[str, "NDArray[np.float64] | None"]
"""The first column as written, and the pose (4, 4)."""

_NUMBER = re.compile(r"(\d+(?:\.\d+)?)(?!.*\d)")
_IMAGE = re.compile(r"\.(png|jpe?g)$", re.IGNORECASE)
_DEPTH_WORD = re.compile(r"depth|dep_", re.IGNORECASE)
_COLOUR_WORD = re.compile(r"colou?r|rgb|image|img", re.IGNORECASE)


def open_image_folder(
    folder: Path, *, intrinsics: Intrinsics | None = None, depth_scale: float = DEPTH_SCALE, rate_hz: float = RATE_HZ
) -> Dataset:
    """The recording in this folder; the rate gives stamps to files that are only numbered.

    Poses are in the TUM format, by stamp or by frame number. Raises BagError when there are no images,
    no intrinsics, or poses that match no image.
    """
    colours, depths = _find_images(folder)
    if not colours or not depths:
        raise BagError(
            f"{folder} holds {len(colours)} colour and {len(depths)} depth images; expected folders color "
            "and depth, or both words in the names, with a number at the end"
        )
    intrinsics = intrinsics or find_intrinsics(folder)
    if intrinsics is None:
        raise BagError(f"{folder} has no camera-intrinsics.txt; write one (3x3), or give fx fy cx cy")
    rows = _read_poses(folder)
    numbers = sorted({*colours, *depths}, key=Decimal)
    pose_stamps = _pose_stamps(numbers, rows, rate_hz)
    stamps = _image_stamps(numbers, pose_stamps, rows, rate_hz)
    poses = (DatasetPose(ns, T) for ns, (_, T) in zip(pose_stamps, rows, strict=True) if T is not None)
    return Dataset(
        name=folder.name,
        camera=make_camera(image_size(next(iter(depths.values()))), intrinsics),
        images=_files(colours, stamps),
        depths=_files(depths, stamps),
        poses=tuple(sorted(poses, key=lambda pose: pose.stamp_ns)),
        depth_unit_m=1 / depth_scale,
        notes=() if rows else (f"none of {', '.join(POSE_FILES)}: the recording has no poses",),
    )


def _find_images(folder: Path) -> tuple[dict[str, Path], dict[str, Path]]:
    """Colour and depth images by the number in their names."""
    if not folder.is_dir():
        raise BagError(f"{folder} is no folder; expected one with colour and depth images")
    paths = [path for path in (*folder.glob("*"), *folder.glob("*/*")) if _IMAGE.search(path.name)]
    # What tells colour from depth is the subfolder's name, else the file's own.
    names = {path: path.name if path.parent == folder else path.parent.name for path in paths}
    depths = [path for path in paths if _DEPTH_WORD.search(names[path])]
    colours = [path for path in paths if _COLOUR_WORD.search(names[path]) and not _DEPTH_WORD.search(names[path])]
    return _by_number(colours), _by_number(depths)


def _by_number(paths: Iterable[Path]) -> dict[str, Path]:
    found: dict[str, Path] = {}
    for path in sorted(paths):
        match = _NUMBER.search(path.stem)
        if match is None:
            raise BagError(f"{path} has no number in its name; expected a frame number or a stamp")
        number = str(int(match[1])) if _is_frame_number(match[1]) else match[1]
        if number in found:
            raise BagError(f"{path} and {found[number].name} have the same number; keep one of them")
        found[number] = path
    return found


def _files(paths: Mapping[str, Path], stamps: Mapping[str, int]) -> tuple[DatasetFile, ...]:
    ordered = sorted(paths, key=Decimal)
    return tuple(
        DatasetFile(int(number) if _is_frame_number(number) else place, stamps[number], paths[number])
        for place, number in enumerate(ordered)
    )


def _read_poses(folder: Path) -> list[PoseRow]:
    path = next((folder / name for name in POSE_FILES if (folder / name).is_file()), None)
    return [] if path is None else read_tum_poses(path)


def _pose_stamps(numbers: Sequence[str], rows: Sequence[PoseRow], rate_hz: float) -> list[int]:
    """The stamp of each pose: by its number if the images are numbered too, else as written."""
    if _is_by_number(numbers, rows):
        return [stamp_of_number(int(Decimal(text)), rate_hz) for text, _ in rows]
    stamps = [_written_stamp(text) for text, _ in rows]
    shift = START_NS if stamps and min(stamps) == 0 else 0
    return [stamp_ns + shift for stamp_ns in stamps]


def _image_stamps(
    numbers: Sequence[str], pose_stamps: Sequence[int], rows: Sequence[PoseRow], rate_hz: float
) -> dict[str, int]:
    """The stamp of each image number: its own, else that of the pose in the same place, else by the rate."""
    if not all(map(_is_frame_number, numbers)):
        return {number: _written_stamp(number) for number in numbers}
    if not rows or _is_by_number(numbers, rows):
        return {number: stamp_of_number(int(number), rate_hz) for number in numbers}
    if len(rows) != len(numbers):
        raise BagError(
            f"the images are numbered, and the poses have {len(rows)} stamps for {len(numbers)} numbers; "
            "name the images by stamps, or put frame numbers in the first column of the poses"
        )
    return dict(zip(numbers, pose_stamps, strict=True))


def _is_by_number(numbers: Sequence[str], rows: Sequence[PoseRow]) -> bool:
    """Whether images and poses are both numbered."""
    whole = (re.fullmatch(r"\d{1,15}(\.0*)?", text) is not None for text, _ in rows)
    return all(map(_is_frame_number, numbers)) and all(whole)


def _is_frame_number(number: str) -> bool:
    return "." not in number and len(number) < 16


def _written_stamp(text: str) -> int:
    """A stamp in seconds, or in nanoseconds if it has 16 digits or more and no decimals."""
    try:
        return parse_stamp_ns(f"{text}e-9" if re.fullmatch(r"\d{16,}", text) else text)
    except ValueError as error:
        raise BagError(f"the number of an image or pose is no stamp: {error}") from error
