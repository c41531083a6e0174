# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The pictured frames of a report, with captions that say what is to be seen."""

from __future__ import annotations

import string
from collections.abc import Sequence

from vigg_ros.registration.result import Evidence
from vigg_ros.report.gallery import Exhibit, Gallery
from vigg_ros.report.html import Markup, element, image, section
from vigg_ros.report.recording import FrameRecord
from vigg_ros.report.series import Axis
from vigg_ros.report.wording import MEANINGS

INTRODUCTION = (
    "The frames that were lost, the first of each reason, and those answered frames that came nearest to being "
    "refused; spread over the recording, and lettered as in the strip of states above. Left is the keyframe that "
    "the frame was compared with, right the frame. Lines join visual matches: coloured ones agree with the answer, "
    "and one colour is one direction of motion in the image; grey ones were tried and do not agree. Below an answer "
    "lie both surfaces as the answer puts them, from above and from the front: the keyframe's blue, the frame's "
    "orange, dark where they coincide; a double contour would be an error. Below a lost frame are both depth images, "
    "where there are any; scans are drawn over their images, near points red, far ones blue."
)


def locate(gallery: Gallery, frames: Sequence[FrameRecord]) -> list[tuple[int, str, Exhibit]]:
    """Each exhibit with its frame's place in the recording, and its letter."""
    places = {
        (record.session, record.stamp_ns): place for place, record in enumerate(frames) if record.state != "REFUSED"
    }
    keys = ((exhibit.estimate.session, exhibit.estimate.stamp_ns) for exhibit in gallery.exhibits)
    found = [(places[key], exhibit) for key, exhibit in zip(keys, gallery.exhibits, strict=True) if key in places]
    return [(place, string.ascii_uppercase[i % 26], exhibit) for i, (place, exhibit) in enumerate(found)]


def exhibit_section(gallery: Gallery, frames: Sequence[FrameRecord], axis: Axis) -> Markup:
    """All exhibits with their pictures; empty if there are none."""
    located = locate(gallery, frames)
    if not located:
        return Markup()
    shown = (_show(exhibit, letter, axis.place(place), gallery) for place, letter, exhibit in located)
    return section("Frames worth a look", element("p", INTRODUCTION, class_="faint"), *shown)


def _show(exhibit: Exhibit, letter: str, place: str, gallery: Gallery) -> Markup:
    title = f"{letter} \N{MIDDLE DOT} {place} \N{MIDDLE DOT} {exhibit.estimate.state.value.lower()}"
    if exhibit.reason is not None:
        title += f": {exhibit.reason.value}"
    pictures = [image(exhibit.draw_matches(gallery.config), f"matches of frame {letter}")]
    scans = exhibit.draw_scans()
    if scans is not None:
        pictures.append(image(scans, f"scans of frame {letter} over their images"))
    shapes = exhibit.draw_shapes()
    if shapes is not None:
        pictures.append(image(shapes, f"surfaces of frame {letter}"))
    return element("div", element("h3", title), element("p", caption(exhibit)), *pictures, class_="frame")


def caption(exhibit: Exhibit) -> str:
    """What came of the frame, and by which evidence."""
    outcome = exhibit.estimate.outcome
    assert outcome is not None, "the gallery keeps no frame that starts a session"
    evidence = outcome.evidence
    if exhibit.reason is not None:
        against = "There was no keyframe yet." if exhibit.target is None else _compared(exhibit)
        return f"{MEANINGS[exhibit.reason.value]} In figures: {getattr(outcome, 'message', '')}. {against}"
    return (
        f"{_compared(exhibit)} {evidence.visual_inliers} of {evidence.visual_matches} visual and "
        f"{evidence.geometric_inliers} of {evidence.geometric_matches} geometric matches agree with the answer. "
        f"{_shares(evidence)}"
    )


def _compared(exhibit: Exhibit) -> str:
    return f"Compared with keyframe {exhibit.estimate.keyframe_id}."


def _shares(evidence: Evidence) -> str:
    return (
        f"{evidence.overlap:.0%} of the surfaces coincide; of what both should see, {evidence.consistency:.0%} does. "
        f"Along their normals they lie {1000 * evidence.rmse_m:.1f} mm apart (rmse)."
    )
