# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which pairs of frames to register, and their true motions: the protocols of the paper's tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.datasets.dataset import Dataset
from vigg_ros.bench.frame_cache import DatasetLook, Look
from vigg_ros.registration.errors import BagError
from vigg_ros.registration.rigid import inverse


@dataclass(frozen=True, slots=True)
class Posed:
    """A frame of a recording, its number, and where it was taken if that is known."""

    number: int
    look: Look
    T_world_sensor: NDArray[np.float64] | None


@dataclass(frozen=True, slots=True)
class Wanted:
    """A pair to register and its true motion."""

    group: str
    """What it is reported under: the gap in frames, or the kind of place."""
    target: Look
    source: Look
    T_target_source: NDArray[np.float64]
    overlap: float = float("nan")
    """Share of the surface that both see, where it is known."""

    @property
    def name(self) -> str:
        """Tells it from the other pairs of its recording."""
        return f"{self.group}/{self.target.name}/{self.source.name}"


@dataclass(frozen=True, slots=True)
class Protocol:
    """Which pairs of a recording are taken."""

    gaps: tuple[int, ...] = (20, 60, 120)
    every: int = 10
    apart_m: float = 0.0
    """Where it is not 0: pairs at least so far apart instead of gaps."""
    refine_truth: bool = False


PROTOCOLS = {
    "3dmatch": Protocol(),
    "scannet": Protocol(),
    # Consecutive pairs at least 10 m apart, their poses refined by GICP: raw ones are off by decimetres.
    "kitti": Protocol(gaps=(), apart_m=10.0, refine_truth=True),
}
"""The paper's, by data set."""


def posed_frames(dataset: Dataset) -> list[Posed]:
    """The frames of a data set folder."""
    frames = dataset.frames()
    return [Posed(f.number, DatasetLook(f, dataset.T_lidar_camera), f.T_world_sensor) for f in frames]


def choose(frames: Sequence[Posed], protocol: Protocol) -> Iterator[Wanted]:
    """The pairs of the protocol, where both frames have a pose."""
    if protocol.apart_m > 0:
        yield from pairs_apart(frames, protocol.apart_m)
    else:
        yield from pairs_at(frames, protocol.gaps, protocol.every)


def pairs_at(frames: Sequence[Posed], gaps: Sequence[int], every: int) -> Iterator[Wanted]:
    """Source frame k, target frame k + gap, for every so manyth k, where both have a pose."""
    by_number = {frame.number: frame for frame in frames}
    first = min(by_number, default=0)
    for gap in gaps:
        for number, source in by_number.items():
            target = by_number.get(number + gap)
            if (number - first) % every == 0 and target is not None:
                yield from _wanted(str(gap), target, source)


def pairs_apart(frames: Sequence[Posed], apart_m: float) -> Iterator[Wanted]:
    """Each pair's target is the first frame at least so far from the source, and the next pair's source."""
    known = [frame for frame in frames if frame.T_world_sensor is not None]
    source = known[0] if known else None
    for frame in known:
        assert source is not None, "there is a first one"
        assert source.T_world_sensor is not None, "only known poses are walked through"
        assert frame.T_world_sensor is not None, "only known poses are walked through"
        if np.linalg.norm(frame.T_world_sensor[:3, 3] - source.T_world_sensor[:3, 3]) >= apart_m:
            yield from _wanted(f"{apart_m:g} m", frame, source)
            source = frame


def pairs_listed(frames: Sequence[Posed], path: Path, gaps: Sequence[int], every: int = 1) -> Iterator[Wanted]:
    """Pairs of a file with rows ``target source`` and T_target_source row by row, 18 numbers. Raises BagError."""
    try:
        rows = np.loadtxt(path, ndmin=2)
    except (OSError, ValueError) as error:
        raise BagError(f"{path} cannot be read as rows of numbers: {error}") from error
    if rows.shape[1] != 18:
        raise BagError(f"{path} has rows of {rows.shape[1]} numbers, expected target, source and 16 of the transform")
    by_number = {frame.number: frame for frame in frames}
    first = min(by_number, default=0)
    for gap in gaps:
        for row in rows:
            target, source = by_number.get(int(row[0])), by_number.get(int(row[1]))
            if target is None or source is None or (source.number - first) % every:
                continue
            if target.number - source.number == gap:
                yield Wanted(str(gap), target.look, source.look, row[2:].reshape(4, 4))


def _wanted(group: str, target: Posed, source: Posed) -> Iterator[Wanted]:
    if source.T_world_sensor is not None and target.T_world_sensor is not None:
        T_target_source = inverse(target.T_world_sensor) @ source.T_world_sensor
        yield Wanted(group, target.look, source.look, T_target_source)
