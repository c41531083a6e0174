# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is computed once per frame and kept with a keyframe."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass
from functools import partial
from threading import Lock
from typing import Generic, TypeVar

from vigg_ros.registration.config import Config
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.geometric import (
    Landmarks,
    Surface,
    build_landmarks,
    build_patches,
    build_surface,
    rows_in_range,
)
from vigg_ros.registration.local_match import LocalMatcher, max_zone_radius_m
from vigg_ros.registration.refinement import SurfaceAligner
from vigg_ros.registration.visibility import View
from vigg_ros.registration.visual import Keypoints, detect, is_reduced

_T = TypeVar("_T")


class Lazy(Generic[_T]):
    """A value that is made when it is first asked for, and kept.

    It is a function of its frame alone, so no answer depends on who asked when.
    """

    def __init__(self, make: Callable[[], _T]) -> None:
        self._make: Callable[[], _T] | None = make
        self._value: _T | None = None
        self._lock = Lock()

    def __call__(self) -> _T:
        """The value."""
        with self._lock:
            if self._make is not None:
                self._value = self._make()
                self._make = None  # what it was made from can go
        return self._value  # type: ignore[return-value]


@dataclass(frozen=True, slots=True)
class Features:
    """A frame as registration sees it; all points are in the frame of the results.

    What every registration needs is there; what only doubt calls for is made at its first use.
    """

    keypoints: Keypoints
    """Of the image reduced to ``visual.max_pixels``."""
    surface: Surface
    """The fine grid, for alignment."""
    patches: Surface
    """The coarse grid, where features are described: enough to see whether two frames agree."""
    view: View
    frame: Frame
    """What they were extracted from."""
    lazy_keypoints: Lazy[Keypoints]
    lazy_landmarks: Lazy[Landmarks]
    lazy_matcher: Lazy[LocalMatcher]
    lazy_aligner: Lazy[SurfaceAligner]

    @property
    def fine_keypoints(self) -> Keypoints:
        """Of the image in full size; the same object as ``keypoints`` where that was not reduced."""
        return self.lazy_keypoints()

    def searched_keypoints(self, least: int) -> Keypoints:
        """Those of the reduced image; those in full size where that shows fewer than ``least``."""
        return self.keypoints if len(self.keypoints) >= least else self.fine_keypoints

    @property
    def landmarks(self) -> Landmarks:
        """The patches with FPFH."""
        return self.lazy_landmarks()

    def matcher(self, max_radius_m: float) -> LocalMatcher:
        """The landmarks, indexed for local matching in zones up to this radius when the frame is a target."""
        kept = self.lazy_matcher()
        return kept if kept.max_radius_m >= max_radius_m else LocalMatcher(self.landmarks, max_radius_m)

    @property
    def aligner(self) -> SurfaceAligner:
        """The surface, indexed for alignment when the frame is a target."""
        return self.lazy_aligner()


def extract(frame: Frame, config: Config) -> Features:
    """Keypoints, surface and lines of sight of a frame; image and points are worked on side by side.

    Never fails for want of texture or depth: that shows in the sizes, and ``register`` says so.
    """
    # A pool for each frame: it takes 0.1 ms, and survives a fork of the process, as one for all would not.
    with ThreadPoolExecutor(max_workers=1, thread_name_prefix="keypoints") as beside:
        detecting = beside.submit(copy_context().run, partial(_keypoints, frame, config, config.visual.max_pixels))
        surface = build_surface(frame.points(), config.geometric)
        patches = build_patches(surface, config.geometric)
        view = frame.geometry.view()
        keypoints = detecting.result()
    return assemble(frame, keypoints, surface, patches, config=config, view=view)


def assemble(
    frame: Frame, keypoints: Keypoints, surface: Surface, patches: Surface, *, config: Config, view: View
) -> Features:
    """Features from their parts, with what is made later; ``extract`` with the parts given."""
    fine = partial(_keypoints, frame, config, None) if is_reduced(frame, config.visual) else lambda: keypoints
    landmarks = Lazy(partial(build_landmarks, patches, config.geometric))
    radius_m = max_zone_radius_m(config.cliques.inlier_threshold_m, config.local_match)
    return Features(
        keypoints=keypoints,
        surface=surface,
        patches=patches,
        view=view,
        frame=frame,
        lazy_keypoints=Lazy(fine),
        lazy_landmarks=landmarks,
        lazy_matcher=Lazy(lambda: LocalMatcher(landmarks(), radius_m)),
        lazy_aligner=Lazy(lambda: SurfaceAligner(surface, config.geometric.voxel_size_m)),
    )


def _keypoints(frame: Frame, config: Config, max_pixels: int | None) -> Keypoints:
    keypoints = detect(frame, config.visual, max_pixels=max_pixels)
    return keypoints.select(rows_in_range(keypoints.points, config.geometric))
