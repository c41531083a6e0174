# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Voxel grid, normals, FPFH, and global geometric matches (C_geo)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.kernels.cells import CellIndex
from vigg_ros.registration.kernels.fpfh import fpfh
from vigg_ros.registration.kernels.normals import surface_normals
from vigg_ros.registration.kernels.voxels import voxel_means
from vigg_ros.registration.matches import Matches
from vigg_ros.registration.noise import NO_NOISE, DepthNoise
from vigg_ros.registration.options import GeometricConfig
from vigg_ros.registration.stages import stage

GLOBAL_MATCHES = 500
"""Mutual matches kept, the most similar first: what the clique search can take in milliseconds."""

SALIENT = 4000
"""Landmarks that take part in global matching: most of a depth image, less than half of a 64-beam scan."""

BLOCK = 512
"""Features compared at once, so that a block of similarities stays in the cache."""

NOISY_VOXELS = 2.0
"""Standard deviation, in voxels, up to which points still show where a surface is."""

SURFACE_NORMAL_VOXELS = 2.0
"""Radius of a surface point's normal; docs/method.md, surface."""


@dataclass(frozen=True, slots=True)
class Surface:
    """N points with normals, one a voxel, in the frame of the results."""

    points: NDArray[np.float32]
    """(N, 3), metres."""
    normals: NDArray[np.float32]
    """(N, 3), unit length, towards the sensor."""

    def __len__(self) -> int:
        return len(self.points)

    def select(self, rows: NDArray[Any]) -> Surface:
        """Some of the points, by mask or index."""
        return Surface(self.points[rows], self.normals[rows])


@dataclass(frozen=True, slots=True)
class Landmarks:
    """L points with features, on a coarser grid than the surface."""

    points: NDArray[np.float32]
    """(L, 3), metres."""
    features: NDArray[np.float32]
    """(L, 33) FPFH, unit length."""
    sigma_m: NDArray[np.float64]
    """(L,) standard deviation along the line of sight."""

    def __len__(self) -> int:
        return len(self.points)

    def select(self, rows: NDArray[Any]) -> Landmarks:
        """Some of the landmarks, by mask or index."""
        return Landmarks(self.points[rows], self.features[rows], self.sigma_m[rows])


def voxel_downsample(
    points: NDArray[np.floating], voxel_size_m: float, *, min_range_m: float = 0.0, max_range_m: float = math.inf
) -> NDArray[np.float32]:
    """The mean (V, 3) of the points (N, 3) in each occupied voxel.

    Only of those whose distance from the origin is in range; points beyond 2^20 voxels are dropped.
    """
    kept = np.ascontiguousarray(points, np.float32)
    return np.asarray(voxel_means(kept, float(voxel_size_m), float(min_range_m), float(max_range_m)))


def estimate_normals(points: NDArray[np.float32], radius_m: float) -> NDArray[np.float32]:
    """Normals (N, 3) of unit length towards the origin, zero where the neighbours do not make a surface."""
    return _of_neighbours(surface_normals, radius_m, points) if len(points) else np.empty((0, 3), np.float32)


def describe(points: NDArray[np.float32], normals: NDArray[np.float32], radius_m: float) -> NDArray[np.float32]:
    """FPFH (N, 33) of unit length (Rusu 2009) from all neighbours within the radius."""
    return _of_neighbours(fpfh, radius_m, points, normals) if len(points) else np.empty((0, 33), np.float32)


def _of_neighbours(
    kernel: Callable[..., NDArray[np.float32]], radius_m: float, points: NDArray[np.float32], *more: NDArray[np.float32]
) -> NDArray[np.float32]:
    """What a kernel finds for each point within the radius, which wants points and more of each in order of cells."""
    index = CellIndex.build(points, radius_m)
    found = kernel(*(column[index.order] for column in (points, *more)), index.starts, index.runs, radius_m)
    out = np.empty_like(found)
    out[index.order] = found
    return out


def rows_in_range(points: NDArray[np.floating], config: GeometricConfig) -> NDArray[np.int64]:
    """Rows of the points (N, 3) whose distance from the sensor, the origin, is one that counts."""
    with np.errstate(over="ignore"):
        squared = np.einsum("ni,ni->n", points, points)
    return np.flatnonzero((squared >= config.min_range_m**2) & (squared <= config.max_range_m**2))


