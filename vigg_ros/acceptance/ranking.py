# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which hypotheses are followed, which compete, and the verdict on the best of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vigg_ros.acceptance.agreement import (
    Candidate,
    Pair,
    assess,
    chances_of,
    inliers_of,
    photometric_correlation,
    seen_cells,
    surface_tail,
    visual_false_alarms,
)
from vigg_ros.acceptance.aliases import aliases
from vigg_ros.acceptance.checks import answer_objection, is_visually_borne, surfaces_allow
from vigg_ros.acceptance.limits import (
    CLEAR_VISUAL_SHARE,
    MAX_CONFLICT_BY_SHAPES,
    MAX_MATCH_LOG10_P,
    PHOTOMETRIC_LEAD,
)
from vigg_ros.acceptance.repetition import repeated_motion, shifted_motion
from vigg_ros.acceptance.significance import log10_joint, log10_tail
from vigg_ros.acceptance.static_part import MAX_MOVING_SHARE, is_possible, region_of
from vigg_ros.registration.cliques import Hypotheses, differ
from vigg_ros.registration.config import Config
from vigg_ros.registration.features import alignment
from vigg_ros.registration.refinement import Fit, refine
from vigg_ros.registration.result import Evidence, Registration, Rejection
from vigg_ros.registration.stages import stage

MAX_COMPETITORS = 2
"""Competitors refined to the end, of the candidates and of the aliases each."""

PRECISE_VISUAL_INLIERS = 30
"""Fewer may be beyond doubt and still leave the motion imprecise; the image in full size shows more."""

CHANCE_SAMPLES = 8
"""Hypotheses at which chance is measured to rank all of them: it depends little on the motion."""

MIN_CHANCE = 0.005
"""Chance of each outcome for a cell of surface at least: a hundred tried motions do not show rarer ones."""


def polish(pair: Pair, motions: Sequence[NDArray[np.float64]]) -> list[Fit]:
    """Each motion (4, 4) with surfaces and visual inliers aligned to the sensor's limit."""
    config = pair.config
    fits = []
    for motion in motions:
        inliers = inliers_of(pair.visual, motion, config)
        if config.acceptance.enabled and visual_false_alarms(pair, motion, inliers) > 0:
            inliers[:] = False  # as many agree with some motion by chance: they tell nothing of this one
        aligned = alignment(pair.target, pair.source, pair.visual.select(inliers), config)
        fits.append(
            refine(aligned, motion, iterations=config.refinement.iterations, voxel_m=config.geometric.voxel_size_m)
        )
    return fits


@stage("ranking")
def by_significance(pair: Pair, hypotheses: Hypotheses) -> Hypotheses:
    """The hypotheses by how little the agreement of all their matches is chance; scores are -log10 P.

    First come the best by visual matches and the best by geometric ones: where one kind is mostly wrong, what is right
    by the other drowns in the sum.
    """
    if len(hypotheses) == 0:
        return hypotheses
    motions = hypotheses.T_target_source
    chances = np.mean([chances_of(pair, T) for T in motions[:CHANCE_SAMPLES]], axis=0)
    tails = []
    for matches, weights, chance in zip(
        (pair.visual, pair.geometric), (pair.visual_weights, pair.geometric_weights), chances, strict=True
    ):
        agreeing = np.array([inliers_of(matches, T, pair.config) @ weights for T in motions])
        tails.append(-log10_tail(agreeing, float(weights.sum()), float(chance)))
    score = tails[0] + tails[1]
    order = np.argsort(-score, kind="stable")
    first = dict.fromkeys((order[0], tails[0].argmax(), tails[1].argmax()))
    order = np.array([*first, *(i for i in order if i not in first)])
    return Hypotheses(motions[order], score[order])


def needed_log10(config: Config) -> float:
    """How many powers of ten less likely by chance an answer must be, by the level that the user sets."""
    return -math.log10(config.acceptance.max_false_alarms)


def best_and_competitors(candidates: list[Candidate], config: Config) -> list[Candidate]:
    """The best supported candidate, and the different ones that the surfaces allow, best first."""
    ranked = sorted(candidates, key=_rank)
    others = [c for c in ranked[1:] if _differ(c, ranked[0], config) and surfaces_allow(c.agreement, config)]
    return [ranked[0], *others[:MAX_COMPETITORS]]


