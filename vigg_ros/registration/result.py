# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What registering two frames gives: a motion with its evidence, or a reason why there is none."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray


class Reason(str, Enum):
    """Why there is no answer."""

    NO_DEPTH = "NO_DEPTH"
    """Too few points to be a surface."""
    NO_TEXTURE = "NO_TEXTURE"
    """Too few keypoints that see a point."""
    TOO_FEW_MATCHES = "TOO_FEW_MATCHES"
    """No three matches are compatible with one motion."""
    TOO_FEW_INLIERS = "TOO_FEW_INLIERS"
    """Too few matches agree with the best motion."""
    DEGENERATE = "DEGENERATE"
    """The points leave a direction of motion free."""
    LOW_OVERLAP = "LOW_OVERLAP"
    """Too little of the surface coincides."""
    CONFLICT = "CONFLICT"
    """Surfaces lie where the other sensor looked through, or looked at something else."""
    AMBIGUOUS = "AMBIGUOUS"
    """Another motion explains the frames nearly as well."""
    TIMEOUT = "TIMEOUT"
    """The time budget was used up."""
    NOT_FINITE = "NOT_FINITE"
    """Numerical failure."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """What speaks for or against an answer. Stages that were not reached leave 0 or NaN."""

    keypoints: int = 0
    """Keypoints of the source that see a point."""
    visual_matches: int = 0
    geometric_matches: int = 0
    hypotheses: int = 0
    """Hypotheses from cliques."""
    candidates: int = 0
    """Different hypotheses that were followed."""
    visual_inliers: int = 0
    """Visual matches within the threshold under the answer."""
    geometric_inliers: int = 0
    visual_log10_nfa: float = float("nan")
    """log10 of the number of motions, of all that were tried, on which so many visual matches agree by chance."""
    match_log10_p: float = float("nan")
    """log10 of the probability that as many matches of both kinds agree by chance."""
    log10_nfa: float = float("nan")
    """log10 of the number of motions for which chance speaks as much: ``visual_log10_nfa``, or where that is too much,
    of matches of both kinds and surfaces together."""
    surface_pairs: int = 0
    """Points of the surfaces that pair up in the refinement."""
    rmse_m: float = float("nan")
    """Root mean square distance of the aligned surfaces along their normals."""
    motion_sigma_m: float = float("nan")
    """Largest standard deviation of the translation; NaN where the fit is not finite."""
    motion_sigma_deg: float = float("nan")
    """Largest standard deviation of the rotation."""
    overlap: float = float("nan")
    """Share of both surfaces that coincides."""
    consistency: float = float("nan")
    """Coinciding share of the surface that both sensors should see."""
    conflict: float = float("nan")
    """Share of free space among the points that lie on a seen surface or in free space."""
    photometric_correlation: float = float("nan")
    """How alike the images show the coinciding surface; NaN where visual matches decide on their own, and where the
    images have too little in common to tell."""
    lead_log10: float = float("nan")
    """log10 of how many times less likely by chance the answer is than the best different one; inf where none comes
    near."""
    repeated_shift_m: float = float("nan")
    """Distance to another motion under which a repeating texture is shown as well; NaN where there is none."""

    @property
    def inliers(self) -> int:
        """Matches that agree with the answer."""
        return self.visual_inliers + self.geometric_inliers


@dataclass(frozen=True, slots=True)
class Registration:
    """A motion that its evidence supports."""

    T_target_source: NDArray[np.float64]
    """(4, 4): p_target = T_target_source @ p_source, metres."""
    covariance: NDArray[np.float64]
    """(6, 6), order x y z (m) and rotation about x y z (rad), all along the target's axes.

    t + dt and exp(dr) R, as geometry_msgs/PoseWithCovariance means it.
    """
    evidence: Evidence
    visual_inliers_px: NDArray[np.float32]
    """(K, 4) pixels of the visual matches that agree: u and v in the target's image, u and v in the source's."""


@dataclass(frozen=True, slots=True)
class Rejection:
    """No answer, and why. There is no transform in it."""

    reason: Reason
    message: str
    """One sentence: what was found and what was expected."""
    evidence: Evidence


Outcome = Registration | Rejection
