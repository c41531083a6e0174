# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the intrinsics of a data set's camera come from: options, a file of the folder, or convention."""

from __future__ import annotations

from pathlib import Path

from vigg_ros.bench.datasets.number_files import read_numbers
from vigg_ros.registration import BagError, Camera, DataError

Intrinsics = tuple[float, float, float, float]
"""fx, fy, cx, cy in pixels."""

INTRINSICS_FILES = (
    "camera-intrinsics.txt",
    "camera_intrinsics.txt",
    "intrinsics.txt",
    "intrinsic/intrinsic_depth.txt",
    "intrinsic_depth.txt",
    "kinect_params.txt",
)


def find_intrinsics(*folders: Path) -> Intrinsics | None:
    """The intrinsics of the first such file in the folders."""
    paths = (folder / name for folder in folders for name in INTRINSICS_FILES)
    return next((read_intrinsics(path) for path in paths if path.is_file()), None)


def read_intrinsics(path: Path) -> Intrinsics:
    """From a file of a matrix 3x3 or 4x4, or of ``fx fy cx cy``. Raises BagError if it is none of these."""
    numbers = read_numbers(path)
    width = {9: 3, 16: 4}.get(numbers.size)
    if width is not None:
        K = numbers.reshape(width, width)
        return float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2])
    if numbers.size == 4:
        fx_px, fy_px, cx_px, cy_px = numbers.tolist()
        return fx_px, fy_px, cx_px, cy_px
    raise BagError(f"{path} holds {numbers.size} numbers; expected a matrix 3x3 or 4x4, or fx fy cx cy")


def make_camera(size_px: tuple[int, int], intrinsics: Intrinsics) -> Camera:
    """The camera of images of this width and height. Raises BagError for impossible intrinsics."""
    try:
        return Camera(*size_px, *intrinsics)
    except DataError as error:
        raise BagError(f"the intrinsics cannot be used: {error}") from error
