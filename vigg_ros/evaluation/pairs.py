# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Registration of pairs of a recording, compared with the truth: the protocol of the paper's tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.datasets import Dataset, DatasetFrame
from vigg_ros.evaluation.metrics import rotation_error_deg, translation_error_m
from vigg_ros.registration import Config, Features, Frame, Registration, extract, register
from vigg_ros.registration.errors import BagError, DataError
from vigg_ros.registration.rigid import inverse
from vigg_ros.registration.stages import record_stages


@dataclass(frozen=True, slots=True)
class Limits:
    """From which errors on an answer does not count; the paper's."""

    accuracy_deg: tuple[float, ...]
    accuracy_m: tuple[float, ...]
    recall_deg: float
    recall_m: float


INDOOR = Limits((2.0, 5.0, 10.0), (0.05, 0.10, 0.25), 15.0, 0.30)
OUTDOOR = Limits((0.25, 0.5, 1.0), (0.075, 0.15, 0.30), 5.0, 0.60)


@dataclass(frozen=True, slots=True)
class PairResult:
    """One pair: what was answered, and how far it is from the truth."""

    gap: int
    target: int
    source: int
    reason: str
    """Of the rejection, or the code of a frame that could not be used; empty for an answer."""
    rotation_error_deg: float
    """RE; inf without an answer."""
    translation_error_m: float
    """TE; inf without an answer."""
    timings_ms: dict[str, float]
    """Of the registration, without the extraction of features; empty if a frame could not be used."""

    @property
    def is_answered(self) -> bool:
        """Whether there is a transform."""
        return not self.reason

    def is_right(self, limits: Limits) -> bool:
        """Whether the answer counts for the recall."""
        return self.rotation_error_deg < limits.recall_deg and self.translation_error_m < limits.recall_m


@dataclass(frozen=True, slots=True)
class Wanted:
    """A pair to register and its true motion."""

    gap: int
    target: DatasetFrame
    source: DatasetFrame
    T_target_source: NDArray[np.float64]


def pairs_at(dataset: Dataset, gaps: Sequence[int], every: int) -> Iterator[Wanted]:
    """Source frame k, target frame k + gap, for every so manyth k, where both have a pose."""
    frames = {frame.number: frame for frame in dataset.frames()}
    first = min(frames, default=0)
    for gap in gaps:
        for number, source in frames.items():
            target = frames.get(number + gap)
            if (number - first) % every or target is None:
                continue
            if source.T_world_sensor is not None and target.T_world_sensor is not None:
                yield Wanted(gap, target, source, inverse(target.T_world_sensor) @ source.T_world_sensor)


def pairs_listed(dataset: Dataset, path: Path, gaps: Sequence[int]) -> Iterator[Wanted]:
    """Pairs of a file with rows ``target source`` and T_target_source row by row, 18 numbers. Raises BagError."""
    try:
        rows = np.loadtxt(path, ndmin=2)
    except (OSError, ValueError) as error:
        raise BagError(f"{path} cannot be read as rows of numbers: {error}") from error
    if rows.shape[1] != 18:
        raise BagError(f"{path} has rows of {rows.shape[1]} numbers, expected target, source and 16 of the transform")
    frames = {frame.number: frame for frame in dataset.frames()}
    for gap in gaps:
        for row in rows:
            target, source = int(row[0]), int(row[1])
            if target - source == gap and target in frames and source in frames:
                yield Wanted(gap, frames[target], frames[source], row[2:].reshape(4, 4))


class PairRunner:
    """Registers pairs; features of the last frames are kept, as a tracker keeps those of its keyframes."""

    def __init__(self, dataset: Dataset, config: Config, *, within_view: bool = False) -> None:
        self._dataset = dataset
        self._config = config
        self._within_view = within_view
        self._features: dict[int, Features] = {}

    def run(self, wanted: Wanted) -> PairResult:
        """Register one pair and measure the answer; a frame that cannot be used costs its pairs, not the run."""
        try:
            target, source = self._extract(wanted.target), self._extract(wanted.source)
        except DataError as error:
            return _unanswered(wanted, error.code)
        except BagError:
            return _unanswered(wanted, "UNREADABLE")
        with record_stages() as timings_ms:
            outcome = register(target, source, self._config)
        errors = (float("inf"), float("inf"))
        if isinstance(outcome, Registration):
            T_truth, T_answer = wanted.T_target_source, outcome.T_target_source
            errors = rotation_error_deg(T_truth, T_answer), translation_error_m(T_truth, T_answer)
        reason = "" if isinstance(outcome, Registration) else outcome.reason.value
        return PairResult(wanted.gap, wanted.target.number, wanted.source.number, reason, *errors, timings_ms)

    def _extract(self, frame: DatasetFrame) -> Features:
        if frame.number not in self._features:
            if len(self._features) > 200:
                self._features.clear()
            self._features[frame.number] = extract(self._load(frame), self._config)
        return self._features[frame.number]

    def _load(self, frame: DatasetFrame) -> Frame:
        if frame.points_path is None:
            return Frame.from_depth(frame.image(), frame.depth_m(), frame.camera, stamp_ns=frame.stamp_ns)
        assert self._dataset.T_lidar_camera is not None, "data sets with scans have extrinsics"
        return Frame.from_points(
            frame.image(),
            frame.points(),
            frame.camera,
            inverse(self._dataset.T_lidar_camera),
            stamp_ns=frame.stamp_ns,
            within_view=self._within_view,
        )


def _unanswered(wanted: Wanted, reason: str) -> PairResult:
    """The result of a pair that never came to be registered."""
    infinite = float("inf")
    return PairResult(wanted.gap, wanted.target.number, wanted.source.number, reason, infinite, infinite, {})


def summarise(results: Sequence[PairResult], limits: Limits) -> Mapping[str, object]:
    """Medians over all pairs, failures included; recall, coverage and wrong answers in percent or number."""
    rotation = np.array([result.rotation_error_deg for result in results])
    translation = np.array([result.translation_error_m for result in results])
    answered = sum(result.is_answered for result in results)
    right = sum(result.is_right(limits) for result in results)
    times = [sum(result.timings_ms.values()) for result in results if result.timings_ms]
    return {
        "pairs": len(results),
        "RE deg": f"{np.median(rotation):.3g}",
        "TE cm": f"{100 * np.median(translation):.3g}",
        "RR %": f"{100 * right / len(results):.1f}",
        "answered %": f"{100 * answered / len(results):.1f}",
        "wrong": answered - right,
        "Acc deg": "/".join(f"{100 * np.mean(rotation < limit):.0f}" for limit in limits.accuracy_deg),
        "Acc m": "/".join(f"{100 * np.mean(translation < limit):.0f}" for limit in limits.accuracy_m),
        "ms": f"{np.median(times):.0f}" if times else "-",
        "ms p95": f"{np.percentile(times, 95):.0f}" if times else "-",
    }
