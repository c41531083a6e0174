# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How two frames agree under a motion: surfaces, free space, matches, and what the images show."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vigg_ros.acceptance.appearance import Appearance, correlation
from vigg_ros.acceptance.sight import Sight, sights
from vigg_ros.acceptance.significance import (
    MINIMAL,
    cell_weights,
    log10_joint,
    log10_tail,
    log10_triples,
    log10_type_probability,
    wrong_pairings,
)
from vigg_ros.registration.config import Config
from vigg_ros.registration.features import Features
from vigg_ros.registration.matches import Matches
from vigg_ros.registration.result import Evidence
from vigg_ros.registration.stages import stage
from vigg_ros.registration.visual import Keypoints

CELL_VOXELS = 8.0
"""Geometric matches nearer than this agree together: their features describe much the same surface."""

VISUAL_WEIGHT = 0.25
"""Weight of the share of visual matches beside the shares of surface. Wrong cliques of visual matches are
small where surfaces tell answers apart; on a bare wall only the matches do."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Shares of one cloud's points, by what the other sensor saw in their place."""

    overlap: float
    """On a surface that the other sensor saw too."""
    in_front: float
    """Where the other sensor looked through: free-space conflict."""
    hidden: float
    """Behind a surface that the other sensor saw."""

    @property
    def consistency(self) -> float:
        """Of the points that the other sensor should have seen, the share that it did see there."""
        seen = self.overlap + self.in_front + self.hidden
        return self.overlap / seen if seen > 0 else 0.0

    @property
    def conflict(self) -> float:
        """Of the points that lie on a seen surface or in free space, the share in free space."""
        seen = self.overlap + self.in_front
        return self.in_front / seen if seen > 0 else 0.0

    @property
    def balance(self) -> float:
        """Shares that speak for a motion minus those that speak against it, in [-1, 1]."""
        return self.overlap - self.in_front - self.hidden


