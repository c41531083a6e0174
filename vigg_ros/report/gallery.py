# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The few frames of a replay that are worth a look: kept in bounded memory, drawn, and said what is to be seen."""

from __future__ import annotations

import string
from collections.abc import Sequence
from dataclasses import dataclass
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
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.geometry import DepthMap, ProjectedScan
from vigg_ros.registration.result import Outcome, Reason, Registration, Rejection
from vigg_ros.registration.rigid import transform
from vigg_ros.registration.visual import Keypoints, match_visual
from vigg_ros.report.html import Markup, element, image, section
from vigg_ros.report.series import Axis
from vigg_ros.report.wording import MEANINGS
from vigg_ros.tracking.frame_result import Comparison, FrameResult

LOST_MARGIN = -1.0
"""Below the margin of every answered frame."""

PANEL_WIDTH_PX = 480

INTRODUCTION = (
    "The frames that were lost, the first of each reason, and those answered frames that came nearest to being "
    "refused; spread over the recording, and lettered as in the strip of states above. Left is the keyframe that "
    "the frame was compared with, right the frame. Lines join visual matches: coloured ones agree with the answer, "
    "and one colour is one direction of motion in the image; grey ones were tried and do not agree. Below an answer "
    "lie both surfaces as the answer puts them, from above and from the front: the keyframe's blue, the frame's "
    "orange, dark where they coincide; a double contour would be an error. Below a lost frame are both depth images, "
    "where there are any; scans are drawn over their images, near points red, far ones blue."
)


def draw_agreement(
    images: tuple[NDArray[np.uint8], NDArray[np.uint8]],
    keypoints: tuple[Keypoints, Keypoints],
    outcome: Outcome | None,
    config: Config,
    *,
    panel_width_px: int | None = None,
) -> Picture:
    """Target and source with the matches that agree with the answer, as it counted them, coloured.

    Grey are those of the reduced images that do not agree.
    """
    target, source = keypoints
    matches = match_visual(target, source, config.visual)
    agreeing = np.empty((0, 4), np.float32)
    if isinstance(outcome, Registration):
        agreeing = outcome.visual_inliers_px
        off_m = matches.distances(outcome.T_target_source)
        matches = matches.select(off_m >= config.cliques.inlier_threshold_m)
    target_px = np.concatenate((target.pixels[matches.target_row], agreeing[:, :2]))
    source_px = np.concatenate((source.pixels[matches.source_row], agreeing[:, 2:]))
    agrees = np.arange(len(target_px)) >= len(matches)
    return draw_matches(*images, target_px, source_px, agrees=agrees, panel_width_px=panel_width_px)


def draw_scan_of(frame: Frame, *, panel_width_px: int = PANEL_WIDTH_PX) -> Picture | None:
    """The points of a scan over the image of its frame; None for a depth image."""
    if not isinstance(frame.geometry, ProjectedScan):
        return None
    rows, pixels = frame.geometry.visible()
    depth_m = transform(frame.geometry.T_camera_points, frame.geometry.cloud[rows])[:, 2]
    return draw_scan(frame.image, pixels, depth_m, panel_width_px=panel_width_px)


