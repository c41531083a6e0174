# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Why an answer is refused: the one list of checks. Everything that tells of refusals is made from it.

``vigg.register`` gives the first objection as the Rejection, the report ranks answered frames by the smallest margin,
frames.csv and ~/status have a column for what each check measures, and docs/method.md has the table.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeVar

from vigg_ros.acceptance.agreement import Agreement
from vigg_ros.acceptance.limits import (
    MAX_CONFLICT,
    MAX_CONFLICT_BY_SHAPES,
    MAX_MATCH_LOG10_P,
    MAX_ROTATION_SIGMA,
    MIN_KEYPOINTS,
    MIN_PATCHES,
    MIN_PHOTOMETRIC_CORRELATION,
    MIN_SURFACE_PAIRS,
    Limit,
)
from vigg_ros.registration.config import Config
from vigg_ros.registration.features import Features
from vigg_ros.registration.result import Evidence, Reason

_Subject = TypeVar("_Subject")
Objection = tuple[Reason, str]


@dataclass(frozen=True, slots=True)
class Check(Generic[_Subject]):
    """One rule: what is measured must lie on this side of the limit."""

    reason: Reason
    measured: str
    """Its name; for evidence that of the field and of the column in frames.csv."""
    measure: Callable[[_Subject], float]
    bound: Literal["at least", "at most", "below"]
    limit: Callable[[_Subject, Config], float]
    limit_text: str
    """Where the limit is set, for the table in the docs: an option, or a name in ``limits``."""
    sentence: str
    """What was found and what was expected; a format of {value}, {limit} and {of}, the subject."""
    best: float = math.nan
    """The value beyond which nothing is better, where there is one; for the margin."""
    nan_passes: bool = False
    """Whether an unknown value is no objection."""
    supports: bool = False
    """Whether a hypothesis must pass it to count as supported, so that lesser ones need not be followed."""
    basic: bool = False
    """Whether it holds for the paper's method too, which answers whenever a motion is determined."""

    def passes(self, subject: _Subject, config: Config) -> bool:
        """Whether there is no objection."""
        value, limit = self.measure(subject), self.limit(subject, config)
        if math.isnan(value):
            return self.nan_passes
        return {"at least": value >= limit, "at most": value <= limit, "below": value < limit}[self.bound]

    def objection(self, subject: _Subject, config: Config) -> Objection | None:
        """The reason and a sentence; None if it passes."""
        if self.passes(subject, config):
            return None
        value, limit = self.measure(subject), self.limit(subject, config)
        return self.reason, self.sentence.format(value=value, limit=limit, of=subject)

    def margin(self, subject: _Subject, config: Config) -> float:
        """How far from an objection, in [0, 1]: 0 at the limit, 1 at the best value, or infinitely far from it."""
        value, limit = self.measure(subject), self.limit(subject, config)
        if math.isnan(value) or math.isinf(limit):
            return 1.0
        if self.bound != "at least":
            beyond = 1 - value / limit if limit > 0 else float(value <= limit)
            beyond = max(1 - limit / value, 0.0) if limit < 0 and value < 0 else beyond
        elif math.isnan(self.best):
            beyond = 1 - limit / value if value > 0 else 0.0
        else:
            beyond = (value - limit) / max(self.best - limit, 1e-9)
        return min(max(beyond, 0.0), 1.0)


def _constant(limit: Limit) -> Callable[[object, Config], float]:
    return lambda subject, config: limit.value


def _log10_level(evidence: Evidence, config: Config) -> float:
    return math.log10(config.acceptance.max_false_alarms)


def is_visually_borne(evidence: Evidence, config: Config) -> bool:
    """Whether visual matches speak for an answer beyond chance on their own."""
    return evidence.visual_log10_nfa <= _log10_level(evidence, config)


def _max_conflict(evidence: Evidence, config: Config) -> float:
    return (MAX_CONFLICT if is_visually_borne(evidence, config) else MAX_CONFLICT_BY_SHAPES).value


FRAME_CHECKS: tuple[Check[Features], ...] = (
    Check(
        Reason.NO_TEXTURE, "keypoints", lambda features: features.searched_keypoints(int(MIN_KEYPOINTS.value)).detected,
        "at least", _constant(MIN_KEYPOINTS), "MIN_KEYPOINTS",
        "'s image has {value} keypoints, expected at least {limit}",
    ),
    Check(
        Reason.NO_DEPTH, "patches", lambda features: len(features.patches),
        "at least", _constant(MIN_PATCHES), "MIN_PATCHES",
        " has {value} patches of surface, expected at least {limit}",
    ),
    Check(
        Reason.NO_TEXTURE, "keypoints with depth",
        lambda features: len(features.searched_keypoints(int(MIN_KEYPOINTS.value))),
        "at least", _constant(MIN_KEYPOINTS), "MIN_KEYPOINTS",
        " has {value} keypoints with depth, expected at least {limit}",
    ),
)  # fmt: skip
"""Asked of each of the two frames before anything is searched."""

