# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Verification beyond the paper: an answer must be supported by evidence that did not produce it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vigg_ros.acceptance.agreement import Candidate, Pair, assess, inliers_of, likeness
from vigg_ros.acceptance.repetition import repeated_motion
from vigg_ros.registration.cliques import Hypotheses, differ
from vigg_ros.registration.config import Config
from vigg_ros.registration.features import Features
from vigg_ros.registration.matches import Matches
from vigg_ros.registration.refinement import Fit
from vigg_ros.registration.result import Evidence, Reason, Registration, Rejection

MIN_KEYPOINTS = 8
MIN_PATCHES = 50
"""Below these a frame is not worth a search: the needed inliers could hardly be found."""

MIN_MATCH_SHARE, SHARE_PER_OVERLAP = 0.025, 0.08
"""Share of the matches that must agree: at least, and for each share of surface that coincides. By chance 0.02 do,
where floors and walls of one place are laid on those of another; right answers show 0.03 or more, 0.15 per overlap."""

MIN_PAIRS = 100
"""Points of the surfaces that must pair up in the refinement, or there was nothing to refine with."""

MAX_CONFLICT = 0.2
"""Share of free space in what is seen from which an answer is wrong. Right ones show 1 to 9 % from desks to streets
20 m apart, wrong ones along a street 30 to 50 %; what is hidden from far apart says nothing about either."""

MIN_LIKENESS = 0.3
"""Correlation of the images on the coinciding surface, asked of answers that visual matches do not carry. Right
ones show 0.34 or more from blurred images 7 s apart, one corner of a room laid on another about 0."""

RIVAL_SURFACE, RIVAL_MATCHES = 0.75, 0.6
"""Shares of the best answer's surface balance and of its matches from which another one rivals it."""

CLEAR_INLIERS, CLEAR_SHARE = 20, 0.15
"""Visual matches, and their share, that speak for an answer on their own. Wrong cliques hold up to about a
tenth of the matches where texture repeats; then the surfaces contradict them as well."""

MAX_RIVALS = 3
"""Rivals refined to the end; many of them are the same answer, not yet converged."""

def find_lack(target: Features, source: Features) -> tuple[Reason, str] | None:
    """Why one of the frames cannot be registered at all, if so."""
    for name, features in (("target", target), ("source", source)):
        keypoints, patches = features.keypoints, features.patches
        if len(keypoints) < MIN_KEYPOINTS:
            keypoints = features.fine_keypoints
        if keypoints.detected < MIN_KEYPOINTS:
            found = f"the {name}'s image has {keypoints.detected} keypoints"
            return Reason.NO_TEXTURE, f"{found}, expected at least {MIN_KEYPOINTS}"
        if len(patches) < MIN_PATCHES:
            found = f"the {name} has {len(patches)} patches of surface"
            return Reason.NO_DEPTH, f"{found}, expected at least {MIN_PATCHES}"
        if len(keypoints) < MIN_KEYPOINTS:
            found = f"the {name} has {len(keypoints)} keypoints with depth"
            return Reason.NO_TEXTURE, f"{found}, expected at least {MIN_KEYPOINTS}"
    return None


def contenders(candidates: list[Candidate], config: Config) -> list[Candidate]:
    """The best supported candidate, and the different ones that rival it, best first, MAX_RIVALS at most."""
    ranked = sorted(candidates, key=lambda candidate: -candidate.support)
    rivals = [c for c in ranked[1:] if rivalry(c, ranked[0], config) >= 1.0]
    return [ranked[0], *rivals[:MAX_RIVALS]]


def rivalry(other: Candidate, best: Candidate, config: Config) -> float:
    """How near another answer comes to the best one; from 1 on nothing decides between them.

    A rival must be different, and explain both the surfaces and the matches nearly as well.
    """
    if not differ(other.T_target_source, best.T_target_source, config.cliques.inlier_threshold_m):
        return 0.0
    surface = other.agreement.balance / max(best.agreement.balance, 1e-9) / RIVAL_SURFACE
    matches = other.inliers / max(best.inliers, 1) / RIVAL_MATCHES
    return max(0.0, min(surface, matches))


def is_supported(candidate: Candidate, config: Config) -> bool:
    """Whether surfaces and matches speak for a candidate as much as is asked of an answer."""
    wanted = config.verification
    return (
        candidate.inliers >= wanted.min_inliers
        and candidate.match_share >= _share_asked(candidate)
        and candidate.agreement.overlap >= wanted.min_overlap
        and candidate.agreement.consistency >= wanted.min_consistency
        and candidate.agreement.conflict <= MAX_CONFLICT
    )


def is_clear(few: Hypotheses, visual: Matches, config: Config) -> bool:
    """Whether visual matches alone leave no doubt: many agree with the best of the distinct hypotheses, and
    no other one comes near it."""
    if len(few) == 0 or (len(few) > 1 and few.score[1] >= RIVAL_MATCHES * few.score[0]):
        return False
    return carries(int(np.count_nonzero(inliers_of(visual, few.T_target_source[0], config))), len(visual))


def carries(inliers: int, matches: int) -> bool:
    """Whether so many of the visual matches speak for an answer on their own."""
    return inliers >= max(CLEAR_INLIERS, CLEAR_SHARE * matches)


