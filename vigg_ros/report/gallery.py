# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The few frames of a replay that are worth a look, kept in bounded memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from vigg_ros.acceptance.checks import answer_margin
from vigg_ros.pictures import (
    BODY_AXES,
    OPTICAL_AXES,
    Picture,
    beside,
    draw_aligned,
    draw_depth,
    draw_matches,
    draw_scan,
)
from vigg_ros.registration.config import Config
from vigg_ros.registration.features import Features
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.geometry import DepthMap, ProjectedScan
from vigg_ros.registration.result import Outcome, Reason, Registration, Rejection
from vigg_ros.registration.rigid import transform
from vigg_ros.registration.visual import Keypoints, match_visual
from vigg_ros.tracking.frame_result import Comparison, FrameResult

LOST_MARGIN = -1.0
"""Below the margin of every answered frame."""


@dataclass(frozen=True, slots=True)
class Lines:
    """N visual matches as they are drawn."""

    target_px: NDArray[np.floating]
    """(N, 2)"""
    source_px: NDArray[np.floating]
    """(N, 2)"""
    agrees: NDArray[np.bool_]
    """(N,) with the answer."""


def lines_of_matches(target: Keypoints, source: Keypoints, outcome: Outcome | None, config: Config) -> Lines:
    """The matches that agree with the answer, as it counted them, and those of the reduced images that do not."""
    matches = match_visual(target, source, config.visual)
    agreeing = np.empty((0, 4), np.float32)
    if isinstance(outcome, Registration):
        agreeing = outcome.visual_inliers_px
        off_m = matches.distances(outcome.T_target_source)
        matches = matches.select(off_m >= config.cliques.inlier_threshold_m)
    return Lines(
        np.concatenate((target.pixels[matches.target_row], agreeing[:, :2])),
        np.concatenate((source.pixels[matches.source_row], agreeing[:, 2:])),
        np.arange(len(matches) + len(agreeing)) >= len(matches),
    )


@dataclass(frozen=True, slots=True)
class FramePicture:
    """What is needed of a frame to draw it."""

    image: NDArray[np.uint8]
    keypoints: Keypoints
    points: NDArray[np.float32]
    """(N, 3), the surface, metres, in the frame of the results."""
    depth_m: NDArray[np.float32] | None
    """(H, W), metres; None for a scan."""
    scan: ProjectedScan | None
    """The scan and its camera; None for a depth image."""

    @classmethod
    def of(cls, frame: Frame, features: Features) -> FramePicture:
        """Keeps references, copies nothing."""
        depth_m = frame.geometry.depth_m if isinstance(frame.geometry, DepthMap) else None
        scan = frame.geometry if isinstance(frame.geometry, ProjectedScan) else None
        return cls(frame.image, features.keypoints, features.surface.points, depth_m, scan)

    def draw_scan(self, panel_width_px: int) -> Picture | None:
        """The points of the scan over the image; None for a depth image."""
        if self.scan is None:
            return None
        rows, pixels = self.scan.visible()
        depth_m = transform(self.scan.T_camera_points, self.scan.cloud[rows])[:, 2]
        return draw_scan(self.image, pixels, depth_m, panel_width_px=panel_width_px)