SEARCH_CHECKS: tuple[Check[Evidence], ...] = (
    Check(
        Reason.TOO_FEW_MATCHES, "candidates", lambda e: e.candidates, "at least", lambda e, config: 1, "by definition",
        "no three of {of.visual_matches} visual and {of.geometric_matches} geometric matches fit one motion",
        basic=True,
    ),
)  # fmt: skip
"""Asked once hypotheses were searched for and followed."""

ANSWER_CHECKS: tuple[Check[Evidence], ...] = (
    Check(
        Reason.NOT_FINITE, "motion_sigma_m", lambda e: e.motion_sigma_m, "at most", lambda e, config: math.inf,
        "by definition", "the fit is not finite", basic=True,
    ),
    Check(
        Reason.DEGENERATE, "motion_sigma_m", lambda e: e.motion_sigma_m,
        "at most", lambda e, config: config.cliques.inlier_threshold_m, "cliques.inlier_threshold_m",
        "the motion is known to {of.motion_sigma_m:.3g} m and {of.motion_sigma_deg:.3g} deg, expected {limit} m and "
        f"{MAX_ROTATION_SIGMA.value:g} deg",
        basic=True,
    ),
    Check(
        Reason.DEGENERATE, "motion_sigma_deg", lambda e: e.motion_sigma_deg,
        "at most", _constant(MAX_ROTATION_SIGMA), "MAX_ROTATION_SIGMA",
        "the rotation is known to {value:.3g} deg, expected {limit:g} deg", basic=True,
    ),
    Check(
        Reason.TOO_FEW_INLIERS, "match_log10_p", lambda e: e.match_log10_p,
        "at most", _constant(MAX_MATCH_LOG10_P), "MAX_MATCH_LOG10_P",
        "{of.inliers} matches agree, as many as by chance with a probability of 10^{value:.1f}, expected at most "
        "10^{limit:.1f}: floor and walls alone fit in more than one way",
    ),
    Check(
        Reason.TOO_FEW_INLIERS, "log10_nfa", lambda e: e.log10_nfa,
        "at most", _log10_level, "acceptance.max_false_alarms",
        "{of.inliers} matches agree and {of.overlap:.1%} of the surface coincides: by chance that is to be expected of "
        "10^{value:.1f} of the motions that were tried, expected at most 10^{limit:.1f}",
    ),
    Check(
        Reason.LOW_OVERLAP, "surface_pairs", lambda e: e.surface_pairs,
        "at least", _constant(MIN_SURFACE_PAIRS), "MIN_SURFACE_PAIRS",
        "{value} points of the surfaces pair up, expected at least {limit}",
    ),
    Check(
        Reason.LOW_OVERLAP, "overlap", lambda e: e.overlap,
        "at least", lambda e, config: config.acceptance.min_overlap, "acceptance.min_overlap",
        "{value:.1%} of the surface coincides, expected {limit:.1%}", best=1.0, supports=True,
    ),
    Check(
        Reason.CONFLICT, "consistency", lambda e: e.consistency,
        "at least", lambda e, config: config.acceptance.min_consistency, "acceptance.min_consistency",
        "{value:.1%} of the surface that both should see coincides, expected {limit:.1%}", best=1.0, supports=True,
    ),
    Check(
        Reason.CONFLICT, "conflict", lambda e: e.conflict, "at most", _max_conflict,
        "MAX_CONFLICT, MAX_CONFLICT_BY_SHAPES",
        "{value:.1%} of the surface lies where the other frame saw through, expected at most {limit:.0%}",
        supports=True,
    ),
    Check(
        Reason.CONFLICT, "photometric_correlation", lambda e: e.photometric_correlation,
        "at least", _constant(MIN_PHOTOMETRIC_CORRELATION), "MIN_PHOTOMETRIC_CORRELATION",
        "the images show the coinciding surface with a correlation of {value:.2f}, expected {limit:g}: "
        "shapes alone fit in more than one way", best=1.0, nan_passes=True,
    ),
    Check(
        Reason.AMBIGUOUS, "lead_log10", lambda e: e.lead_log10,
        "at least", lambda e, config: -_log10_level(e, config), "acceptance.max_false_alarms",
        "a different motion explains surfaces and matches nearly as well: the answer is 10^{value:.1f} times less "
        "likely by chance, expected at least 10^{limit:.1f}",
    ),
    Check(
        Reason.AMBIGUOUS, "repeated_shift_m", lambda e: e.repeated_shift_m,
        "at most", lambda e, config: 0.0, "by definition",
        "the texture repeats: a motion that differs by {value:.2g} m is shown as well", nan_passes=True,
    ),
)  # fmt: skip
"""Asked of an answer."""

