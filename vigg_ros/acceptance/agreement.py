# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How two frames agree under a motion: surfaces, free space, matches, and what the images show."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vigg_ros.acceptance.appearance import Appearance, correlation
from vigg_ros.registration.config import Config
from vigg_ros.registration.features import Features
from vigg_ros.registration.matches import CLOSE_SHARE, Matches
from vigg_ros.registration.result import Evidence
from vigg_ros.registration.rigid import inverse, transform
from vigg_ros.registration.stages import stage
from vigg_ros.registration.visual import Keypoints

TOLERANCE_VOXELS, TOLERANCE_SIGMAS = 2.0, 3.0
"""How far apart surfaces may lie and still coincide: the grid, and the noise of both frames where they are seen."""

MIN_INCIDENCE = 0.2
"""Cosine between line of sight and normal below which a distance along the ray says little."""

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


@dataclass(frozen=True, slots=True)
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

    @property
    def inliers(self) -> int:
        """Matches that agree."""
        return int(np.count_nonzero(self.visual_inliers) + np.count_nonzero(self.geometric_inliers))

    @property
    def match_share(self) -> float:
        """Share of the visual matches that agree plus share of the geometric ones, in [0, 2]."""
        return sum(float(np.mean(mask)) for mask in (self.visual_inliers, self.geometric_inliers) if len(mask))

    def described_by(self, evidence: Evidence) -> Evidence:
        """The evidence so far, with how the frames agree under this motion."""
        return replace(
            evidence,
            visual_inliers=int(np.count_nonzero(self.visual_inliers)),
            geometric_inliers=int(np.count_nonzero(self.geometric_inliers)),
            match_share=self.match_share,
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


@stage("verification")
def assess(pair: Pair, T_target_source: NDArray[np.float64]) -> Candidate:
    """How the two frames agree under a motion: surfaces, free space, matches."""
    forward, backward = (
        agreement(sight.behind_m, sight.tolerance_m)
        for sight in (
            _see(pair.target, pair.source, T_target_source, pair.config),
            _see(pair.source, pair.target, inverse(T_target_source), pair.config),
        )
    )
    mean = Agreement(
        overlap=(forward.overlap + backward.overlap) / 2,
        in_front=(forward.in_front + backward.in_front) / 2,
        hidden=(forward.hidden + backward.hidden) / 2,
    )
    return Candidate(
        T_target_source,
        mean,
        inliers_of(pair.visual, T_target_source, pair.config),
        inliers_of(pair.geometric, T_target_source, pair.config),
    )


@dataclass(frozen=True, slots=True)
class _Sight:
    """N patches of one frame, seen from the other."""

    row: NDArray[np.int64]
    points: NDArray[np.float64]
    """(N, 3) in the viewer's frame."""
    behind_m: NDArray[np.float64]
    """(N,) behind the surface that the viewer saw there; NaN where it saw nothing."""
    tolerance_m: NDArray[np.float64]


def _see(viewer: Features, other: Features, T_viewer_other: NDArray[np.float64], config: Config) -> _Sight:
    """Look at the other frame's patches with the viewer's lines of sight, where these meet them squarely.

    Ground seen at a flat angle would agree with any motion along it: with none at all, above all.
    """
    points = transform(T_viewer_other, other.patches.points)
    normals = other.patches.normals @ T_viewer_other[:3, :3].T
    distance_m = np.linalg.norm(points, axis=1)
    towards = -np.einsum("ni,ni->n", points, normals)
    squarely = np.abs(towards) > MIN_INCIDENCE * distance_m
    own_m = np.linalg.norm(other.patches.points, axis=1)
    sigma_m = np.hypot(viewer.noise.sigma_m(distance_m), other.noise.sigma_m(own_m))
    grid_m = TOLERANCE_VOXELS * config.geometric.voxel_size_m
    if sigma_m.any():  # the paper's method knows no noise
        grid_m = np.minimum(grid_m, CLOSE_SHARE * distance_m)
    tolerance_m = (grid_m + TOLERANCE_SIGMAS * sigma_m)[squarely]
    behind_m = viewer.view.behind(points[squarely])
    # A surface that turns its back cannot be the one that was seen in its place.
    behind_m[(towards[squarely] < 0) & (np.abs(behind_m) <= tolerance_m)] = -np.inf
    return _Sight(np.flatnonzero(squarely), points[squarely], behind_m, tolerance_m)


@stage("verification")
def photometric_correlation(pair: Pair, T_target_source: NDArray[np.float64]) -> float:
    """How alike both images show the surfaces that coincide under a motion; see ``appearance.correlation``."""
    seen = []
    for viewer, other, T in (
        (pair.target, pair.source, T_target_source), (pair.source, pair.target, inverse(T_target_source))
    ):
        sight = _see(viewer, other, T, pair.config)
        with np.errstate(invalid="ignore"):
            on_it = np.abs(sight.behind_m) <= sight.tolerance_m
        own = other.patches.points[sight.row[on_it]].astype(np.float64)
        viewed, shown = Appearance.of(viewer.frame), Appearance.of(other.frame)
        seen.append((viewed.at(sight.points[on_it]), shown.at(own)))
    (in_target, of_source), (in_source, of_target) = seen
    return correlation(np.concatenate((in_target, of_target)), np.concatenate((of_source, in_source)))
