# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""ViGG: registration by visual-geometric mutual guidance (Chen, Yan, Qu; WACV 2026), one call per stage."""

from __future__ import annotations

from dataclasses import replace

from vigg_ros.registration.cliques import Hypotheses, distinct, propose
from vigg_ros.registration.config import Config
from vigg_ros.registration.features import Features, extract
from vigg_ros.registration.geometric import match_global, sample
from vigg_ros.registration.local_match import LocalMatcher, guided_fit, max_zone_radius_m
from vigg_ros.registration.matches import concatenate, no_matches
from vigg_ros.registration.refinement import Fit, SurfaceAligner, refine
from vigg_ros.registration.result import Evidence, Outcome, Reason, Registration, Rejection
from vigg_ros.registration.verification import (
    RIVAL_MATCHES,
    Candidate,
    Pair,
    assess,
    contenders,
    find_lack,
    is_clear,
    is_clear_answer,
    is_supported,
    judge,
)
from vigg_ros.registration.visual import match_visual

__all__ = ["extract", "register"]


def register(target: Features, source: Features, config: Config) -> Outcome:
    """T_target_source of two frames, or the reason why there is none.

    A pure function: the same features and configuration give the same outcome. Bad data does not get
    here (``Frame`` refuses it); frames that cannot be registered give a Rejection, never a transform.
    """
    evidence = Evidence(keypoints=len(source.keypoints))
    lack = find_lack(target, source)
    if lack:
        return Rejection(*lack, evidence)

    visual = match_visual(target.keypoints, source.keypoints, config.visual)  # C_vis
    pair = Pair(target, source, visual, no_matches(), config)
    if config.verification.enabled and not config.geometric.always:
        answer = align_by_images(pair, evidence)
        if answer is not None:
            return answer
    geometric = match_global(target.landmarks, source.landmarks, config.geometric, seed=config.seed)  # C_geo
    return align(replace(pair, geometric=geometric), evidence)


def align(pair: Pair, evidence: Evidence) -> Outcome:
    """The answer from all matches."""
    hypotheses = propose(pair.visual, pair.geometric, pair.config.cliques)  # GVCA
    candidates = follow(pair, hypotheses)  # VGM
    evidence = replace(
        evidence,
        visual_matches=len(pair.visual),
        geometric_matches=len(pair.geometric),
        hypotheses=len(hypotheses),
        candidates=len(candidates),
    )
    if not candidates:
        found = f"no three of {len(pair.visual)} visual and {len(pair.geometric)} geometric matches fit one motion"
        return Rejection(Reason.TOO_FEW_MATCHES, found, evidence)
    return judge(pair, polish(pair, contenders(candidates, pair.config)), evidence)


def align_by_images(pair: Pair, evidence: Evidence) -> Registration | None:
    """The answer from visual matches alone, where they leave no doubt: then there is nothing to guide.

    Global geometric matches cost as much as all the rest, and most frames of a sequence do not need them.
    """
    hypotheses = propose(pair.visual, pair.geometric, pair.config.cliques)
    candidates = follow(pair, hypotheses)
    if not is_clear(candidates, pair.config):
        return None
    evidence = replace(
        evidence, visual_matches=len(pair.visual), hypotheses=len(hypotheses), candidates=len(candidates)
    )
    outcome = judge(pair, polish(pair, contenders(candidates, pair.config)), evidence)
    return outcome if isinstance(outcome, Registration) and is_clear_answer(outcome) else None


def follow(pair: Pair, hypotheses: Hypotheses) -> list[Candidate]:
    """Distinct hypotheses after visual-guided geometric matching, with how the frames agree under them."""
    config = pair.config
    threshold_m = config.cliques.inlier_threshold_m
    few = distinct(hypotheses, config.verification.candidates, threshold_m)
    prior = concatenate(pair.visual, pair.geometric) if config.local_match.geometric_prior else pair.visual
    matcher = LocalMatcher(pair.target.landmarks, max_zone_radius_m(threshold_m, config.local_match))
    rows = sample(len(pair.source.landmarks), config.geometric.sample_k, config.seed)
    source = pair.source.landmarks.select(rows)
    candidates: list[Candidate] = []
    if not len(few):
        return candidates
    for T_target_source, score in zip(few.T_target_source, few.score, strict=True):
        # Lesser hypotheses cannot rival a good answer; they are followed only while there is none.
        if score < RIVAL_MATCHES * few.score[0] and any(is_supported(c, config) for c in candidates):
            break
        fitted = guided_fit(matcher, source, prior, T_target_source, threshold_m, config.local_match)
        candidates.append(assess(pair, fitted))
    return candidates


def polish(pair: Pair, candidates: list[Candidate]) -> list[Fit]:
    """The candidates with their surfaces and visual inliers aligned to the sensor's limit."""
    config = pair.config
    aligner = SurfaceAligner(pair.target.surface, config.geometric.voxel_size_m)
    source = pair.source.surface.select(sample(len(pair.source.surface), config.geometric.sample_k, config.seed))
    return [
        refine(aligner, source, pair.visual.select(candidate.visual_inliers), candidate.T_target_source, config)
        for candidate in candidates
    ]
