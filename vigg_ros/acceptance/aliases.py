# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where else shapes could fit: an answer slid along the scene's own axes, and turned about them.

Rooms, counters and streets are made of planes at right angles, so a wrong answer by shapes is mostly the right one slid
along a plane, or one corner laid on another. These motions are tried before shapes alone are believed: they show how
much surface coincides by chance in this scene, and the best of them competes with the answer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vigg_ros.acceptance.agreement import Pair
from vigg_ros.registration.rigid import transform
from vigg_ros.registration.stages import stage

REACH_VOXELS, STEP_VOXELS = 64.0, 8.0
"""How far and how finely an answer is slid: 1.6 m indoors; the alignment reaches four voxels either way."""

TURNS_DEG = (90.0, 180.0, 270.0)
"""Corners fit onto corners after right angles."""

SAME_DIRECTION_COSINE, OTHER_DIRECTION_COSINE = 0.97, 0.5
"""Normals within 14 deg belong to one set of planes; the next set is sought among those beyond 60 deg."""

VOTERS = 200
"""Normals that are tried as the direction of most others."""


@stage("aliases")
def aliases(pair: Pair, T_target_source: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Motions (4, 4) that differ from this one by a slide along an axis of the scene, or a turn about one."""
    axes = scene_axes(pair.target.patches.normals)
    voxel_m = pair.config.geometric.voxel_size_m
    steps_m = np.arange(STEP_VOXELS, REACH_VOXELS + STEP_VOXELS / 2, STEP_VOXELS) * voxel_m
    pivot = transform(T_target_source, pair.source.patches.points).mean(axis=0)
    out = []
    for axis in axes:
        for shift_m in (*steps_m, *-steps_m):
            out.append(T_target_source.copy())
            out[-1][:3, 3] += shift_m * axis
        for turn_deg in TURNS_DEG:
            turn = np.eye(4)
            turn[:3, :3] = Rotation.from_rotvec(turn_deg * axis, degrees=True).as_matrix()
            turn[:3, 3] = pivot - turn[:3, :3] @ pivot
            out.append(turn @ T_target_source)
    return out


def scene_axes(normals: NDArray[np.floating]) -> NDArray[np.float64]:
    """Three axes at right angles (3, 3), a row each: the two directions of most normals (N, 3), and across both."""
    first = _most_common(normals)
    second = _most_common(normals[np.abs(normals @ first) < OTHER_DIRECTION_COSINE])
    second = second - (second @ first) * first
    if np.linalg.norm(second) < OTHER_DIRECTION_COSINE:  # planes of one direction only: any axis in them
        second = np.cross(first, np.eye(3)[np.abs(first).argmin()])
    second = second / np.linalg.norm(second)
    return np.array((first, second, np.cross(first, second)))


def _most_common(normals: NDArray[np.floating]) -> NDArray[np.float64]:
    """The direction (3,) that most of the normals (N, 3) share, either way round; zero without any."""
    if len(normals) == 0:
        return np.zeros(3)
    tried = normals[:: max(len(normals) // VOTERS, 1)]
    votes = np.count_nonzero(np.abs(tried @ normals.T) > SAME_DIRECTION_COSINE, axis=1)
    alike = normals[np.abs(normals @ tried[votes.argmax()]) > SAME_DIRECTION_COSINE].astype(np.float64)
    return np.asarray(np.linalg.eigh(alike.T @ alike)[1][:, -1])
