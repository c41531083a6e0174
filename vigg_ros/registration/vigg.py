# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""ViGG: registration by visual-geometric mutual guidance (Chen, Yan, Qu; WACV 2026), one call per stage."""

from __future__ import annotations

from dataclasses import replace

from vigg_ros.acceptance.agreement import Candidate, Pair, assess
from vigg_ros.acceptance.checks import frame_objection, is_supported, is_visually_borne, search_objection
from vigg_ros.acceptance.ranking import (
    best_and_competitors,
    by_significance,
    has_decisive_winner,
    images_show_another,
    judge,
    needed_log10,
    polish,
)
from vigg_ros.acceptance.static_part import MAX_MOVING_SHARE, is_possible, region_of
from vigg_ros.registration.cliques import MIN_SCORE_RATIO, Hypotheses, differ, distinct, propose
from vigg_ros.registration.config import Config
from vigg_ros.registration.features import Features, extract
from vigg_ros.registration.geometric import match_global, sample
from vigg_ros.registration.local_match import guided_fit, max_zone_radius_m
from vigg_ros.registration.matches import concatenate, no_matches
from vigg_ros.registration.result import Evidence, Outcome, Reason, Registration, Rejection
from vigg_ros.registration.stages import OutOfTime, time_limit
from vigg_ros.registration.visual import match_visual

__all__ = ["extract", "register"]

FOLLOWED_FIRST = 3
"""The best hypotheses by both kinds of matches, by the visual and by the geometric ones, are followed in any case."""


def register(target: Features, source: Features, config: Config) -> Outcome:
    """T_target_source of two frames, or the reason why there is none.

    A pure function: the same features and configuration give the same outcome (but for a time budget, if one
    is set). Bad data does not get here (``Frame`` refuses it); frames that cannot be registered give a
    Rejection, never a transform.
    """
    evidence = Evidence(keypoints=len(source.keypoints))
    try:
        with time_limit(config.time_budget_s):
            outcome = align(target, source, config, evidence)
            return outcome if isinstance(outcome, Registration) else align_static_part(target, source, config, outcome)
    except OutOfTime as overrun:
        return Rejection(Reason.TIMEOUT, str(overrun), evidence)


def align(
    target: Features, source: Features, config: Config, evidence: Evidence, *, is_part: bool = False
) -> Outcome:
    """The algorithm: by the images where they leave no doubt, else by images and shapes together.

    ``is_part`` where the part of the view that moves as another motion was taken out: its rims still show that one.
    """
    objection = frame_objection(target, source, config)
    if objection:
        return Rejection(*objection, evidence)
    if config.acceptance.enabled and not config.geometric.always:
        visual = match_visual(target.keypoints, source.keypoints, config.visual)
        answer = align_by_images(Pair(target, source, visual, no_matches(), config), evidence)
        if answer is not None:
            return answer
    visual = match_visual(target.fine_keypoints, source.fine_keypoints, config.visual)  # C_vis
    geometric = match_global(target.landmarks, source.landmarks, config.geometric, seed=config.seed)  # C_geo
    return align_by_all(Pair(target, source, visual, geometric, config, in_full=True), evidence, is_part=is_part)


def align_by_images(pair: Pair, evidence: Evidence) -> Registration | None:
    """The answer from visual matches alone, where they leave no doubt: then there is nothing to guide.

    Global and local geometric matches cost more than all the rest, and most frames of a sequence do not need
    them: the refinement aligns the surfaces from where a clear clique of visual matches has put them.
    """
    config = pair.config
    hypotheses = propose(pair.visual, pair.geometric, config.cliques)
    few = distinct(hypotheses, 2, config.cliques.inlier_threshold_m)
    if not has_decisive_winner(pair, few):
        return None
    evidence = replace(evidence, visual_matches=len(pair.visual), hypotheses=len(hypotheses), candidates=1)
    outcome = judge(pair, polish(pair, [few.T_target_source[0]]), evidence)
    if isinstance(outcome, Rejection) or not is_visually_borne(outcome.evidence, config):
        return None
    return outcome


