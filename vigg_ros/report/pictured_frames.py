# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The pictured frames of a report, with captions that say what is to be seen."""

from __future__ import annotations

import string
from collections.abc import Sequence

from vigg_ros.registration.result import Rejection
from vigg_ros.report.gallery import Gallery, PicturedFrame
from vigg_ros.report.html import Markup, element, image, section
from vigg_ros.report.series import Axis
from vigg_ros.report.wording import MEANINGS
from vigg_ros.tracking.frame_result import FrameResult

INTRODUCTION = (
    "The frames that were lost, the first of each reason, and those answered frames that came nearest to being "
    "refused; spread over the recording, and lettered as in the strip of states above. Left is the keyframe that "
    "the frame was compared with, right the frame. Lines join visual matches: coloured ones agree with the answer, "
    "and one colour is one direction of motion in the image; grey ones were tried and do not agree. Below an answer "
    "lie both surfaces as the answer puts them, from above and from the front: the keyframe's blue, the frame's "
    "orange, dark where they coincide; a double contour would be an error. Below a lost frame are both depth images, "
    "where there are any; scans are drawn over their images, near points red, far ones blue."
)


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