@stage("surface")
def build_surface(points: NDArray[np.float32], config: GeometricConfig, noise: DepthNoise = NO_NOISE) -> Surface:
    """The voxel grid of all points (N, 3) within range of the sensor, the origin, where it is a surface.

    Where the noise is wider than NOISY_VOXELS a cloud of points is no surface any more, whatever it is a cloud of.
    """
    reach_m = noise.reach_m(NOISY_VOXELS * config.voxel_size_m)
    grid = voxel_downsample(
        points, config.voxel_size_m, min_range_m=config.min_range_m, max_range_m=min(config.max_range_m, reach_m)
    )
    normals = estimate_normals(grid, SURFACE_NORMAL_VOXELS * config.voxel_size_m)
    return Surface(grid, normals).select(np.any(normals != 0, axis=1))


@stage("surface")
def build_patches(surface: Surface, config: GeometricConfig) -> Surface:
    """The surface on the grid of features, with normals of that scale."""
    voxel = config.voxel_size_m
    points = surface.points
    if config.feature_grid_voxels > 1:
        points = voxel_downsample(points, config.feature_grid_voxels * voxel)
    normals = estimate_normals(points, config.normal_radius_voxels * voxel)
    return Surface(points, normals).select(np.any(normals != 0, axis=1))


@stage("features")
def build_landmarks(patches: Surface, config: GeometricConfig, noise: DepthNoise = NO_NOISE) -> Landmarks:
    """The patches with FPFH."""
    radius_m = config.feature_radius_voxels * config.voxel_size_m
    sigma_m = noise.sigma_m(np.linalg.norm(patches.points, axis=1))
    return Landmarks(patches.points, describe(patches.points, patches.normals, radius_m), sigma_m)


def sample(count: int, limit: int, seed: int) -> NDArray[np.int64]:
    """At most ``limit`` of ``count`` rows, ascending, without replacement, the same for the same seed."""
    if count <= limit:
        return np.arange(count)
    return np.sort(np.random.default_rng(seed).choice(count, limit, replace=False))


@stage("global matches")
def match_global(target: Landmarks, source: Landmarks, config: GeometricConfig, *, seed: int = 0) -> Matches:
    """C_geo: for each source landmark the target landmark with the most similar feature.

    With ``mutual`` only pairs of salient landmarks that choose each other stay, the most similar first;
    without, ``sample_k`` sampled landmarks of the source are matched, as in the paper.
    """
    if len(target) == 0 or len(source) == 0:
        return _matches(target, source, np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0))
    if not config.mutual:
        rows = sample(len(source), config.sample_k, seed)
        forward, similarity, _ = _nearest_features(target.features, source.features[rows])
        return _matches(target, source, forward, rows, similarity)
    target_rows, source_rows = salient(target.features), salient(source.features)
    forward, similarity, backward = _nearest_features(target.features[target_rows], source.features[source_rows])
    kept = np.flatnonzero(backward[forward] == np.arange(len(source_rows)))
    kept = kept[np.argsort(-similarity[kept], kind="stable")][:GLOBAL_MATCHES]
    return _matches(target, source, target_rows[forward[kept]], source_rows[kept], similarity[kept])


def salient(features: NDArray[np.float32]) -> NDArray[np.int64]:
    """Rows of the SALIENT features (N, F) least like their mean, ascending.

    Most of any scene is flat, and one flat spot is like the next: they cost time and match at random.
    """
    if len(features) <= SALIENT:
        return np.arange(len(features))
    likeness = features @ features.mean(axis=0)
    return np.sort(np.argpartition(likeness, SALIENT)[:SALIENT])


def _nearest_features(
    target: NDArray[np.float32], source: NDArray[np.float32]
) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.int64]]:
    """Nearest target of each source with its cosine, and nearest source of each target."""
    forward, cosine = np.empty(len(source), np.int64), np.empty(len(source), np.float32)
    backward, best = np.zeros(len(target), np.int64), np.full(len(target), -np.inf, np.float32)
    for start in range(0, len(source), BLOCK):
        block = source[start : start + BLOCK] @ target.T
        rows = block.argmax(axis=1)
        forward[start : start + BLOCK] = rows
        cosine[start : start + BLOCK] = block[np.arange(len(rows)), rows]
        columns = block.max(axis=0)
        better = np.flatnonzero(columns > best)
        best[better] = columns[better]
        backward[better] = start + block[:, better].argmax(axis=0)
    return forward, cosine, backward


def _matches(
    target: Landmarks,
    source: Landmarks,
    target_row: NDArray[np.int64],
    source_row: NDArray[np.int64],
    similarity: NDArray[np.floating],
) -> Matches:
    return Matches(
        target.points[target_row].astype(np.float64),
        source.points[source_row].astype(np.float64),
        np.clip(similarity, 0.0, 1.0).astype(np.float64),
        target_row,
        source_row,
        np.hypot(target.sigma_m[target_row], source.sigma_m[source_row]),
    )
