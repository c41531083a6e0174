# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Verification beyond the paper: an answer must be supported by evidence that did not produce it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.cliques import differ
from vigg_ros.registration.config import Config
from vigg_ros.registration.features import Features
from vigg_ros.registration.matches import Matches
from vigg_ros.registration.refinement import Fit
from vigg_ros.registration.result import Evidence, Reason, Registration, Rejection
from vigg_ros.registration.rigid import inverse, transform
from vigg_ros.registration.stages import stage
from vigg_ros.registration.visibility import Agreement, agreement

MIN_KEYPOINTS = 8
MIN_LANDMARKS = 50
"""Below these a frame is not worth a search: the needed inliers could hardly be found."""

MIN_MATCH_SHARE, SHARE_PER_OVERLAP = 0.025, 0.08
"""Share of the matches that must agree: at least, and for each share of surface that coincides. By chance 0.02 do,
where floors and walls of one place are laid on those of another; right answers show 0.03 or more, 0.15 per overlap."""

MIN_PAIRS = 100
"""Points of the surfaces that must pair up in the refinement, or there was nothing to refine with."""

TOLERANCE_VOXELS, TOLERANCE_PER_METRE = 2.0, 0.01
"""How far apart surfaces may lie and still coincide: the grid, and depth noise growing with distance."""

MAX_CONFLICT = 0.2
"""Share of free space in what is seen from which an answer is wrong. Right ones show 1 to 9 % from desks to streets
20 m apart, wrong ones along a street 30 to 50 %; what is hidden from far apart says nothing about either."""

MIN_INCIDENCE = 0.2
"""Cosine between line of sight and normal below which a distance along the ray says little."""

RIVAL_SURFACE, RIVAL_MATCHES = 0.75, 0.6
"""Shares of the best answer's surface balance and of its matches from which another one rivals it."""

CLEAR_INLIERS, CLEAR_SHARE = 20, 0.15
"""Visual matches, and their share, that speak for an answer on their own. Wrong cliques hold up to about a
tenth of the matches where texture repeats; then the surfaces contradict them as well."""

MAX_RIVALS = 3
"""Rivals refined to the end; many of them are the same answer, not yet converged."""

VISUAL_WEIGHT = 0.25
"""Weight of the share of visual matches beside the shares of surface. Wrong cliques of visual matches are
small where surfaces tell answers apart; on a bare wall only the matches do."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Two frames and their matches: what every candidate is judged on."""

    target: Features
    source: Features
    visual: Matches
    geometric: Matches
    config: Config


@dataclass(frozen=True, slots=True)
class Candidate:
    """A motion and how the frames agree under it."""

    T_target_source: NDArray[np.float64]
    agreement: Agreement
    """Mean of both directions."""
    visual_inliers: NDArray[np.bool_]
    geometric_inliers: NDArray[np.bool_]

    @property
    def inliers(self) -> int:
        """Matches that agree."""
        return int(np.count_nonzero(self.visual_inliers) + np.count_nonzero(self.geometric_inliers))

    @property
    def match_share(self) -> float:
        """Share of the visual matches that agree plus share of the geometric ones, in [0, 2]."""
        return sum(float(np.mean(mask)) for mask in (self.visual_inliers, self.geometric_inliers) if len(mask))

    @property
    def support(self) -> float:
        """Surfaces that coincide less those that contradict, plus some of the share of visual matches that agree."""
        share = float(np.mean(self.visual_inliers)) if len(self.visual_inliers) else 0.0
        return self.agreement.balance + VISUAL_WEIGHT * share


def find_lack(target: Features, source: Features) -> tuple[Reason, str] | None:
    """Why one of the frames cannot be registered at all, if so."""
    for name, features in (("target", target), ("source", source)):
        keypoints, landmarks = features.keypoints, features.landmarks
        if keypoints.detected < MIN_KEYPOINTS:
            found = f"the {name}'s image has {keypoints.detected} keypoints"
            return Reason.NO_TEXTURE, f"{found}, expected at least {MIN_KEYPOINTS}"
        if len(landmarks) < MIN_LANDMARKS:
            found = f"the {name} has {len(landmarks)} surface points with features"
            return Reason.NO_DEPTH, f"{found}, expected at least {MIN_LANDMARKS}"
        if len(keypoints) < MIN_KEYPOINTS:
            found = f"the {name} has {len(keypoints)} keypoints with depth"
            return Reason.NO_TEXTURE, f"{found}, expected at least {MIN_KEYPOINTS}"
    return None