def align_by_all(pair: Pair, evidence: Evidence, *, is_part: bool = False) -> Outcome:
    """The answer by mutual guidance of visual and geometric matches."""
    hypotheses = propose(pair.visual, pair.geometric, pair.config.cliques)  # GVCA
    candidates = follow(pair, hypotheses)  # VGM
    evidence = replace(
        evidence,
        visual_matches=len(pair.visual),
        geometric_matches=len(pair.geometric),
        hypotheses=len(hypotheses),
        candidates=len(candidates),
    )
    objection = search_objection(evidence, pair.config)
    if objection:
        return Rejection(*objection, evidence)
    best = best_and_competitors(candidates, pair.config)
    outcome = judge(pair, polish(pair, [candidate.T_target_source for candidate in best]), evidence)
    if isinstance(outcome, Registration) and not is_part and images_show_another(outcome, candidates, pair):
        what = "the images show, beyond chance, that most of the view moves otherwise, expected the answer"
        return Rejection(Reason.CONFLICT, what, outcome.evidence)
    return outcome


def align_static_part(target: Features, source: Features, config: Config, refused: Rejection) -> Outcome:
    """The answer of the larger part of the view, where the images show beyond chance that two parts move differently.

    One part is what coincides under the motion that most visual matches show: the own body, a thing that is carried
    past, or the world. The other is what contradicts it. Each must be an answer of its own without the other.
    """
    is_settled = refused.reason is Reason.AMBIGUOUS or frame_objection(target, source, config) is not None
    if not (config.acceptance.enabled and is_possible(target, source)) or is_settled:
        return refused
    visual = match_visual(target.fine_keypoints, source.fine_keypoints, config.visual)
    pair = Pair(target, source, visual, no_matches(), config, in_full=True)
    seen = by_significance(pair, propose(visual, no_matches(), config.cliques))
    if not len(seen):
        return refused
    first = assess(pair, polish(pair, [seen.T_target_source[0]])[0].T_target_source)
    if not is_visually_borne(first.described_by(Evidence()), config):
        return refused
    evidence = Evidence(keypoints=len(source.keypoints))
    answers: dict[float, Outcome] = {first.agreement.overlap * (len(target.patches) + len(source.patches)): refused}
    for coinciding in (True, False):
        region = region_of(pair, first.T_target_source, coinciding=coinciding)
        if not 0.0 < region.share < MAX_MOVING_SHARE:
            continue
        rest = [extract(frame, config) for frame in region.removed_from(pair)]
        outcome = align(rest[0], rest[1], config, evidence, is_part=True)
        if isinstance(outcome, Registration):
            is_other = differ(outcome.T_target_source, first.T_target_source, config.cliques.inlier_threshold_m)
            if is_other == coinciding and (is_other or is_visually_borne(outcome.evidence, config)):
                answers[outcome.evidence.overlap * sum(len(features.patches) for features in rest)] = outcome
    return answers[max(answers)]


def follow(pair: Pair, hypotheses: Hypotheses) -> list[Candidate]:
    """Distinct hypotheses after visual-guided geometric matching, with how the frames agree under them."""
    config = pair.config
    threshold_m = config.cliques.inlier_threshold_m
    if config.acceptance.enabled:
        hypotheses = by_significance(pair, hypotheses)
    min_ratio = 0.0 if config.acceptance.enabled else MIN_SCORE_RATIO
    few = distinct(hypotheses, config.acceptance.candidates, threshold_m, min_ratio)
    prior = concatenate(pair.visual, pair.geometric) if config.local_match.geometric_prior else pair.visual
    rows = sample(len(pair.source.landmarks), config.geometric.sample_k, config.seed)
    source = pair.source.landmarks.select(rows)
    matcher = pair.target.matcher(max_zone_radius_m(threshold_m, config.local_match))
    candidates: list[Candidate] = []
    if not len(few):
        return candidates
    for T_target_source, score in zip(few.T_target_source, few.score, strict=True):
        # Lesser hypotheses cannot compete with a good answer; they are followed only while there is none.
        if len(candidates) >= FOLLOWED_FIRST and any(_is_settled(c, score, config) for c in candidates):
            break
        fitted = guided_fit(matcher, source, prior, T_target_source, threshold_m, config.local_match)
        candidates.append(assess(pair, fitted))
    return candidates


def _is_settled(candidate: Candidate, score: float, config: Config) -> bool:
    """Whether a candidate speaks for itself so much that a hypothesis of this score cannot compete with it."""
    lead = -candidate.match_tail - score
    return lead >= needed_log10(config) and is_supported(candidate.described_by(Evidence()), config)
