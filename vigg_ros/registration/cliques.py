# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Geometric-guided visual clique alignment (GVCA, paper 3.2): hypotheses, and their choice."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from vigg_ros.registration.kernels.maximal_cliques import heaviest_cliques
from vigg_ros.registration.matches import Matches, concatenate
from vigg_ros.registration.options import CliqueConfig
from vigg_ros.registration.rigid import angle_rad, weighted_svd
from vigg_ros.registration.stages import stage

MAX_WORK = 10_000_000
"""Bound of the clique search in 64-bit word operations, about 0.1 s; at it, the heaviest cliques so far stand."""

MAX_NODES = 2000
"""Matches in a graph, the most similar first: its memory and time grow with their square and cube."""

DISTINCT_ANGLE_RAD = np.deg2rad(15.0)
DISTINCT_THRESHOLDS = 3.0
"""Two hypotheses differ when they are further apart than this angle or this many inlier thresholds."""

MIN_SCORE_RATIO = 0.3
"""A hypothesis with less of the best one's score is not followed."""


@dataclass(frozen=True, slots=True)
class Hypotheses:
    """H rigid motions with their score of eq. 4, the best first."""

    T_target_source: NDArray[np.float64]
    """(H, 4, 4)"""
    score: NDArray[np.float64]
    """(H,) sum over the matches of max(0, t - distance), metres."""

    def __len__(self) -> int:
        return len(self.score)


def compatibility(matches: Matches, threshold_m: float, score_threshold: float) -> NDArray[np.float32]:
    """Second-order compatibility (M, M) of matches: 0 where two cannot both be right.

    s_ij = exp(-d_ij^2 / (t_i^2 + t_j^2)) of the length difference d_ij (eq. 1, t for each match as far as it is
    noisy), zero below the score threshold,
    times the support (S S)_ij of all matches compatible with both (SC2-PCR).
    """
    radii2_m2 = (matches.radii_m(threshold_m) ** 2).astype(np.float32)
    exponent = (_lengths(matches.target) - _lengths(matches.source)) ** 2
    exponent /= radii2_m2[:, None] + radii2_m2[None, :]
    # Most pairs are incompatible; only for the others the exponential is worth its time.
    compatible = exponent <= -math.log(max(score_threshold, 1e-30))
    np.fill_diagonal(compatible, False)
    first_order = np.zeros_like(exponent)
    first_order[compatible] = np.exp(-exponent[compatible])
    return np.asarray(first_order * (first_order @ first_order))


def find_cliques(weight: NDArray[np.float32], max_work: int = MAX_WORK) -> NDArray[np.bool_]:
    """The heaviest maximal clique of each node (M, M weights), without repetition: members (K, M).

    Cliques have at least three nodes. The search is bounded by ``max_work`` word operations; at the
    bound each node still has the heaviest clique seen so far, at least one greedily grown.
    """
    count = len(weight)
    if count < 3:
        return np.zeros((0, count), bool)
    bits = np.zeros((count, -(-count // 64) * 64), bool)
    bits[:, :count] = weight > 0
    neighbours = np.packbits(bits, axis=1, bitorder="little").view(np.uint64)
    order = np.argsort(-weight, axis=1, kind="stable")
    best, best_weight, _ = heaviest_cliques(neighbours, weight, order, max_work)
    members = np.unpackbits(best.view(np.uint8), axis=1, bitorder="little")[:, :count].astype(bool)
    return np.asarray(np.unique(members[best_weight > 0], axis=0))


def score(T_target_source: NDArray[np.float64], matches: Matches, threshold_m: float) -> NDArray[np.float64]:
    """Eq. 4 for each of the motions (H, 4, 4): the sum of max(0, t - |T x_p - x_q|) over the matches."""
    R, t = T_target_source[:, :3, :3].astype(np.float32), T_target_source[:, :3, 3].astype(np.float32)
    gap = matches.source.astype(np.float32) @ R.transpose(0, 2, 1)
    gap += (t[:, None] - matches.target.astype(np.float32)[None]).astype(np.float32)
    distance = np.sqrt(np.einsum("hmi,hmi->hm", gap, gap))
    return np.asarray(np.maximum(0.0, matches.radii_m(threshold_m) - distance).sum(axis=1, dtype=np.float64))


@stage("cliques")
def propose(visual: Matches, geometric: Matches, config: CliqueConfig) -> Hypotheses:
    """Hypotheses from the cliques of visual and of geometric matches, judged on both (eq. 4)."""
    sources = [visual, geometric] if config.geometric_hypotheses else [visual]
    T_target_source = np.concatenate([_fit_cliques(matches, config) for matches in sources])
    judges = concatenate(visual, geometric) if config.geometric_guidance else visual
    scores = score(T_target_source, judges, config.inlier_threshold_m)
    order = np.argsort(-scores, kind="stable")
    return Hypotheses(T_target_source[order], scores[order])


def distinct(
    hypotheses: Hypotheses, limit: int, threshold_m: float, min_ratio: float = MIN_SCORE_RATIO
) -> Hypotheses:
    """The best hypotheses that differ from each other, at most ``limit``, with this share of the first one's score."""
    kept: list[int] = []
    for i in range(len(hypotheses)):
        if len(kept) == limit or hypotheses.score[i] < min_ratio * hypotheses.score[0]:
            break
        T_i = hypotheses.T_target_source[i]
        if all(differ(T_i, hypotheses.T_target_source[j], threshold_m) for j in kept):
            kept.append(i)
    return Hypotheses(hypotheses.T_target_source[kept], hypotheses.score[kept])


def differ(T_a: NDArray[np.float64], T_b: NDArray[np.float64], threshold_m: float) -> bool:
    """Whether two motions are different answers rather than two tries at the same one."""
    apart_m = float(np.linalg.norm(T_a[:3, 3] - T_b[:3, 3]))
    return apart_m > DISTINCT_THRESHOLDS * threshold_m or angle_rad(T_a[:3, :3].T @ T_b[:3, :3]) > DISTINCT_ANGLE_RAD


def _lengths(points: NDArray[np.float64]) -> NDArray[np.float32]:
    """Distances (M, M) between all pairs of points."""
    return np.asarray(cdist(points, points), np.float32)


def _fit_cliques(matches: Matches, config: CliqueConfig) -> NDArray[np.float64]:
    """One motion for each clique that determines one: (K, 4, 4)."""
    if len(matches) < 3:
        return np.empty((0, 4, 4))
    if len(matches) > MAX_NODES:
        matches = matches.select(np.argsort(-matches.similarity, kind="stable")[:MAX_NODES])
    weight = compatibility(matches, config.inlier_threshold_m, config.score_threshold)
    members = find_cliques(weight)
    T_target_source, determined = weighted_svd(matches.target, matches.source, members.astype(np.float64))
    return np.asarray(T_target_source[determined])