@stage("verification")
def assess(pair: Pair, T_target_source: NDArray[np.float64]) -> Candidate:
    """How the two frames agree under a motion: surfaces, free space, matches."""
    threshold_m = pair.config.cliques.inlier_threshold_m
    forward = _see(pair.target, pair.source, T_target_source, pair.config)
    backward = _see(pair.source, pair.target, inverse(T_target_source), pair.config)
    mean = Agreement(
        overlap=(forward.overlap + backward.overlap) / 2,
        in_front=(forward.in_front + backward.in_front) / 2,
        hidden=(forward.hidden + backward.hidden) / 2,
    )
    return Candidate(
        T_target_source,
        mean,
        pair.visual.distances(T_target_source) < threshold_m,
        pair.geometric.distances(T_target_source) < threshold_m,
    )


def _see(viewer: Features, other: Features, T_viewer_other: NDArray[np.float64], config: Config) -> Agreement:
    """Look at the other frame's landmarks with the viewer's lines of sight, where these meet them squarely.

    Ground seen at a flat angle would agree with any motion along it: with none at all, above all.
    """
    points = transform(T_viewer_other, other.landmarks.points)
    normals = other.landmarks.normals @ T_viewer_other[:3, :3].T
    distance_m = np.linalg.norm(points, axis=1)
    towards = -np.einsum("ni,ni->n", points, normals)
    squarely = np.abs(towards) > MIN_INCIDENCE * distance_m
    tolerance_m = (TOLERANCE_VOXELS * config.geometric.voxel_size_m + TOLERANCE_PER_METRE * distance_m)[squarely]
    behind_m = viewer.view.behind(points[squarely])
    # A surface that turns its back cannot be the one that was seen in its place.
    behind_m[(towards[squarely] < 0) & (np.abs(behind_m) <= tolerance_m)] = -np.inf
    return agreement(behind_m, tolerance_m)


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


def is_clear(candidates: list[Candidate], config: Config) -> bool:
    """Whether the visual matches alone leave no doubt between the candidates."""
    if not candidates:
        return False
    best = max(candidates, key=lambda candidate: candidate.support)
    return (
        _are_many(int(np.count_nonzero(best.visual_inliers)), len(best.visual_inliers))
        and is_supported(best, config)
        and all(rivalry(other, best, config) < 1.0 for other in candidates)
    )


def is_clear_answer(answer: Registration) -> bool:
    """Whether the visual matches still carry the answer after its refinement."""
    return _are_many(answer.evidence.visual_inliers, answer.evidence.visual_matches)


def _are_many(inliers: int, matches: int) -> bool:
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
        runner_up=max(rivalry(other, candidate, pair.config) for other in candidates),
    )
    objection = _objection(fit, candidate, evidence, pair.config)
    if objection is not None:
        return Rejection(*objection, evidence)
    inliers = pair.visual.select(candidate.visual_inliers)
    rows = np.column_stack((inliers.target_row, inliers.source_row))
    return Registration(fit.T_target_source, fit.covariance, evidence, rows)


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
    if evidence.runner_up >= 1.0:
        return Reason.AMBIGUOUS, "a different motion explains surfaces and matches nearly as well"
    return None


def _free_direction(covariance: NDArray[np.float64], threshold_m: float) -> str:
    """In words, a direction that the data leaves free; empty if there is none."""
    deviation_m = float(np.sqrt(np.diag(covariance)[:3].max()))
    deviation_deg = float(np.rad2deg(np.sqrt(np.diag(covariance)[3:].max())))
    if deviation_m <= threshold_m and deviation_deg <= 5.0:
        return ""
    return f"the motion is known to {deviation_m:.3g} m and {deviation_deg:.3g} deg, expected {threshold_m} m and 5 deg"
