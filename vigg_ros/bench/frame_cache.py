# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Frames to be registered, and what was made of them; loaded when asked for, and kept while they are needed."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.datasets.dataset import DatasetFrame
from vigg_ros.registration import Config, Features, Frame, extract
from vigg_ros.registration.geometry import ProjectedScan
from vigg_ros.registration.rigid import inverse
from vigg_ros.registration.stages import record_stages

_T = TypeVar("_T")

MAX_KEPT = 160
"""Frames and what was made of them, kept at once: about half a gigabyte."""


class Look(Protocol):
    """A frame that can be loaded. It travels between processes, so it holds paths or numbers rather than images."""

    @property
    def name(self) -> str:
        """Tells it from the others of its recording."""

    def load(self) -> Frame:
        """The frame. Raises DataError or BagError where it cannot be used."""


@dataclass(frozen=True, slots=True)
class DatasetLook:
    """A frame of a data set folder."""

    frame: DatasetFrame
    T_lidar_camera: NDArray[np.float64] | None
    """(4, 4) where there are scans."""

    @property
    def name(self) -> str:
        """Its number."""
        return str(self.frame.number)

    def load(self) -> Frame:
        """Reads the files. Raises DataError or BagError where they cannot be used."""
        frame = self.frame
        if frame.points_path is None:
            return Frame.from_depth(frame.image(), frame.depth_m(), frame.camera, stamp_ns=frame.stamp_ns)
        assert self.T_lidar_camera is not None, "data sets with scans have extrinsics"
        T_camera_lidar = inverse(self.T_lidar_camera)
        return Frame.from_points(frame.image(), frame.points(), frame.camera, T_camera_lidar, stamp_ns=frame.stamp_ns)


@dataclass(frozen=True, slots=True)
class HeldLook:
    """A frame that is in memory already."""

    name: str
    frame: Frame

    def load(self) -> Frame:
        """The frame as it is held."""
        return self.frame


def clip_to_view(frame: Frame) -> Frame:
    """Only the points that the camera sees: the paper's unified field of view. Depth images are that already."""
    if not isinstance(frame.geometry, ProjectedScan):
        return frame
    rows, _ = frame.geometry.visible()
    return frame.with_points(frame.geometry.cloud[rows])


class Workshop:
    """Frames and what methods make of single frames, kept for the next pair and the next method.

    What is made comes with the time it took, so that a method is charged for it whoever asked first.
    """

    def __init__(self, *, within_view: bool = False) -> None:
        self._within_view = within_view
        self._kept: OrderedDict[Hashable, Any] = OrderedDict()

    def frame(self, look: Look, *, within_view: bool = False) -> Frame:
        """The frame; ``within_view`` drops what its camera does not see."""
        frame: Frame = self._keep(("frame", look.name), look.load)
        return clip_to_view(frame) if within_view or self._within_view else frame

    def features(self, look: Look, config: Config, *, within_view: bool = False) -> tuple[Features, float]:
        """Features by the configuration, and the milliseconds they took on the clock."""

        def make() -> tuple[Features, float]:
            frame = self.frame(look, within_view=within_view)
            return timed(lambda: _extract_all(frame, config))

        if not config.geometric.always:
            return make()  # what is made only in doubt is charged to the pair that it is made for
        return self._keep(("features", look.name, config.visual, config.geometric, within_view), make)

    def made(self, look: Look, key: Hashable, make: Callable[[Frame], _T]) -> tuple[_T, float]:
        """Anything else that is made of a frame, and the milliseconds it took; ``key`` names it."""
        return self._keep(("made", look.name, key), lambda: timed(partial(make, self.frame(look))))

    def _keep(self, key: Hashable, make: Callable[[], _T]) -> _T:
        if key not in self._kept:
            self._kept[key] = make()
            if len(self._kept) > MAX_KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        kept: _T = self._kept[key]
        return kept


def _extract_all(frame: Frame, config: Config) -> Features:
    """The features, with all that the whole method makes of them later."""
    features = extract(frame, config)
    if config.geometric.always:
        _ = features.fine_keypoints, features.landmarks
    return features


def timed_stages(work: Callable[[], _T]) -> tuple[_T, dict[str, float]]:
    """What the work gives, and its milliseconds by stage; with what is in no stage they add up to the clock's."""
    with record_stages() as timings_ms:
        done, total_ms = timed(work)
    return done, {**timings_ms, "other": max(total_ms - sum(timings_ms.values()), 0.0)}


def timed(work: Callable[[], _T]) -> tuple[_T, float]:
    """What the work gives, and the milliseconds it took."""
    start = time.perf_counter()
    done = work()
    return done, 1e3 * (time.perf_counter() - start)