def _rank(candidate: Candidate) -> tuple[bool, float]:
    """Sorts by support, but those that matches speak for first: surfaces alone coincide nearly everywhere."""
    return candidate.match_log10_p > MAX_MATCH_LOG10_P.value, -candidate.support


def _differ(one: Candidate, other: Candidate, config: Config) -> bool:
    return differ(one.T_target_source, other.T_target_source, config.cliques.inlier_threshold_m)


def has_decisive_winner(pair: Pair, few: Hypotheses) -> bool:
    """Whether visual matches alone leave no doubt: they agree with the best hypothesis beyond chance, and those that do
    not agree with it show no other motion; and they are enough to be precise."""
    if len(few) == 0:
        return False
    inliers = [inliers_of(pair.visual, T, pair.config) for T in few.T_target_source[:2]]
    level = -needed_log10(pair.config)
    if np.count_nonzero(inliers[0]) < PRECISE_VISUAL_INLIERS:
        return False
    if visual_false_alarms(pair, few.T_target_source[0], inliers[0]) > level:
        return False
    return len(few) == 1 or visual_false_alarms(pair, few.T_target_source[1], inliers[1] & ~inliers[0]) > level


def images_show_another(answer: Registration, candidates: Sequence[Candidate], pair: Pair) -> bool:
    """Whether visual matches show, beyond chance, that most of the view moves otherwise than an answer by shapes."""
    config = pair.config
    can_part = config.acceptance.enabled and is_possible(pair.target, pair.source)
    if not can_part or is_visually_borne(answer.evidence, config):
        return False
    threshold_m, level = config.cliques.inlier_threshold_m, -needed_log10(config)
    others = [
        candidate.T_target_source for candidate in candidates
        if candidate.visual_log10_nfa <= level
        and differ(candidate.T_target_source, answer.T_target_source, threshold_m)
    ]
    return any(region_of(pair, T, coinciding=True).share >= MAX_MOVING_SHARE for T in others)


def judge(pair: Pair, fits: list[Fit], evidence: Evidence) -> Registration | Rejection:
    """The best supported fit as the answer, or the first objection to it; see ``checks``."""
    candidates = [assess(pair, fit.T_target_source) for fit in fits]
    best = min(range(len(fits)), key=lambda i: _rank(candidates[i]))
    candidate, fit = candidates[best], fits[best]
    sigma_m, sigma_deg = _motion_sigma(fit)
    evidence = replace(
        candidate.described_by(evidence),
        surface_pairs=fit.pairs,
        rmse_m=fit.rms_m,
        motion_sigma_m=sigma_m,
        motion_sigma_deg=sigma_deg,
        log10_nfa=candidate.visual_log10_nfa,
        lead_log10=_lead_by_images(pair, candidate, candidates),
    )
    if not pair.config.acceptance.enabled:
        return _verdict(pair, candidate, fit, evidence)
    if is_visually_borne(evidence, pair.config) and not _is_doubtful(candidate):
        evidence = replace(evidence, repeated_shift_m=_repeated_shift_m(pair, candidate))
    elif answer_objection(replace(evidence, log10_nfa=-math.inf), pair.config) is None:
        evidence = _with_doubt(pair, candidate, candidates, evidence)
    return _verdict(pair, candidate, fit, evidence)


def _is_doubtful(candidate: Candidate) -> bool:
    """Whether an answer that images carry must win against its aliases all the same.

    So it is where surfaces contradict it, and where most matches do: they may have chosen among the copies of what
    repeats.
    """
    share = float(np.mean(candidate.visual_inliers)) if len(candidate.visual_inliers) else 0.0
    return candidate.agreement.conflict > MAX_CONFLICT_BY_SHAPES.value or share < CLEAR_VISUAL_SHARE.value


def _verdict(pair: Pair, candidate: Candidate, fit: Fit, evidence: Evidence) -> Registration | Rejection:
    objection = answer_objection(evidence, pair.config)
    if objection is not None:
        return Rejection(*objection, evidence)
    pixels = pair.pixels(pair.visual.select(candidate.visual_inliers))
    return Registration(fit.T_target_source, fit.covariance, evidence, pixels)


