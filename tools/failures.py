# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of the worst failures of a run, with what speaks for their cause."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.acceptance.agreement import Pair, assess
from vigg_ros.bench.datasets.convert import open_dataset
from vigg_ros.bench.pair_results import Limits
from vigg_ros.bench.pairs import FramePair, pairs_at, pairs_listed, posed_frames
from vigg_ros.bench.rendered_pairs import STREET, number_of, rendered_pair
from vigg_ros.pictures import BODY_AXES, OPTICAL_AXES, Picture, beside, draw_aligned, draw_matches, write
from vigg_ros.registration import Config, Features, Frame, Registration, extract, register
from vigg_ros.registration.geometry import DepthMap
from vigg_ros.registration.matches import Matches, no_matches
from vigg_ros.registration.rigid import transform
from vigg_ros.registration.visual import match_visual

METHOD = "default"

Row = Mapping[str, str]
"""A result in a .csv file, by column."""

PANEL_PX = 340
JPEG_QUALITY = 80
_INK = (70, 70, 70)


@dataclass(frozen=True, slots=True)
class Failure:
    """A pair without the right answer, its picture, and a sentence about it."""

    picture: str
    """Relative to docs/."""
    text: str


def draw(arguments: Sequence[str], data: Path, folder: Path, images: Path, count: int) -> list[Failure]:
    """Pictures of the worst failures of a run; older ones of the same run are removed."""
    prefix = f"failure_{folder.name}_"
    for old in images.glob(f"{prefix}[0-9]*.jpg"):
        old.unlink()
    failures = []
    for number, row in enumerate(worst(folder, count), 1):
        frame_pair = find_pair(arguments, data, row)
        picture, text = describe(frame_pair, _config(arguments, frame_pair))
        name = f"{prefix}{number}.jpg"
        cv2.imwrite(str(images / name), picture, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        failures.append(Failure(f"images/{name}", text))
    return failures


def block(failures: Sequence[Failure]) -> str:
    """For the page: a sentence and a picture for each."""
    if not failures:
        return "None: every pair was answered rightly."
    return "\n\n".join(f"{one.text}\n\n![{_alt(one.text)}]({one.picture})" for one in failures)


def worst(folder: Path, count: int) -> list[Row]:
    """Rows of failures: wrong answers, the greatest errors first, then pairs without an answer, spread over groups."""
    chosen, seen = [], set()
    for row in (*wrong_answers(folder), *(row for row, _ in _rows(folder) if row["reason"])):
        # One of each group and reason says more than three of the same.
        if (row["group"], row["reason"]) not in seen:
            seen.add((row["group"], row["reason"]))
            chosen.append(row)
    return chosen[:count]


def wrong_answers(folder: Path) -> list[Row]:
    """Rows of answers beyond the limits of recall, the greatest errors first."""
    wrong = [row for row, limits in _rows(folder) if not row["reason"] and not _is_right(row, limits)]
    return sorted(wrong, key=lambda row: -float(row["translation_error_m"]))


def listing(folder: Path) -> str:
    """For the page: all wrong answers of a run, a line each."""
    lines = [
        f"- {row['group']}, source {row['source']}, target {row['target']}: "
        f"{float(row['rotation_error_deg']):.1f} deg, {100 * float(row['translation_error_m']):.0f} cm"
        for row in wrong_answers(folder)
    ]
    return "\n".join(["All wrong answers:", "", *lines]) if lines else "No answer is wrong."


def _rows(folder: Path) -> list[tuple[Row, Limits]]:
    """Results of the method, with the limits that they are judged by."""
    found = []
    for path in sorted(folder.glob("*.csv")):
        if not path.stem.endswith("_by_overlap") and path.stem != "reliability":
            limits = Limits(**json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))["limits"])
            rows = csv.DictReader(path.read_text(encoding="utf-8").splitlines())
            found += [(row, limits) for row in rows if row["method"] == METHOD]
    return found