@dataclass(frozen=True, slots=True)
class PicturedFrame:
    """A frame, what it was compared with, and what came of it."""

    index: int
    """Place among the frames that were offered."""
    margin: float
    """0 on the verge of refusal, 1 beyond doubt; LOST_MARGIN for a lost frame."""
    result: FrameResult
    source: FramePicture
    target: FramePicture | None
    """The reference keyframe; None where there was none."""

    @property
    def reason(self) -> Reason | None:
        """Why the frame was lost; None if it was not."""
        outcome = self.result.outcome
        return outcome.reason if isinstance(outcome, Rejection) else None

    def draw_matches(self, config: Config, *, panel_width_px: int = 480) -> Picture:
        """The visual matches, those that agree with the answer coloured; both images, or the one there is."""
        if self.target is None:
            nothing = np.empty((0, 2))
            image = np.full_like(self.source.image, 255)
            return draw_matches(image, self.source.image, nothing, nothing, panel_width_px=panel_width_px)
        lines = lines_of_matches(self.target.keypoints, self.source.keypoints, self.result.outcome, config)
        return draw_matches(
            self.target.image,
            self.source.image,
            lines.target_px,
            lines.source_px,
            agrees=lines.agrees,
            panel_width_px=panel_width_px,
        )

    def draw_shapes(self, *, panel_width_px: int = 480) -> Picture | None:
        """Answered: both surfaces as the answer lays them; lost: both depth images, if there are any."""
        if self.target is None:
            return None
        if isinstance(self.result.outcome, Registration):
            axes = BODY_AXES if self.source.depth_m is None else OPTICAL_AXES
            moved = transform(self.result.outcome.T_target_source, self.source.points)
            return draw_aligned(self.target.points, moved, axes=axes, panel_width_px=panel_width_px)
        if self.target.depth_m is None or self.source.depth_m is None:
            return None
        return beside(
            draw_depth(self.target.depth_m, panel_width_px=panel_width_px),
            draw_depth(self.source.depth_m, panel_width_px=panel_width_px),
        )

    def draw_scans(self, *, panel_width_px: int = 480) -> Picture | None:
        """Both scans over their images; None for depth images."""
        if self.target is None:
            return self.source.draw_scan(panel_width_px)
        left, right = self.target.draw_scan(panel_width_px), self.source.draw_scan(panel_width_px)
        return None if left is None or right is None else beside(left, right)


class Gallery:
    """Keeps the worst frames of a replay, spread over all of it, in the memory of a few frames.

    The replay is cut into stretches. Of each stretch stay the first frame that was lost for each reason,
    and the answered frame with the least margin. When that is too many, the stretches double in length.
    """

    def __init__(self, config: Config, limit: int = 6) -> None:
        self.config = config
        self._limit = limit
        # One stretch alone may hold as many as there are reasons, and an answered frame.
        self._capacity = max(2 * limit, len(Reason) + 1)
        self._offered = 0
        self._stretch = 1
        self._kept: list[PicturedFrame] = []

    def offer(self, result: FrameResult) -> None:
        """Look at a result of the pipeline; one that starts a session, or was not compared, is of no interest."""
        if not result.state.was_registered:
            return
        index = self._offered
        self._offered += 1
        if result.outcome is None or result.compared is None:
            return
        self._kept = _worst([*self._kept, _pictured(index, result, result.compared, self.config)], self._stretch)
        while len(self._kept) > self._capacity:
            self._stretch *= 2
            self._kept = _worst(self._kept, self._stretch)

    @property
    def pictured(self) -> list[PicturedFrame]:
        """At most ``limit`` frames in order of time: lost ones, of each reason first one, then small margins.

        No neighbours, while others are left.
        """
        chosen: list[PicturedFrame] = []
        rest = list(self._kept)
        while rest and len(chosen) < self._limit:
            best = min(rest, key=partial(_rank, chosen=chosen, stretch=self._stretch))
            rest.remove(best)
            chosen.append(best)
        return sorted(chosen, key=lambda pictured: pictured.index)


def _rank(pictured: PicturedFrame, *, chosen: list[PicturedFrame], stretch: int) -> tuple[float, ...]:
    """The smaller, the more a frame adds to those that are chosen."""
    repeated = sum(pictured.reason == other.reason for other in chosen)
    is_near = any(abs(pictured.index - other.index) < stretch for other in chosen)
    return pictured.reason is None, repeated, is_near, pictured.margin, pictured.index


def _worst(pictured: Sequence[PicturedFrame], stretch: int) -> list[PicturedFrame]:
    """Of each stretch and reason the smallest margin; of equal ones the first: there trouble began."""
    worst: dict[tuple[int, Reason | None], PicturedFrame] = {}
    for one in pictured:
        key = one.index // stretch, one.reason
        if key not in worst or one.margin < worst[key].margin:
            worst[key] = one
    return sorted(worst.values(), key=lambda pictured: pictured.index)


def _pictured(index: int, result: FrameResult, compared: Comparison, config: Config) -> PicturedFrame:
    keyframe, outcome = compared.keyframe, result.outcome
    target = None if keyframe is None else FramePicture.of(keyframe.frame, keyframe.features)
    margin = answer_margin(outcome.evidence, config) if isinstance(outcome, Registration) else LOST_MARGIN
    source = FramePicture.of(compared.frame, compared.features)
    return PicturedFrame(index, margin, replace(result, compared=None), source, target)
