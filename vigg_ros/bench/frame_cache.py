# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Frames to be registered and what was derived from them, kept for the next pair and the next method."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, TypeVar

from vigg_ros.registration import Config, Features, Frame, extract
from vigg_ros.registration.geometry import ProjectedScan
from vigg_ros.registration.stages import record_stages

_T = TypeVar("_T")

MAX_ENTRIES = 160
"""Frames and what was derived from them, kept at once: about half a gigabyte."""


class LoadableFrame(Protocol):
    """A frame that can be loaded. It travels between processes, so it holds paths or numbers rather than images."""

    @property
    def name(self) -> str:
        """Tells it from the others of its recording."""

    def load(self) -> Frame:
        """The frame. Raises DataError or BagError where it cannot be used."""


@dataclass(frozen=True, slots=True)
class LoadedFrame:
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


class FrameCache:
    """Frames and what methods derive from single ones; the least recently used go first.

    What is derived comes with the time it took, so that a method is charged for it whoever asked first.
    """

    def __init__(self, *, within_view: bool = False) -> None:
        self._within_view = within_view
        self._entries: OrderedDict[Hashable, Any] = OrderedDict()

    def frame(self, loadable: LoadableFrame, *, within_view: bool = False) -> Frame:
        """The frame; ``within_view`` drops what its camera does not see."""
        frame: Frame = self._keep(("frame", loadable.name), loadable.load)
        return clip_to_view(frame) if within_view or self._within_view else frame

    def features(self, loadable: LoadableFrame, config: Config, *, within_view: bool = False) -> tuple[Features, float]:
        """Features by the configuration, and the milliseconds they took on the clock."""

        def make() -> tuple[Features, float]:
            frame = self.frame(loadable, within_view=within_view)
            return timed(lambda: _extract_all(frame, config))

        if not config.geometric.always:
            return make()  # what is made only in doubt is charged to the pair that it is made for
        return self._keep(("features", loadable.name, config.visual, config.geometric, within_view), make)

    def derived(self, loadable: LoadableFrame, key: Hashable, make: Callable[[Frame], _T]) -> tuple[_T, float]:
        """Anything else that is derived from a frame, and the milliseconds it took; ``key`` names it."""
        return self._keep(("derived", loadable.name, key), lambda: timed(partial(make, self.frame(loadable))))

    def _keep(self, key: Hashable, make: Callable[[], _T]) -> _T:
        if key not in self._entries:
            self._entries[key] = make()
            if len(self._entries) > MAX_ENTRIES:
                self._entries.popitem(last=False)
        self._entries.move_to_end(key)
        entry: _T = self._entries[key]
        return entry


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
