# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Refinement beyond the paper: surfaces and visual matches aligned together, with an honest covariance.

Symmetric point-to-plane residuals (Rusinkiewicz 2019) pull along the normals; the visual matches hold the
directions that the surfaces leave free, so that a single textured wall still has one answer.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from vigg_ros.registration.alignment import FrameAlignment, Residuals
from vigg_ros.registration.stages import stage

CONVERGED_VOXELS = 0.002
"""A step that moves the surface by less than this ends the rounds."""

MAX_SYSTEMATIC_SHARE = 0.05
"""Of a motion, what images and surfaces may each be off by beyond what their matches and points show: another moment
than the other's, a rolling shutter, what calibration left. On two hand-held Kinects they disagree by 4 to 15 % of the
angle."""

MIN_TRUST = 1e-4
"""Share of their weight that is left to surfaces which contradict the images altogether."""

EXPECTED_TENSION = 6.0
"""Mean squared distance, in standard deviations, of two estimates of six numbers that err by chance alone."""


@dataclass(frozen=True, slots=True)
class Fit:
    """A motion with what the last round saw of it."""

    T_target_source: NDArray[np.float64]
    covariance: NDArray[np.float64]
    """(6, 6) of translation (m) and rotation (rad) about the target's axes, see ``Registration``."""
    rms_m: float
    """Root mean square distance of the paired surfaces along their normals; NaN without pairs."""
    pairs: int


@dataclass(frozen=True, slots=True)
class Balance:
    """What images and surfaces are worth beside each other, once it is seen how far they contradict."""

    systematic: NDArray[np.float64]
    """(6, 6) covariance that each has beside what its matches or points show."""
    trust: float
    """Share of their weight that is left to the surfaces."""
    contradiction: NDArray[np.float64]
    """(6, 6) covariance of the answer for want of knowing which of the two is right."""

    def counted(self, information: NDArray[np.float64]) -> NDArray[np.float64]:
        """(6, 6) by which a step of either kind counts, from its own information."""
        if not self.systematic.any():
            return information
        # (information^-1 + systematic)^-1 without the first inverse, which surfaces may lack.
        return np.asarray(np.linalg.solve(np.eye(6) + information @ self.systematic, information))


NO_BALANCE = Balance(np.zeros((6, 6)), 1.0, np.zeros((6, 6)))


@stage("refinement")
def refine(alignment: FrameAlignment, T_target_source: NDArray[np.float64], *, iterations: int, voxel_m: float) -> Fit:
    """Gauss-Newton on the surfaces together with the visual matches, at most so many ``iterations`` a stage."""
    T_target_source, balance = _descend(alignment, T_target_source, iterations, voxel_m)
    visual, surface = alignment.visual(T_target_source), alignment.surface(T_target_source)
    rms_m = float(np.sqrt(np.mean(surface.value**2))) if len(surface) else math.nan
    response = alignment.response(T_target_source, surface)
    covariance = _covariance(surface, visual, response, balance)
    return Fit(T_target_source, covariance, rms_m, len(surface))


def _descend(
    alignment: FrameAlignment, T_target_source: NDArray[np.float64], iterations: int, voxel_m: float
) -> tuple[NDArray[np.float64], Balance]:
    """First with few points and far-reaching pairs, at last with all points and near pairs, and in balance."""
    balance = NO_BALANCE
    for few, wide, converged in ((True, True, 0.1), (True, False, 0.05), (False, False, CONVERGED_VOXELS)):
        for _ in range(iterations):
            surface, visual = alignment.surface(T_target_source, wide=wide, few=few), alignment.visual(T_target_source)
            motion = None if few else alignment.lever(T_target_source)
            balance = NO_BALANCE if motion is None else balance_of(surface, visual, motion)
            step = _solve(surface, visual, balance)
            T_target_source = _moved(T_target_source, step)
            if np.linalg.norm(step[:3]) + np.linalg.norm(step[3:]) < converged * voxel_m:
                break
    return T_target_source, balance


def balance_of(surface: Residuals, visual: Residuals, motion: NDArray[np.float64]) -> Balance:
    """What to believe where images and surfaces contradict each other by more than chance would.

    Depth has errors that are alike all over the image, such as steps of disparity that stay where they are when the
    camera moves; images have others, and all grow with the motion (6,): what each of its numbers moves the view by.
    Thousands of points do not average them out, and they show in nothing but the contradiction. It is put down to
    both alike as far as MAX_SYSTEMATIC_SHARE allows, and beyond that to the surfaces (a Birge ratio in two steps).
    """
    of_images, of_surface = visual.information, surface.information
    if len(surface) == 0 or not _determines(of_images):
        return NO_BALANCE
    apart = np.linalg.solve(of_images, visual.gradient) - _step(of_surface, surface.gradient)
    shape = np.diag(motion**2)

    def tension(share: float, log_trust: float) -> float:
        """Squared distance of both estimates in standard deviations, less what chance would make it."""
        balance = Balance(share**2 * shape, 1.0, shape)
        images, trusted = balance.counted(of_images), math.exp(log_trust) * balance.counted(of_surface)
        # Their summed covariances inverted, in a form that needs no inverse of the surfaces' information.
        return float(apart @ images @ np.linalg.solve(images + trusted, trusted @ apart)) - EXPECTED_TENSION

    beyond_chance = tension(0.0, 0.0)
    if beyond_chance <= 0:
        return NO_BALANCE
    share = _root(lambda x: tension(x, 0.0), 0.0, MAX_SYSTEMATIC_SHARE)
    trust = math.exp(_root(lambda x: tension(share, -x), 0.0, -math.log(MIN_TRUST)) * -1)
    # The answer lies between the two, each of which is as likely right.
    doubt = 0.5 * beyond_chance / (beyond_chance + EXPECTED_TENSION)
    return Balance(share**2 * shape, trust, doubt * np.outer(apart, apart))


