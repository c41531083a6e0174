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
from vigg_ros.bench.frame_cache import LoadableFrame
from vigg_ros.registration import BagError
from vigg_ros.registration.rigid import inverse


@dataclass(frozen=True, slots=True)
class PosedFrame:
    """A frame of a recording, its number, and where it was taken if that is known."""

    number: int
    frame: LoadableFrame
    T_world_sensor: NDArray[np.float64] | None


@dataclass(frozen=True, slots=True)
class FramePair:
    """A pair to register and its true motion."""

    group: str
    """What it is reported under: the gap in frames, or the kind of scene."""
    target: LoadableFrame
    source: LoadableFrame
    T_target_source: NDArray[np.float64]
    overlap: float = float("nan")
    """Share of the surface that both see, where it is known."""

    @property
    def name(self) -> str:
        """Tells it from the other pairs of its recording."""
        return f"{self.group}/{self.target.name}/{self.source.name}"


@dataclass(frozen=True, slots=True)
class PairProtocol:
    """Which pairs of a recording are taken."""

    gaps: tuple[int, ...] = (20, 60, 120)
    every: int = 10
    apart_m: float = 0.0
    """Where it is not 0: pairs at least so far apart instead of gaps."""
    refine_truth: bool = False


PAIR_PROTOCOLS = {
    "3dmatch": PairProtocol(),
    "scannet": PairProtocol(),
    # Consecutive pairs at least 10 m apart, their poses refined by GICP: raw ones are off by decimetres.
    "kitti": PairProtocol(gaps=(), apart_m=10.0, refine_truth=True),
}
"""The paper's, by data set."""


def posed_frames(dataset: Dataset) -> list[PosedFrame]:
    """The frames of a data set folder."""
    return [PosedFrame(frame.number, frame, frame.T_world_sensor) for frame in dataset.frames()]


def choose(frames: Sequence[PosedFrame], protocol: PairProtocol) -> Iterator[FramePair]:
    """The pairs of the protocol, where both frames have a pose."""
    if protocol.apart_m > 0:
        return pairs_apart(frames, protocol.apart_m)
    return pairs_at(frames, protocol.gaps, protocol.every)


def pairs_at(frames: Sequence[PosedFrame], gaps: Sequence[int], every: int) -> Iterator[FramePair]:
    """Source frame k, target frame k + gap, for every so manyth k, where both have a pose."""
    by_number = {frame.number: frame for frame in frames}
    first = min(by_number, default=0)
    for gap in gaps:
        for number, source in by_number.items():
            target = by_number.get(number + gap)
            if (number - first) % every == 0 and target is not None:
                pair = _pair(str(gap), target, source)
                if pair is not None:
                    yield pair


def pairs_apart(frames: Sequence[PosedFrame], apart_m: float) -> Iterator[FramePair]:
    """Each pair's target is the first frame at least so far from the source, and the next pair's source."""
    source: PosedFrame | None = None
    for frame in frames:
        if source is None or source.T_world_sensor is None:
            source = frame
            continue
        pair = _pair(f"{apart_m:g} m", frame, source)
        if pair is not None and np.linalg.norm(pair.T_target_source[:3, 3]) >= apart_m:
            yield pair
            source = frame


def pairs_listed(frames: Sequence[PosedFrame], path: Path, gaps: Sequence[int], every: int = 1) -> Iterator[FramePair]:
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
                yield FramePair(str(gap), target.frame, source.frame, row[2:].reshape(4, 4))


def _pair(group: str, target: PosedFrame, source: PosedFrame) -> FramePair | None:
    if source.T_world_sensor is None or target.T_world_sensor is None:
        return None
    T_target_source = inverse(target.T_world_sensor) @ source.T_world_sensor
    return FramePair(group, target.frame, source.frame, T_target_source)
