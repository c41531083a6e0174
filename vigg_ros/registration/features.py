# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is computed once per frame and kept with a keyframe."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from vigg_ros.registration.alignment import FrameAlignment
from vigg_ros.registration.config import Config
from vigg_ros.registration.depth_alignment import DepthAlignment, DepthSurface
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.geometric import (
    Landmarks,
    Surface,
    build_landmarks,
    build_patches,
    build_surface,
    rows_in_range,
    sample,
)
from vigg_ros.registration.geometry import DepthMap, View
from vigg_ros.registration.local_match import LocalMatcher, max_zone_radius_m
from vigg_ros.registration.matches import Matches
from vigg_ros.registration.noise import DepthNoise, DepthPlanes, noise_of
from vigg_ros.registration.scan_alignment import IndexedSurface, ScanAlignment
from vigg_ros.registration.visual import Keypoints, detect, is_reduced


@dataclass(frozen=True)  # without slots: a cached property needs a dictionary
class Features:
    """A frame as registration sees it; all points are in the frame of the results.

    What every registration needs is there; what only doubt calls for is made at its first use, and kept. That is a
    function of the frame and the configuration alone, so no answer depends on who asked when.
    """

    frame: Frame
    """What they were extracted from."""
    config: Config
    """How they were, and what is made later will be."""
    keypoints: Keypoints
    """Of the image reduced to ``visual.max_pixels``."""
    surface: Surface
    """The fine grid, for alignment."""
    patches: Surface
    """The coarse grid, where features are described: enough to see whether two frames agree."""
    view: View
    """The lines of sight."""
    noise: DepthNoise
    """Of its points."""
    planes: DepthPlanes | None
    """Of a depth image."""

    @cached_property
    def fine_keypoints(self) -> Keypoints:
        """Of the image in full size; the same object as ``keypoints`` where that was not reduced."""
        is_coarse = is_reduced(self.frame, self.config.visual)
        return _measured(_keypoints(self.frame, self.config, None), self.noise) if is_coarse else self.keypoints

    def searched_keypoints(self, least: int) -> Keypoints:
        """Those of the reduced image; those in full size where that shows fewer than ``least``."""
        return self.keypoints if len(self.keypoints) >= least else self.fine_keypoints

    @cached_property
    def landmarks(self) -> Landmarks:
        """The patches with FPFH."""
        return build_landmarks(self.patches, self.config.geometric, self.noise)

    def matcher(self, max_radius_m: float) -> LocalMatcher:
        """The landmarks, indexed for local matching in zones up to this radius when the frame is a target."""
        kept = self._matcher
        return kept if kept.max_radius_m >= max_radius_m else LocalMatcher(self.landmarks, max_radius_m)

    @cached_property
    def _matcher(self) -> LocalMatcher:
        config = self.config
        return LocalMatcher(self.landmarks, max_zone_radius_m(config.cliques.inlier_threshold_m, config.local_match))

    @cached_property
    def indexed(self) -> IndexedSurface:
        """The surface, indexed for alignment when the frame is a target."""
        return IndexedSurface(self.surface, self.config.geometric.voxel_size_m)

    @cached_property
    def depth_surface(self) -> DepthSurface | None:
        """The planes of a depth image, to be aligned; None of one that has too many holes for planes."""
        if self.planes is None or not self.planes.is_dense:
            return None
        geometric = self.config.geometric
        return DepthSurface.of(self.planes, self.noise, near_m=geometric.min_range_m, far_m=geometric.max_range_m)


def alignment(target: Features, source: Features, visual: Matches, config: Config) -> FrameAlignment:
    """How two frames are aligned: depth images by projection, scans in space."""
    if target.depth_surface is not None and source.depth_surface is not None:
        return DepthAlignment(target.depth_surface, source.depth_surface, visual, config.geometric.voxel_size_m)
    rows = sample(len(source.surface), config.geometric.sample_k, config.seed)
    return ScanAlignment(target.indexed, source.surface.select(rows), visual)


def extract(frame: Frame, config: Config) -> Features:
    """Keypoints, surface and lines of sight of a frame; image and points are worked on side by side.

    Never fails for want of texture or depth: that shows in the sizes, and ``register`` says so.
    """
    # A pool for each frame: it takes 0.1 ms, and survives a fork of the process, as one for all would not.
    with ThreadPoolExecutor(max_workers=1, thread_name_prefix="keypoints") as beside:
        detecting = beside.submit(copy_context().run, partial(_keypoints, frame, config, config.visual.max_pixels))
        planes = DepthPlanes.of(frame.geometry) if isinstance(frame.geometry, DepthMap) else None
        noise = noise_of(
            planes, config.noise, near_m=config.geometric.min_range_m, far_m=config.geometric.max_range_m
        )
        surface = build_surface(frame.points(), config.geometric, noise)
        patches = build_patches(surface, config.geometric)
        view = frame.geometry.view()
        keypoints = _measured(detecting.result(), noise)
    return Features(frame, config, keypoints, surface, patches, view, noise, planes)


def _measured(keypoints: Keypoints, noise: DepthNoise) -> Keypoints:
    return replace(keypoints, sigma_m=noise.sigma_m(np.linalg.norm(keypoints.points, axis=1)))


def _keypoints(frame: Frame, config: Config, max_pixels: int | None) -> Keypoints:
    keypoints = detect(frame, config.visual, max_pixels=max_pixels)
    return keypoints.select(rows_in_range(keypoints.points, config.geometric))