def judge(pair: Pair, fits: list[Fit], evidence: Evidence) -> Registration | Rejection:
    """The best supported fit as the answer, or the first reason against it."""
    candidates = [assess(pair, fit.T_target_source) for fit in fits]
    best = max(range(len(fits)), key=lambda i: candidates[i].support)
    candidate, fit = candidates[best], fits[best]
    evidence = replace(
        evidence,
        visual_inliers=int(np.count_nonzero(candidate.visual_inliers)),
        geometric_inliers=int(np.count_nonzero(candidate.geometric_inliers)),
        rmse_m=fit.rms_m,
        overlap=candidate.agreement.overlap,
        consistency=candidate.agreement.consistency,
        conflict=candidate.agreement.conflict,
        likeness=_likeness_in_doubt(pair, candidate),
        runner_up=max(rivalry(other, candidate, pair.config) for other in candidates),
    )
    objection = _objection(fit, candidate, evidence, pair.config) or _repetition(pair, candidate)
    if objection is not None:
        return Rejection(*objection, evidence)
    pixels = pair.pixels(pair.visual.select(candidate.visual_inliers))
    return Registration(fit.T_target_source, fit.covariance, evidence, pixels)


def _likeness_in_doubt(pair: Pair, candidate: Candidate) -> float:
    """The likeness where visual matches do not speak for the answer on their own, else NaN."""
    if carries(int(np.count_nonzero(candidate.visual_inliers)), len(candidate.visual_inliers)):
        return math.nan
    return likeness(pair, candidate.T_target_source)


def _share_asked(candidate: Candidate) -> float:
    return max(MIN_MATCH_SHARE, SHARE_PER_OVERLAP * candidate.agreement.overlap)


def _objection(fit: Fit, candidate: Candidate, evidence: Evidence, config: Config) -> tuple[Reason, str] | None:
    wanted = config.verification
    if not np.isfinite(fit.T_target_source).all():
        return Reason.NOT_FINITE, "the fit is not finite"
    free = _free_direction(fit.covariance, config.cliques.inlier_threshold_m)
    if free:
        return Reason.DEGENERATE, free
    if not wanted.enabled:
        return None
    if candidate.inliers < wanted.min_inliers:
        return Reason.TOO_FEW_INLIERS, f"{candidate.inliers} matches agree, expected at least {wanted.min_inliers}"
    if candidate.match_share < _share_asked(candidate):
        return Reason.TOO_FEW_INLIERS, (
            f"{evidence.overlap:.1%} of the surface coincides, but only {candidate.inliers} matches agree: "
            "floor and walls alone fit in more than one way"
        )
    if fit.pairs < MIN_PAIRS:
        return Reason.LOW_OVERLAP, f"{fit.pairs} points of the surfaces pair up, expected at least {MIN_PAIRS}"
    if evidence.overlap < wanted.min_overlap:
        return Reason.LOW_OVERLAP, f"{evidence.overlap:.1%} of the surface coincides, expected {wanted.min_overlap:.1%}"
    if evidence.consistency < wanted.min_consistency:
        return Reason.CONFLICT, (
            f"{evidence.consistency:.1%} of the surface that both should see coincides, "
            f"expected {wanted.min_consistency:.1%}"
        )
    if candidate.agreement.conflict > MAX_CONFLICT:
        return Reason.CONFLICT, (
            f"{candidate.agreement.conflict:.1%} of the surface lies where the other frame saw through, "
            f"expected at most {MAX_CONFLICT:.0%}"
        )
    if evidence.likeness < MIN_LIKENESS:  # which NaN is not
        return Reason.CONFLICT, (
            f"the images show the coinciding surface with a correlation of {evidence.likeness:.2f}, "
            f"expected {MIN_LIKENESS:g}: shapes alone fit in more than one way"
        )
    if evidence.runner_up >= 1.0:
        return Reason.AMBIGUOUS, "a different motion explains surfaces and matches nearly as well"
    return None


def _repetition(pair: Pair, candidate: Candidate) -> tuple[Reason, str] | None:
    """Whether a repeating texture shows another motion, which the surfaces do not contradict."""
    if not pair.config.verification.enabled:
        return None
    T_repeated = repeated_motion(pair, candidate.T_target_source)
    if T_repeated is None:
        return None
    rival = assess(pair, T_repeated).agreement
    if rival.consistency < pair.config.verification.min_consistency or rival.conflict > MAX_CONFLICT:
        return None  # the surfaces know better
    period_m = float(np.linalg.norm(T_repeated[:3, 3] - candidate.T_target_source[:3, 3]))
    return Reason.AMBIGUOUS, f"the texture repeats: a motion that differs by {period_m:.2g} m is shown as well"


def _free_direction(covariance: NDArray[np.float64], threshold_m: float) -> str:
    """In words, a direction that the data leaves free; empty if there is none."""
    deviation_m = float(np.sqrt(np.diag(covariance)[:3].max()))
    deviation_deg = float(np.rad2deg(np.sqrt(np.diag(covariance)[3:].max())))
    if deviation_m <= threshold_m and deviation_deg <= 5.0:
        return ""
    return f"the motion is known to {deviation_m:.3g} m and {deviation_deg:.3g} deg, expected {threshold_m} m and 5 deg"
