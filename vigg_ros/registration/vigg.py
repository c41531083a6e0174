# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""ViGG: registration by visual-geometric mutual guidance (Chen, Yan, Qu; WACV 2026), one call per stage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vigg_ros.acceptance.agreement import Candidate, Pair, assess, inliers_of
from vigg_ros.acceptance.checks import frame_objection, is_supported, search_objection
from vigg_ros.acceptance.ranking import best_and_competitors, can_compete, has_decisive_winner, is_decisive, judge
from vigg_ros.registration.cliques import Hypotheses, distinct, propose
from vigg_ros.registration.config import Config
from vigg_ros.registration.features import Features, alignment, extract
from vigg_ros.registration.geometric import match_global, sample
from vigg_ros.registration.local_match import guided_fit, max_zone_radius_m
from vigg_ros.registration.matches import concatenate, no_matches
from vigg_ros.registration.refinement import Fit, refine
from vigg_ros.registration.result import Evidence, Outcome, Reason, Registration, Rejection
from vigg_ros.registration.stages import OutOfTime, time_limit
from vigg_ros.registration.visual import match_visual

__all__ = ["extract", "register"]


def register(target: Features, source: Features, config: Config) -> Outcome:
    """T_target_source of two frames, or the reason why there is none.

    A pure function: the same features and configuration give the same outcome (but for a time budget, if one
    is set). Bad data does not get here (``Frame`` refuses it); frames that cannot be registered give a
    Rejection, never a transform.
    """
    evidence = Evidence(keypoints=len(source.keypoints))
    try:
        with time_limit(config.time_budget_s):
            return align(target, source, config, evidence)
    except OutOfTime as overrun:
        return Rejection(Reason.TIMEOUT, str(overrun), evidence)


def align(target: Features, source: Features, config: Config, evidence: Evidence) -> Outcome:
    """The algorithm: by the images where they leave no doubt, else by images and shapes together."""
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
    return align_by_all(Pair(target, source, visual, geometric, config, in_full=True), evidence)


def align_by_images(pair: Pair, evidence: Evidence) -> Registration | None:
    """The answer from visual matches alone, where they leave no doubt: then there is nothing to guide.

    Global and local geometric matches cost more than all the rest, and most frames of a sequence do not need
    them: the refinement aligns the surfaces from where a clear clique of visual matches has put them.
    """
    config = pair.config
    hypotheses = propose(pair.visual, pair.geometric, config.cliques)
    few = distinct(hypotheses, 2, config.cliques.inlier_threshold_m)
    if not has_decisive_winner(few, pair.visual, config):
        return None
    evidence = replace(evidence, visual_matches=len(pair.visual), hypotheses=len(hypotheses), candidates=1)
    outcome = judge(pair, polish(pair, [few.T_target_source[0]]), evidence)
    if isinstance(outcome, Rejection) or not is_decisive(outcome.evidence.visual_inliers, len(pair.visual)):
        return None
    return outcome


def align_by_all(pair: Pair, evidence: Evidence) -> Outcome:
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
    return judge(pair, polish(pair, [candidate.T_target_source for candidate in best]), evidence)


def follow(pair: Pair, hypotheses: Hypotheses) -> list[Candidate]:
    """Distinct hypotheses after visual-guided geometric matching, with how the frames agree under them."""
    config = pair.config
    threshold_m = config.cliques.inlier_threshold_m
    few = distinct(hypotheses, config.acceptance.candidates, threshold_m)
    prior = concatenate(pair.visual, pair.geometric) if config.local_match.geometric_prior else pair.visual
    rows = sample(len(pair.source.landmarks), config.geometric.sample_k, config.seed)
    source = pair.source.landmarks.select(rows)
    matcher = pair.target.matcher(max_zone_radius_m(threshold_m, config.local_match))
    candidates: list[Candidate] = []
    if not len(few):
        return candidates
    for T_target_source, score in zip(few.T_target_source, few.score, strict=True):
        # Lesser hypotheses cannot compete with a good answer; they are followed only while there is none.
        if not can_compete(score, few.score[0]) and any(_is_supported(c, config) for c in candidates):
            break
        fitted = guided_fit(matcher, source, prior, T_target_source, threshold_m, config.local_match)
        candidates.append(assess(pair, fitted))
    return candidates


def _is_supported(candidate: Candidate, config: Config) -> bool:
    return is_supported(candidate.described_by(Evidence()), config)


def polish(pair: Pair, motions: Sequence[NDArray[np.float64]]) -> list[Fit]:
    """Each motion (4, 4) with surfaces and visual inliers aligned to the sensor's limit."""
    config = pair.config
    fits = []
    for motion in motions:
        visual = pair.visual.select(inliers_of(pair.visual, motion, config))
        aligned = alignment(pair.target, pair.source, visual, config)
        fits.append(
            refine(aligned, motion, iterations=config.refinement.iterations, voxel_m=config.geometric.voxel_size_m)
        )
    return fits