@dataclass(frozen=True, slots=True)
class PicturedFrame:
    """A frame, what it was compared with, and what came of it."""

    index: int
    """Place among the frames that were offered."""
    margin: float
    """0 on the verge of refusal, 1 beyond doubt; LOST_MARGIN for a lost frame."""
    result: FrameResult
    compared: Comparison
    """The frame, and the reference keyframe where there was one."""

    @property
    def reason(self) -> Reason | None:
        """Why the frame was lost; None if it was not."""
        outcome = self.result.outcome
        return outcome.reason if isinstance(outcome, Rejection) else None

    def draw_matches(self, config: Config, *, panel_width_px: int = PANEL_WIDTH_PX) -> Picture:
        """The visual matches, those that agree with the answer coloured; both images, or the one there is."""
        source, keyframe = self.compared.features.keypoints, self.compared.keyframe
        image = self.compared.frame.image
        if keyframe is None:
            nothing = np.empty((0, 2))
            return draw_matches(np.full_like(image, 255), image, nothing, nothing, panel_width_px=panel_width_px)
        images, keypoints = (keyframe.frame.image, image), (keyframe.features.keypoints, source)
        return draw_agreement(images, keypoints, self.result.outcome, config, panel_width_px=panel_width_px)

    def draw_shapes(self, *, panel_width_px: int = PANEL_WIDTH_PX) -> Picture | None:
        """Answered: both surfaces as the answer lays them; lost: both depth images, if there are any."""
        frame, keyframe = self.compared.frame, self.compared.keyframe
        if keyframe is None:
            return None
        if isinstance(self.result.outcome, Registration):
            axes = OPTICAL_AXES if isinstance(frame.geometry, DepthMap) else BODY_AXES
            moved = transform(self.result.outcome.T_target_source, self.compared.features.surface.points)
            return draw_aligned(keyframe.features.surface.points, moved, axes=axes, panel_width_px=panel_width_px)
        maps = (one.geometry for one in (keyframe.frame, frame) if isinstance(one.geometry, DepthMap))
        depths = [draw_depth(one.depth_m, panel_width_px=panel_width_px) for one in maps]
        return beside(*depths) if depths else None

    def draw_scans(self) -> Picture | None:
        """Both scans over their images; None for depth images."""
        keyframe = self.compared.keyframe
        frames = [self.compared.frame] if keyframe is None else [keyframe.frame, self.compared.frame]
        scans = [scan for scan in map(draw_scan_of, frames) if scan is not None]
        return beside(*scans) if len(scans) > 1 else next(iter(scans), None)


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
        found = isinstance(result.outcome, Registration)
        margin = answer_margin(result.outcome.evidence, self.config) if found else LOST_MARGIN
        pictured = PicturedFrame(index, margin, result, result.compared)
        self._kept = _worst([*self._kept, pictured], self._stretch)
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


def locate(gallery: Gallery, frames: Sequence[FrameResult]) -> list[tuple[int, str, PicturedFrame]]:
    """Each pictured frame with its place in the recording, and its letter."""
    places = [place for place, record in enumerate(frames) if record.state.was_registered]
    found = [(places[pictured.index], pictured) for pictured in gallery.pictured if pictured.index < len(places)]
    return [(place, letter, pictured) for letter, (place, pictured) in zip(string.ascii_uppercase, found, strict=False)]


def pictured_section(gallery: Gallery, frames: Sequence[FrameResult], axis: Axis) -> Markup:
    """All of them with their pictures; empty if there are none."""
    located = locate(gallery, frames)
    if not located:
        return Markup()
    shown = (_show(pictured, letter, axis.place(place), gallery) for place, letter, pictured in located)
    return section("Frames worth a look", element("p", INTRODUCTION, class_="faint"), *shown)


def _show(pictured: PicturedFrame, letter: str, place: str, gallery: Gallery) -> Markup:
    title = f"{letter} \N{MIDDLE DOT} {place} \N{MIDDLE DOT} {pictured.result.state.value.lower()}"
    if pictured.reason is not None:
        title += f": {pictured.reason.value}"
    drawn = (
        (pictured.draw_matches(gallery.config), f"matches of frame {letter}"),
        (pictured.draw_scans(), f"scans of frame {letter} over their images"),
        (pictured.draw_shapes(), f"surfaces of frame {letter}"),
    )
    pictures = (image(picture, said) for picture, said in drawn if picture is not None)
    return element("div", element("h3", title), element("p", caption(pictured)), *pictures, class_="frame")


def caption(pictured: PicturedFrame) -> str:
    """What came of the frame, and by which evidence."""
    outcome = pictured.result.outcome
    assert outcome is not None, "the gallery keeps no frame that starts a session"
    evidence = outcome.evidence
    against = f"Compared with keyframe {pictured.result.keyframe_id}."
    if isinstance(outcome, Rejection):
        against = "There was no keyframe yet." if pictured.compared.keyframe is None else against
        return f"{MEANINGS[outcome.reason.value]} In figures: {outcome.message}. {against}"
    return (
        f"{against} {evidence.visual_inliers} of {evidence.visual_matches} visual and "
        f"{evidence.geometric_inliers} of {evidence.geometric_matches} geometric matches agree with the answer. "
        f"{evidence.overlap:.0%} of the surfaces coincide; of what both should see, {evidence.consistency:.0%} does. "
        f"Along their normals they lie {1000 * evidence.rmse_m:.1f} mm apart (rmse)."
    )
