# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stamps and poses in text files: TUM trajectories, and data sets like them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import BagError, DataError
from vigg_ros.registration.rigid import rigid_from_quaternion


@dataclass(frozen=True, slots=True)
class DatasetPose:
    """The pose (4, 4) of the sensor, metres, at a stamp: p_world = T_world_sensor @ p_sensor."""

    stamp_ns: int
    T_world_sensor: NDArray[np.float64]


def parse_stamp_ns(text: str) -> int:
    """Nanoseconds of decimal seconds ("1305031102.175304", "1.04e-01"), exact: no float in between.

    Raises ValueError when it is no number of seconds that ROS can hold.
    """
    try:
        seconds = Decimal(text)
        in_range = 0 <= seconds < 2**31
    except ArithmeticError as error:  # what is no number, and comparisons with NaN
        raise ValueError(f"{text[:40]!r} is no stamp in seconds") from error
    if not in_range:
        raise ValueError(f"{text[:40]!r} is outside the seconds that ROS can hold")
    return int(seconds.scaleb(9).to_integral_value())


def rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Line number and words of each line that is not empty or a comment; commas count as spaces.

    Raises BagError when the file is missing or no text.
    """
    try:
        text = path.read_bytes().decode()
    except (OSError, UnicodeDecodeError) as error:
        cause = error.strerror if isinstance(error, OSError) else error
        raise BagError(f"{path} cannot be read: {cause}") from error
    for number, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].replace(",", " ").split()
        if words:
            yield number, words


def read_tum_poses(path: Path) -> list[tuple[str, NDArray[np.float64] | None]]:
    """Rows ``stamp tx ty tz qx qy qz qw`` as (stamp as written, pose (4, 4) or None if it is no pose).

    Raises BagError when a row has other columns.
    """
    found: list[tuple[str, NDArray[np.float64] | None]] = []
    for line, words in rows(path):
        if len(words) != 8:
            raise BagError(f"{path}, line {line}: {len(words)} columns; expected stamp tx ty tz qx qy qz qw")
        values = [number_in(path, line, word) for word in words[1:]]
        found.append((words[0], _pose_of_quaternion(values)))
    return found


def read_stamped_poses(path: Path) -> tuple[DatasetPose, ...]:
    """The poses of a TUM trajectory file by stamp; rows that are no pose are left out. Raises BagError."""
    poses = [DatasetPose(stamp_in(path, stamp), T) for stamp, T in read_tum_poses(path) if T is not None]
    return tuple(sorted(poses, key=lambda pose: pose.stamp_ns))


def stamp_in(path: Path, text: str) -> int:
    """A stamp in seconds as the file has it, in ns. Raises BagError when it is none."""
    try:
        return parse_stamp_ns(text)
    except ValueError as error:
        raise BagError(f"{path}: {error}") from error


def _pose_of_quaternion(values: list[float]) -> NDArray[np.float64] | None:
    try:
        return rigid_from_quaternion(values[:3], values[3:])
    except DataError:
        return None


def number_in(path: Path, line: int, word: str) -> float:
    """A word of a line as a number. Raises BagError when it is none."""
    try:
        return float(word)
    except ValueError as error:
        raise BagError(f"{path}, line {line}: {word[:40]!r} is no number") from error