def find_pair(arguments: Sequence[str], data: Path, row: Row) -> FramePair:
    """The pair of a row of the table."""
    if arguments[0] == "rendered":
        seed = int(arguments[arguments.index("--seed") + 1])
        return rendered_pair(number_of(row["target"], seed), seed)
    layout, name = arguments[1:3]
    frames = posed_frames(open_dataset(layout, data / name))
    gap = int(row["group"])
    if "--truth-pairs" in arguments:
        pairs = pairs_listed(frames, data / arguments[arguments.index("--truth-pairs") + 1], [gap])
    else:
        pairs = pairs_at(frames, [gap], 1)
    return next(pair for pair in pairs if (pair.target.name, pair.source.name) == (row["target"], row["source"]))


def describe(frame_pair: FramePair, config: Config) -> tuple[Picture, str]:
    """The matches, coloured where they are right, and the surfaces as they are and as the answer has them."""
    frames = frame_pair.target.load(), frame_pair.source.load()
    target, source = (extract(frame, config) for frame in frames)
    outcome = register(target, source, config)
    visual = match_visual(target.fine_keypoints, source.fine_keypoints, config.visual)
    truth = assess(Pair(target, source, visual, no_matches(), config), frame_pair.T_target_source)
    right = truth.visual_inliers
    features = target, source
    as_it_is = _surfaces(frames[0], features, frame_pair.T_target_source)
    rows = [_matches(frames, features, visual, right), write(as_it_is, "as they are", (10, 38), _INK)]
    said = "no answer"
    if isinstance(outcome, Registration):
        answered = _surfaces(frames[0], features, outcome.T_target_source)
        rows.append(write(answered, "as answered", (10, 38), _INK))
        said = "answered wrongly"
    else:
        said += f", {outcome.reason.value} ({outcome.message})"
    facts = f"{np.count_nonzero(right)} of {len(visual)} visual matches are right"
    overlap = f"{truth.agreement.overlap:.0%} of the surface coincides under the true motion"
    text = f"{_pair_name(frame_pair)}: {said}. {facts}; {overlap}."
    return np.vstack([_as_wide(row, rows[0].shape[1]) for row in rows]), text


def _pair_name(frame_pair: FramePair) -> str:
    if frame_pair.group.isdigit():
        return f"Source {frame_pair.source.name}, target {frame_pair.target.name} (gap {frame_pair.group})"
    return f"Rendered: {frame_pair.target.name} and {frame_pair.source.name} (overlap {frame_pair.overlap:.0%})"


def _matches(
    frames: tuple[Frame, Frame], features: tuple[Features, Features], visual: Matches, right: NDArray[np.bool_]
) -> Picture:
    return draw_matches(
        frames[0].image,
        frames[1].image,
        features[0].fine_keypoints.pixels[visual.target_row],
        features[1].fine_keypoints.pixels[visual.source_row],
        agrees=right,
        panel_width_px=PANEL_PX,
    )


def _surfaces(frame: Frame, features: tuple[Features, Features], T_target_source: NDArray[np.float64]) -> Picture:
    axes = OPTICAL_AXES if isinstance(frame.geometry, DepthMap) else BODY_AXES
    moved = transform(T_target_source, features[1].surface.points)
    return draw_aligned(features[0].surface.points, moved, axes=axes, panel_width_px=PANEL_PX)


def _as_wide(picture: Picture, width_px: int) -> Picture:
    if picture.shape[1] == width_px:
        return picture
    blank = np.full((picture.shape[0], max(width_px - picture.shape[1] - 6, 1), 3), 250, np.uint8)
    return beside(picture, blank)[:, :width_px]


def _config(arguments: Sequence[str], frame_pair: FramePair) -> Config:
    is_scan = "lidar" in arguments or frame_pair.group == STREET
    return Config.preset("lidar" if is_scan else "rgbd")


def _is_right(row: Row, limits: Limits) -> bool:
    rotation, translation = float(row["rotation_error_deg"]), float(row["translation_error_m"])
    return rotation < limits.recall_deg and translation < limits.recall_m


def _alt(text: str) -> str:
    return f"{text.partition(' (')[0]}: visual matches, and the surfaces from above and from the front"