def _with_doubt(pair: Pair, candidate: Candidate, others: list[Candidate], evidence: Evidence) -> Evidence:
    """The evidence for an answer that images alone do not carry: against what its aliases show."""
    tried = aliases(pair, candidate.T_target_source)
    cells = np.array([seen_cells(pair, T) for T in tried])
    chances = np.maximum(cells.sum(axis=0) / max(float(cells.sum()), 1e-9), MIN_CHANCE)
    tails = [surface_tail(cell, chances) for cell in cells]
    # What lies off along two axes at once is found from the best along one.
    further = aliases(pair, tried[int(np.argmin(tails))])
    tails += [surface_tail(seen_cells(pair, T), chances) for T in further]
    tried += further
    different = [i for i, T in enumerate(tried) if differ(T, candidate.T_target_source, _threshold_m(pair))]
    nearest = sorted(different, key=lambda i: tails[i])[:MAX_COMPETITORS]
    refined = [assess(pair, fit.T_target_source) for fit in polish(pair, [tried[i] for i in nearest])]
    rivals = [c for c in (*others, *refined) if _differ(c, candidate, pair.config)]
    tests = math.log10(max(evidence.hypotheses, 1))
    nfa = [tests + log10_joint(c.tails(chances)) for c in (candidate, *rivals)]
    correlation = photometric_correlation(pair, candidate.T_target_source)
    lead = evidence.lead_log10
    for rival, rival_nfa in zip(rivals, nfa[1:], strict=True):
        lead = min(lead, sum(rival.tails(chances)) - sum(candidate.tails(chances)))
        is_sound = rival_nfa <= -needed_log10(pair.config) and surfaces_allow(rival.agreement, pair.config)
        # Matches of what repeats choose one of the copies together; the images must not prefer another one.
        if is_sound and rival.agreement.conflict <= MAX_CONFLICT_BY_SHAPES.value:
            shown = photometric_correlation(pair, rival.T_target_source)
            lead = min(lead, 0.0) if shown >= correlation - PHOTOMETRIC_LEAD.value else lead
    return replace(
        evidence,
        log10_nfa=min(evidence.visual_log10_nfa, nfa[0]),
        lead_log10=lead,
        photometric_correlation=correlation,
        repeated_shift_m=_repeated_shift_m(pair, candidate),
    )


def _lead_by_images(pair: Pair, best: Candidate, candidates: list[Candidate]) -> float:
    """log10 of the false alarms of the visual matches that only another answer explains; inf where there is none."""
    others = [c for c in candidates if _differ(c, best, pair.config) and surfaces_allow(c.agreement, pair.config)]
    alone = (visual_false_alarms(pair, c.T_target_source, c.visual_inliers & ~best.visual_inliers) for c in others)
    return min((2 * needed_log10(pair.config) + value for value in alone), default=math.inf)


def _motion_sigma(fit: Fit) -> tuple[float, float]:
    """Largest standard deviations of translation (m) and rotation (deg); NaN where the fit is not finite."""
    if not np.isfinite(fit.T_target_source).all():
        return math.nan, math.nan
    variance: NDArray[np.float64] = np.diag(fit.covariance)
    return float(np.sqrt(variance[:3].max())), float(np.rad2deg(np.sqrt(variance[3:].max())))


def _repeated_shift_m(pair: Pair, candidate: Candidate) -> float:
    """Distance to another motion that the images show as well and the surfaces do not contradict; else NaN."""
    if candidate.visual_log10_nfa > -needed_log10(pair.config):
        return math.nan  # the images have not chosen the answer, so neither have they chosen among copies
    for find in (repeated_motion, shifted_motion):
        T_repeated = find(pair, candidate.T_target_source)
        if T_repeated is not None and surfaces_allow(assess(pair, T_repeated).agreement, pair.config):
            return float(np.linalg.norm(T_repeated[:3, 3] - candidate.T_target_source[:3, 3]))
    return math.nan  # nothing repeats, or the surfaces know better


def _threshold_m(pair: Pair) -> float:
    return pair.config.cliques.inlier_threshold_m