@dataclass(frozen=True)  # without slots: a cached property needs a dictionary
class Pair:
    """Two frames and their matches: what every candidate is judged on."""

    target: Features
    source: Features
    visual: Matches
    geometric: Matches
    config: Config
    in_full: bool = False
    """Whether the visual matches are of the images in full size."""

    @property
    def keypoints(self) -> tuple[Keypoints, Keypoints]:
        """Those of the target and of the source that were matched."""
        if self.in_full:
            return self.target.fine_keypoints, self.source.fine_keypoints
        return self.target.keypoints, self.source.keypoints

    @cached_property
    def visual_weights(self) -> NDArray[np.float64]:
        """How much each visual match counts as an independent one (M,)."""
        return _match_weights(self.visual, self.config.cliques.inlier_threshold_m)

    @cached_property
    def geometric_weights(self) -> NDArray[np.float64]:
        """How much each geometric match counts as an independent one (M,)."""
        return _match_weights(self.geometric, CELL_VOXELS * self.config.geometric.voxel_size_m)

    @cached_property
    def patch_weights(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """How much each patch of the target and of the source counts: one for each neighbourhood of a feature."""
        geometric = self.config.geometric
        cell_m = geometric.feature_radius_voxels * geometric.voxel_size_m
        return cell_weights(self.target.patches.points, cell_m), cell_weights(self.source.patches.points, cell_m)

    @cached_property
    def wrong_pairings(self) -> tuple[Matches, Matches]:
        """Visual and geometric matches paired wrongly, to see what agrees by chance."""
        return wrong_pairings(self.visual), wrong_pairings(self.geometric)

    def pixels(self, visual: Matches) -> NDArray[np.float32]:
        """Where visual matches are seen: (K, 4), u and v in the target's image, u and v in the source's."""
        target, source = self.keypoints
        return np.hstack((target.pixels[visual.target_row], source.pixels[visual.source_row]))


@dataclass(frozen=True, slots=True)
class Candidate:
    """A motion and how the frames agree under it."""

    T_target_source: NDArray[np.float64]
    agreement: Agreement
    """Mean of both directions."""
    visual_inliers: NDArray[np.bool_]
    geometric_inliers: NDArray[np.bool_]
    seen_cells: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    """(3,) independent cells of surface: coinciding, in free space, and hidden; mean of both directions."""
    visual_tail: float = 0.0
    """log10 P that as many visual matches agree by chance."""
    geometric_tail: float = 0.0
    visual_log10_nfa: float = 0.0
    """log10 of the number of motions, of all that were tried, on which so many visual matches agree by chance."""

    @property
    def match_log10_p(self) -> float:
        """log10 of the probability that the matches of both kinds agree so by chance."""
        return log10_joint((self.visual_tail, self.geometric_tail))

    @property
    def match_tail(self) -> float:
        """log10 P of the agreement of both kinds of matches."""
        return self.visual_tail + self.geometric_tail

    def tails(self, chances: NDArray[np.float64]) -> tuple[float, float, float]:
        """log10 P of what visual and geometric matches and surfaces show; chances (3,) of ``seen_cells``."""
        return self.visual_tail, self.geometric_tail, surface_tail(self.seen_cells, chances)

    def described_by(self, evidence: Evidence) -> Evidence:
        """The evidence so far, with how the frames agree under this motion."""
        return replace(
            evidence,
            visual_inliers=int(np.count_nonzero(self.visual_inliers)),
            geometric_inliers=int(np.count_nonzero(self.geometric_inliers)),
            visual_log10_nfa=self.visual_log10_nfa,
            match_log10_p=self.match_log10_p,
            overlap=self.agreement.overlap,
            consistency=self.agreement.consistency,
            conflict=self.agreement.conflict,
        )

    @property
    def support(self) -> float:
        """Surfaces that coincide less those that contradict, plus some of the share of visual matches that agree."""
        share = float(np.mean(self.visual_inliers)) if len(self.visual_inliers) else 0.0
        return self.agreement.balance + VISUAL_WEIGHT * share


def inliers_of(matches: Matches, T_target_source: NDArray[np.float64], config: Config) -> NDArray[np.bool_]:
    """Which matches (M,) lie within the threshold under a motion."""
    return matches.agree(T_target_source, config.cliques.inlier_threshold_m)


def agreement(behind_m: NDArray[np.float64], tolerance_m: NDArray[np.float64]) -> Agreement:
    """Count the points (N,) by their place relative to the seen surface; NaN counts for nothing."""
    if len(behind_m) == 0:
        return Agreement(0.0, 0.0, 0.0)
    with np.errstate(invalid="ignore"):
        on_it, in_front, hidden = np.abs(behind_m) <= tolerance_m, behind_m < -tolerance_m, behind_m > tolerance_m
    return Agreement(float(np.mean(on_it)), float(np.mean(in_front)), float(np.mean(hidden)))


def surface_tail(cells: NDArray[np.float64], chances: NDArray[np.float64]) -> float:
    """log10 P of the places of cells of surface (3,) by chance; 0 where no more coincide than chance lets expect."""
    count = float(cells.sum())
    shares = cells / max(count, 1e-9)
    return float(log10_type_probability(shares, count, chances)) if shares[0] > chances[0] else 0.0


def _match_weights(matches: Matches, cell_m: float) -> NDArray[np.float64]:
    """Matches whose points lie in the same cell in both frames count as one."""
    return cell_weights(np.hstack((matches.source, matches.target)), cell_m)


@stage("verification")
def assess(pair: Pair, T_target_source: NDArray[np.float64]) -> Candidate:
    """How the two frames agree under a motion: surfaces, free space, matches."""
    seen = sights(pair.target, pair.source, T_target_source, pair.config)
    forward, backward = (agreement(sight.behind_m, sight.tolerance_m) for sight in seen)
    mean = Agreement(
        overlap=(forward.overlap + backward.overlap) / 2,
        in_front=(forward.in_front + backward.in_front) / 2,
        hidden=(forward.hidden + backward.hidden) / 2,
    )
    visual, geometric = (inliers_of(matches, T_target_source, pair.config) for matches in (pair.visual, pair.geometric))
    visual_chance, geometric_chance = chances_of(pair, T_target_source)
    agreeing, trials = float(visual @ pair.visual_weights), float(pair.visual_weights.sum())
    return Candidate(
        T_target_source, mean, visual, geometric,
        seen_cells=_count_cells(pair, seen),
        visual_tail=float(log10_tail(agreeing, trials, visual_chance)),
        geometric_tail=float(
            log10_tail(geometric @ pair.geometric_weights, float(pair.geometric_weights.sum()), geometric_chance)
        ),
        visual_log10_nfa=_visual_log10_nfa(agreeing, trials, visual_chance),
    )


def _count_cells(pair: Pair, seen: tuple[Sight, Sight]) -> NDArray[np.float64]:
    forward, backward = (
        sight.kinds() @ weights[sight.row] for sight, weights in zip(seen, pair.patch_weights[::-1], strict=True)
    )
    return np.asarray((forward + backward) / 2)


@stage("aliases")
def seen_cells(pair: Pair, T_target_source: NDArray[np.float64]) -> NDArray[np.float64]:
    """Independent cells of surface (3,) that coincide, lie in free space, and are hidden under a motion."""
    return _count_cells(pair, sights(pair.target, pair.source, T_target_source, pair.config))


def visual_false_alarms(pair: Pair, T_target_source: NDArray[np.float64], inliers: NDArray[np.bool_]) -> float:
    """log10 of the motions on which as many visual matches as these (M,) agree by chance, among all that were tried."""
    chance, _ = chances_of(pair, T_target_source)
    return _visual_log10_nfa(float(inliers @ pair.visual_weights), float(pair.visual_weights.sum()), chance)


def _visual_log10_nfa(agreeing: float, trials: float, chance: float) -> float:
    beyond = log10_tail(max(agreeing - MINIMAL, 0.0), max(trials - MINIMAL, 0.0), chance)
    return log10_triples(trials) + float(beyond)


def chances_of(pair: Pair, T_target_source: NDArray[np.float64]) -> tuple[float, float]:
    """P that a wrong visual match agrees with a motion, and a wrong geometric one, from wrong pairings."""
    visual, geometric = (
        (np.count_nonzero(inliers_of(wrong, T_target_source, pair.config)) + 1) / (len(wrong) + 2)
        for wrong in pair.wrong_pairings
    )
    return visual, geometric


@stage("verification")
def photometric_correlation(pair: Pair, T_target_source: NDArray[np.float64]) -> float:
    """How alike both images show the surfaces that coincide under a motion; see ``appearance.correlation``."""
    seen = []
    for sight, viewer, other in zip(
        sights(pair.target, pair.source, T_target_source, pair.config),
        (pair.target, pair.source), (pair.source, pair.target), strict=True,
    ):
        on_it = sight.kinds()[0]
        own = other.patches.points[sight.row[on_it]].astype(np.float64)
        viewed, shown = Appearance.of(viewer.frame), Appearance.of(other.frame)
        seen.append((viewed.at(sight.points[on_it]), shown.at(own)))
    (in_target, of_source), (in_source, of_target) = seen
    return correlation(np.concatenate((in_target, of_target)), np.concatenate((of_source, in_source)))
