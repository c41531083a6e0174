# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which hypotheses compete, and the verdict on the best of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vigg_ros.acceptance.agreement import Candidate, Pair, assess, inliers_of, photometric_correlation
from vigg_ros.acceptance.checks import answer_objection
from vigg_ros.acceptance.limits import (
    COMPETING_MATCH_SHARE,
    COMPETING_SURFACE_SHARE,
    DECISIVE_VISUAL_INLIERS,
    DECISIVE_VISUAL_SHARE,
    MAX_CONFLICT,
    MAX_RUNNER_UP,
)
from vigg_ros.acceptance.repetition import repeated_motion
from vigg_ros.registration.cliques import Hypotheses, differ
from vigg_ros.registration.config import Config
from vigg_ros.registration.matches import Matches
from vigg_ros.registration.refinement import Fit
from vigg_ros.registration.result import Evidence, Registration, Rejection

MAX_COMPETITORS = 3
"""Competitors refined to the end; many of them are the same answer, not yet converged."""


def best_and_competitors(candidates: list[Candidate], config: Config) -> list[Candidate]:
    """The best supported candidate, and the different ones that compete with it, best first."""
    ranked = sorted(candidates, key=lambda candidate: -candidate.support)
    competitors = [c for c in ranked[1:] if competition(c, ranked[0], config) >= MAX_RUNNER_UP.value]
    return [ranked[0], *competitors[:MAX_COMPETITORS]]


def competition(other: Candidate, best: Candidate, config: Config) -> float:
    """How near another answer comes to the best one; from 1 on nothing decides between them.

    A competitor must be different, and explain both the surfaces and the matches nearly as well.
    """
    if not differ(other.T_target_source, best.T_target_source, config.cliques.inlier_threshold_m):
        return 0.0
    surface = other.agreement.balance / max(best.agreement.balance, 1e-9) / COMPETING_SURFACE_SHARE.value
    matches = other.inliers / max(best.inliers, 1) / COMPETING_MATCH_SHARE.value
    return max(0.0, min(surface, matches))


def can_compete(score: float, best_score: float) -> bool:
    """Whether a hypothesis of this score may still compete with the best one once it is followed."""
    return score >= COMPETING_MATCH_SHARE.value * best_score


def has_decisive_winner(few: Hypotheses, visual: Matches, config: Config) -> bool:
    """Whether visual matches alone leave no doubt: many agree with the best of the distinct hypotheses, and
    no other one comes near it."""
    if len(few) == 0 or (len(few) > 1 and can_compete(few.score[1], few.score[0])):
        return False
    return is_decisive(int(np.count_nonzero(inliers_of(visual, few.T_target_source[0], config))), len(visual))


def is_decisive(inliers: int, matches: int) -> bool:
    """Whether so many of the visual matches speak for an answer on their own."""
    return inliers >= max(DECISIVE_VISUAL_INLIERS.value, DECISIVE_VISUAL_SHARE.value * matches)


def judge(pair: Pair, fits: list[Fit], evidence: Evidence) -> Registration | Rejection:
    """The best supported fit as the answer, or the first objection to it; see ``checks``."""
    candidates = [assess(pair, fit.T_target_source) for fit in fits]
    best = max(range(len(fits)), key=lambda i: candidates[i].support)
    candidate, fit = candidates[best], fits[best]
    sigma_m, sigma_deg = _motion_sigma(fit)
    evidence = replace(
        candidate.described_by(evidence),
        surface_pairs=fit.pairs,
        rmse_m=fit.rms_m,
        motion_sigma_m=sigma_m,
        motion_sigma_deg=sigma_deg,
        photometric_correlation=_correlation_in_doubt(pair, candidate),
        runner_up=max(competition(other, candidate, pair.config) for other in candidates),
    )
    objection = answer_objection(evidence, pair.config)
    if objection is None and pair.config.acceptance.enabled:  # a search, so only of what would be an answer
        evidence = replace(evidence, repeated_shift_m=_repeated_shift_m(pair, candidate))
        objection = answer_objection(evidence, pair.config)
    if objection is not None:
        return Rejection(*objection, evidence)
    pixels = pair.pixels(pair.visual.select(candidate.visual_inliers))
    return Registration(fit.T_target_source, fit.covariance, evidence, pixels)


def _motion_sigma(fit: Fit) -> tuple[float, float]:
    """Largest standard deviations of translation (m) and rotation (deg); NaN where the fit is not finite."""
    if not np.isfinite(fit.T_target_source).all():
        return math.nan, math.nan
    variance: NDArray[np.float64] = np.diag(fit.covariance)
    return float(np.sqrt(variance[:3].max())), float(np.rad2deg(np.sqrt(variance[3:].max())))


def _correlation_in_doubt(pair: Pair, candidate: Candidate) -> float:
    """The photometric correlation where visual matches do not speak for the answer on their own, else NaN."""
    if is_decisive(int(np.count_nonzero(candidate.visual_inliers)), len(candidate.visual_inliers)):
        return math.nan
    return photometric_correlation(pair, candidate.T_target_source)


def _repeated_shift_m(pair: Pair, candidate: Candidate) -> float:
    """Distance to another motion that a repeating texture shows and the surfaces do not contradict; else NaN."""
    T_repeated = repeated_motion(pair, candidate.T_target_source)
    if T_repeated is None:
        return math.nan
    other = assess(pair, T_repeated).agreement
    if other.consistency < pair.config.acceptance.min_consistency or other.conflict > MAX_CONFLICT.value:
        return math.nan  # the surfaces know better
    return float(np.linalg.norm(T_repeated[:3, 3] - candidate.T_target_source[:3, 3]))
