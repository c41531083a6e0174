# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Refinement beyond the paper: surfaces and visual matches aligned together, with an honest covariance.

Symmetric point-to-plane residuals (Rusinkiewicz 2019) pull along the normals; the visual matches hold the
directions that the surfaces leave free, so that a single textured wall still has one answer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vigg_ros.registration.config import Config
from vigg_ros.registration.geometric import Surface
from vigg_ros.registration.kernels.cells import CellIndex
from vigg_ros.registration.kernels.symmetric_icp import symmetric_icp_residuals
from vigg_ros.registration.matches import Matches
from vigg_ros.registration.rigid import transform
from vigg_ros.registration.stages import stage

WIDE_VOXELS, NARROW_VOXELS = 4.0, 2.0
"""Search radius of the first rounds, which may start a few voxels off, and of the others."""
THINNING, MIN_THINNED = 4, 500
"""The first rounds use every n-th point, but not fewer than this: they need not be precise."""

MIN_NORMAL_COSINE = 0.5
"""Surfaces that face apart by more than 60 deg are not the same surface."""

MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""

CONVERGED_VOXELS = 0.002
"""A step that moves the surface by less than this ends the rounds."""

VISUAL_FLOOR_VOXELS = 0.1
"""Standard deviation that a visual match has at least."""

MIN_RESPONSE = 0.05
"""Surfaces that respond less are too rough to say how much they do."""

BLOCK_VOXELS = 8.0
"""Errors of depth are alike on patches of about this size; patches, not points, count as independent."""


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
class _Residuals:
    """N scalar residuals: e = value - jacobian @ step."""

    value: NDArray[np.float64]
    jacobian: NDArray[np.float64]
    weight: NDArray[np.float64]
    row: NDArray[np.int64]
    """(N,) the source point or match that each belongs to."""
    floor_m: float
    """Standard deviation that each has at least, however well they agree."""


class SurfaceAligner:
    """The target's surface, indexed once for both search radii."""

    def __init__(self, target: Surface, voxel_size_m: float) -> None:
        self._voxel_m = voxel_size_m
        self._sorted: dict[float, tuple[CellIndex, Surface]] = {}
        for radius in (WIDE_VOXELS, NARROW_VOXELS):
            index = CellIndex.build(target.points, radius * voxel_size_m)
            self._sorted[radius] = index, target.select(index.order)

    def residuals(self, source: Surface, T_target_source: NDArray[np.float64], radius_voxels: float) -> _Residuals:
        """Distances between the nearest surfaces along the mean of their normals."""
        index, target = self._sorted[radius_voxels]
        rows, value, jacobian = symmetric_icp_residuals(
            (source.points, source.normals), T_target_source, (target.points, target.normals), index.lookup(),
            radius_voxels * self._voxel_m, MIN_NORMAL_COSINE,
        )
        floor_m = 0.02 * self._voxel_m
        weight = _robust_weight(value, floor=floor_m)
        return _Residuals(value, jacobian, weight, rows, floor_m)

    def response(self, source: Surface, T_target_source: NDArray[np.float64], found: _Residuals) -> float:
        """How much of a shift along the normals is seen once the surfaces are paired anew: a share in (0, 1].

        Among noisy points the nearest one hides a part of any shift, so ``found`` claims more information
        than there is. Tried with a shift of one standard deviation of the distances found, either way.
        """
        if len(found.value) == 0:
            return 1.0
        shift = _deviation(found.value, found.floor_m)
        pull = []
        for step in (-shift, shift):
            shifted = Surface(source.points + np.float32(step) * source.normals, source.normals)
            paired = self.residuals(shifted, T_target_source, NARROW_VOXELS)
            pull.append(float(paired.weight @ paired.value))
        share = (pull[0] - pull[1]) / (2 * shift * float(found.weight.sum()))
        return min(max(share, MIN_RESPONSE), 1.0)

    def patches(self, points: NDArray[np.float32]) -> NDArray[np.int64]:
        """The number of the patch that each point (N, 3) lies on."""
        cells = np.floor(points / (BLOCK_VOXELS * self._voxel_m)).astype(np.int64)
        # Primes of Teschner 2003: different patches rarely get the same number.
        return np.asarray((cells[:, 0] * 73856093) ^ (cells[:, 1] * 19349669) ^ (cells[:, 2] * 83492791))


def _deviation(value: NDArray[np.float64], floor: float) -> float:
    """Standard deviation of values (N,), N >= 1, by their median absolute deviation, and never below the floor."""
    return MAD_TO_SIGMA * float(np.median(np.abs(value))) + floor


def _robust_weight(value: NDArray[np.float64], *, floor: float) -> NDArray[np.float64]:
    """Cauchy weights over the variance, whose scale is the median absolute deviation."""
    if len(value) == 0:
        return np.empty(0)
    sigma = _deviation(value, floor)
    return np.asarray(1.0 / (sigma**2 * (1.0 + (value / sigma) ** 2)))