CHECKS: tuple[Check[Any], ...] = (*FRAME_CHECKS, *SEARCH_CHECKS, *ANSWER_CHECKS)
"""All of them, in the order in which they are asked; the first objection is the reason that is given."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """A reason in words, for people."""

    meaning: str
    remedy: str


EXPLANATIONS: dict[Reason, Explanation] = {
    Reason.NO_TEXTURE: Explanation(
        "Too few distinct spots in the image that have depth: a bare wall, darkness or blur.",
        "add light, shorten the exposure, or let the camera see more of the scene",
    ),
    Reason.NO_DEPTH: Explanation(
        "Too few 3-D points: is depth missing, out of range, in another unit, or a scan outside the image?",
        "check the depth camera or scanner, its range, depth_scale and geometric.max_range_m",
    ),
    Reason.TOO_FEW_MATCHES: Explanation(
        "The frame has too little in common with the keyframes it was compared with.",
        "move more slowly, or come back to a place that was seen before",
    ),
    Reason.TOO_FEW_INLIERS: Explanation(
        "Too few matches agree with the best motion that was found.",
        "move more slowly, or come back to a place that was seen before",
    ),
    Reason.DEGENERATE: Explanation(
        "What both frames see leaves a direction of motion open, as along a bare corridor.",
        "let the sensor see corners, furniture or texture, not one flat surface",
    ),
    Reason.LOW_OVERLAP: Explanation(
        "Too little of the surfaces coincides: the view changed too much, or the motion is wrong.",
        "move more slowly, or lower keyframes.max_translation_m and keyframes.max_rotation_deg",
    ),
    Reason.CONFLICT: Explanation(
        "Surfaces lie where the other frame saw none: things moved, or the motion is wrong.",
        "keep moving things and the robot's own body out of the view; check calibration and depth_scale",
    ),
    Reason.AMBIGUOUS: Explanation(
        "Another motion explains the frames nearly as well, as where shapes and textures repeat.",
        "let the sensor see something that occurs once",
    ),
    Reason.TIMEOUT: Explanation(
        "The time budget was used up before there was an answer.",
        "raise time_budget_s (0 for none), or lower geometric.sample_k and visual.max_keypoints",
    ),
    Reason.NOT_FINITE: Explanation(
        "The numbers ran out of bounds.", "please report this with the two frames"
    ),
}


def frame_objection(target: Features, source: Features, config: Config) -> Objection | None:
    """Why one of the frames cannot be registered at all, if so."""
    for name, features in (("target", target), ("source", source)):
        for check in FRAME_CHECKS:
            objection = check.objection(features, config)
            if objection is not None:
                return objection[0], f"the {name}{objection[1]}"
    return None


def search_objection(evidence: Evidence, config: Config) -> Objection | None:
    """Why there is nothing that could be an answer, if so."""
    return _first_objection(SEARCH_CHECKS, evidence, config)


def answer_objection(evidence: Evidence, config: Config) -> Objection | None:
    """The first reason against an answer with this evidence; only basic ones where acceptance is off."""
    return _first_objection(_asked(config), evidence, config)


def answer_margin(evidence: Evidence, config: Config) -> float:
    """How far an answer is from refusal by the nearest of its checks, in [0, 1]."""
    return min(check.margin(evidence, config) for check in _asked(config))


def is_supported(evidence: Evidence, config: Config) -> bool:
    """Whether the surfaces speak for a hypothesis as much as is asked of an answer."""
    return all(check.passes(evidence, config) for check in ANSWER_CHECKS if check.supports)


def surfaces_allow(agreement: Agreement, config: Config) -> bool:
    """Whether the surfaces do not contradict a motion."""
    return agreement.consistency >= config.acceptance.min_consistency and agreement.conflict <= MAX_CONFLICT.value


def _first_objection(checks: Iterable[Check[Evidence]], evidence: Evidence, config: Config) -> Objection | None:
    found = (check.objection(evidence, config) for check in checks)
    return next((objection for objection in found if objection is not None), None)


def _asked(config: Config) -> Iterable[Check[Evidence]]:
    return (check for check in ANSWER_CHECKS if check.basic or config.acceptance.enabled)