def _root(decreasing: Callable[[float], float], low: float, high: float) -> float:
    """Where a decreasing function becomes 0; the bound where it does not in between."""
    if decreasing(low) <= 0:
        return low
    return float(brentq(decreasing, low, high, rtol=1e-2)) if decreasing(high) < 0 else high


def _determines(information: NDArray[np.float64]) -> bool:
    """Whether all six numbers of a motion follow from it."""
    values = np.linalg.eigvalsh(information)
    return bool(values[0] > 1e-9 * max(values[-1], 1e-300))


def _step(information: NDArray[np.float64], gradient: NDArray[np.float64]) -> NDArray[np.float64]:
    """One step (6,); directions that nothing determines do not move."""
    values, vectors = np.linalg.eigh(information)
    known = values > 1e-9 * values[-1]
    return np.asarray(vectors[:, known] @ ((vectors[:, known].T @ gradient) / values[known]))


def _solve(surface: Residuals, visual: Residuals, balance: Balance) -> NDArray[np.float64]:
    if balance is NO_BALANCE:
        return _step(surface.information + visual.information, surface.gradient + visual.gradient)
    information, gradient = np.zeros((6, 6)), np.zeros(6)
    for part, trust in ((visual, 1.0), (surface, balance.trust)):
        counted = trust * balance.counted(part.information)
        information += counted
        gradient += counted @ _step(part.information, part.gradient)
    return _step(information, gradient)


def _moved(T_target_source: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    moved = T_target_source.copy()
    moved[:3, :3] = Rotation.from_rotvec(step[3:]).as_matrix() @ T_target_source[:3, :3]
    moved[:3, 3] += step[:3]
    return moved


def _covariance(
    surface: Residuals, visual: Residuals, response: float, balance: Balance
) -> NDArray[np.float64]:
    """Cluster-robust covariance (Liang and Zeger 1986): A^-1 B A^-1, B from the summed scores of patches.

    Unlike A^-1 it does not take the thousand points of one patch for a thousand measurements. A is the
    derivative of the summed scores, so the surfaces count in it as much as they respond to a motion. Two
    equal frames have no residuals, yet nobody knows the motion between them exactly: B holds the floors too.
    Surfaces of less trust are as much less exact, images as exact as the balance says, and the answer
    no more exact than the two agree.
    Directions without information get an infinite variance on the diagonal.
    """
    parts = ((visual, 1.0, visual.curvature), (surface, balance.trust, response))
    information, spread, clusters = np.zeros((6, 6)), np.zeros((6, 6)), 0
    for part, trust, seen in parts:
        own = part.information
        counted = balance.counted(own)
        information += seen * trust * counted
        less = np.linalg.solve(np.eye(6) + own @ balance.systematic, np.eye(6))
        spread += trust * (less @ _spread(part) @ less.T + counted @ balance.systematic @ counted)
        clusters += len(np.unique(part.cluster))
    if not _determines(information):
        return np.diag(np.full(6, np.inf))
    A_inverse = np.linalg.inv(information)
    # Patches beyond the parameters they fix, as in any estimate of a variance.
    sandwich = clusters / max(clusters - 6, 1) * A_inverse @ spread @ A_inverse + balance.contradiction
    return 0.5 * (sandwich + sandwich.T)


def _spread(part: Residuals) -> NDArray[np.float64]:
    """(6, 6) variance of the summed scores: what the clusters show, and the floors."""
    scores = _sums(part.jacobian * (part.weight * part.value)[:, None], part.cluster)
    least = part.jacobian * (part.weight * part.floor)[:, None]
    if part.shared_floor:
        least = _sums(least, part.cluster)
    return np.asarray(scores.T @ scores + least.T @ least)


def _sums(scores: NDArray[np.float64], cluster: NDArray[np.int64]) -> NDArray[np.float64]:
    """Scores (N, 6) summed by cluster (C, 6)."""
    different, place = np.unique(cluster, return_inverse=True)
    return np.column_stack([np.bincount(place, column, minlength=len(different)) for column in scores.T])