def _visual_residuals(prior: Matches, T_target_source: NDArray[np.float64], floor: float) -> _Residuals:
    """Three residuals for each visual match, along the target's axes."""
    moved = transform(T_target_source, prior.source)
    value = prior.target - moved
    weight = np.repeat(_robust_weight(np.linalg.norm(value, axis=1) / math.sqrt(3), floor=floor), 3)
    # How a step (translation, rotation about the moved source origin) moves each point along each axis.
    x, y, z = (moved - T_target_source[:3, 3]).T
    jacobian = np.zeros((len(prior), 3, 6))
    jacobian[:, :, :3] = np.eye(3)
    jacobian[:, 0, 4], jacobian[:, 0, 5] = z, -y
    jacobian[:, 1, 3], jacobian[:, 1, 5] = -z, x
    jacobian[:, 2, 3], jacobian[:, 2, 4] = y, -x
    return _Residuals(value.ravel(), jacobian.reshape(-1, 6), weight, np.repeat(np.arange(len(prior)), 3), floor)


@stage("refinement")
def refine(
    aligner: SurfaceAligner, source: Surface, visual: Matches, T_target_source: NDArray[np.float64], config: Config
) -> Fit:
    """Gauss-Newton on the surfaces together with the visual matches that agree with the motion at the start."""
    visual = visual.select(visual.distances(T_target_source) < config.cliques.inlier_threshold_m)
    voxel_m = config.geometric.voxel_size_m
    T_target_source = _descend(aligner, source, visual, T_target_source, config)
    matched = _visual_residuals(visual, T_target_source, floor=VISUAL_FLOOR_VOXELS * voxel_m)
    surface = aligner.residuals(source, T_target_source, NARROW_VOXELS)
    rms_m = float(np.sqrt(np.mean(surface.value**2))) if len(surface.value) else math.nan
    response = aligner.response(source, T_target_source, surface)
    # A match is a patch of its own; numbers of surface patches are not negative.
    patches = np.concatenate((aligner.patches(source.points[surface.row]), -1 - matched.row))
    return Fit(T_target_source, _covariance(surface, matched, patches, response), rms_m, len(surface.value))


def _descend(
    aligner: SurfaceAligner, source: Surface, visual: Matches, T_target_source: NDArray[np.float64], config: Config
) -> NDArray[np.float64]:
    """Gauss-Newton: first with few points and far-reaching pairs, at last with all points and near pairs."""
    voxel_m = config.geometric.voxel_size_m
    few = source.select(np.arange(0, len(source), THINNING)) if len(source) > THINNING * MIN_THINNED else source
    rounds = config.refinement.iterations
    for points, radius, converged in (
        (few, WIDE_VOXELS, 0.1), (few, NARROW_VOXELS, 0.05), (source, NARROW_VOXELS, CONVERGED_VOXELS)
    ):
        for _ in range(rounds):
            surface = aligner.residuals(points, T_target_source, radius)
            step = _solve(surface, _visual_residuals(visual, T_target_source, floor=VISUAL_FLOOR_VOXELS * voxel_m))
            T_target_source = _moved(T_target_source, step)
            if np.linalg.norm(step[:3]) + np.linalg.norm(step[3:]) < converged * voxel_m:
                break
    return T_target_source


def _information(residuals: _Residuals) -> NDArray[np.float64]:
    return (residuals.jacobian * residuals.weight[:, None]).T @ residuals.jacobian


def _solve(surface: _Residuals, visual: _Residuals) -> NDArray[np.float64]:
    """One step (6,); directions that nothing determines do not move."""
    gradient = sum(r.jacobian.T @ (r.weight * r.value) for r in (surface, visual))
    values, vectors = np.linalg.eigh(_information(surface) + _information(visual))
    known = values > 1e-9 * values[-1]
    return np.asarray(vectors[:, known] @ ((vectors[:, known].T @ gradient) / values[known]))


def _moved(T_target_source: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    moved = T_target_source.copy()
    moved[:3, :3] = Rotation.from_rotvec(step[3:]).as_matrix() @ T_target_source[:3, :3]
    moved[:3, 3] += step[:3]
    return moved


def _covariance(
    surface: _Residuals, visual: _Residuals, patches: NDArray[np.int64], response: float
) -> NDArray[np.float64]:
    """Cluster-robust covariance (Liang and Zeger 1986): A^-1 B A^-1, B from the summed scores of patches.

    Unlike A^-1 it does not take the thousand points of one patch for a thousand measurements. A is the
    derivative of the summed scores, so the surfaces count in it as much as they respond to a motion. Two
    equal frames have no residuals, yet nobody knows the motion between them exactly: B holds the floors too.
    Directions without information get an infinite variance on the diagonal.
    """
    information = response * _information(surface) + _information(visual)
    values = np.linalg.eigvalsh(information)
    if values[0] <= 1e-9 * max(values[-1], 1e-300):
        return np.diag(np.full(6, np.inf))
    A_inverse = np.linalg.inv(information)
    scores = np.vstack([r.jacobian * (r.weight * r.value)[:, None] for r in (surface, visual)])
    different, place = np.unique(patches, return_inverse=True)
    sums = np.zeros((len(different), 6))
    np.add.at(sums, place, scores)
    # Patches beyond the parameters they fix, as in any estimate of a variance.
    correction = len(different) / max(len(different) - 6, 1)
    least = [r.jacobian * (r.weight * r.floor_m)[:, None] for r in (surface, visual)]
    spread = correction * (sums.T @ sums) + sum(scores.T @ scores for scores in least)
    sandwich = A_inverse @ spread @ A_inverse
    return 0.5 * (sandwich + sandwich.T)
