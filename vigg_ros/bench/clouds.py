# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Clouds aligned by small_gicp: as baselines, as the floor, and to refine poses that serve as the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.frame_cache import FrameCache, timed
from vigg_ros.bench.methods import MethodAnswer, Task
from vigg_ros.bench.pairs import FramePair
from vigg_ros.registration import Config, Frame
from vigg_ros.registration.geometric import rows_in_range

REACH_VOXELS = 4.0
"""How far from a point its counterpart is looked for."""


def points_in_range(frame: Frame, config: Config) -> NDArray[np.float64]:
    """The points (N, 3) that our method would use too."""
    points = frame.points()
    return points[rows_in_range(points, config.geometric)].astype(np.float64)


def gicp(pair: FramePair, cache: FrameCache, config: Config, T_start: NDArray[np.float64]) -> MethodAnswer:
    """GICP from a first guess, on one thread. It always answers."""
    import small_gicp

    voxel_m = config.geometric.voxel_size_m

    def prepare(frame: Frame) -> tuple[small_gicp.PointCloud, small_gicp.KdTree]:
        prepared: tuple[small_gicp.PointCloud, small_gicp.KdTree] = small_gicp.preprocess_points(
            points_in_range(frame, config), downsampling_resolution=voxel_m, num_threads=1
        )
        return prepared

    key = "gicp", config.geometric
    (target, tree), target_ms = cache.derived(pair.target, key, prepare)
    (source, _), source_ms = cache.derived(pair.source, key, prepare)

    def align() -> small_gicp.RegistrationResult:
        return small_gicp.align(
            target,
            source,
            tree,
            init_T_target_source=T_start,
            registration_type="GICP",
            max_correspondence_distance=REACH_VOXELS * voxel_m,
            num_threads=1,
            max_iterations=50,
        )

    result, align_ms = timed(align)
    timings_ms = {"clouds": target_ms + source_ms, "alignment": align_ms}
    return MethodAnswer(np.asarray(result.T_target_source), "", timings_ms)


def gicp_from_rest(task: Task) -> MethodAnswer:
    """GICP from no motion."""
    return gicp(task.pair, task.cache, task.config, np.eye(4))


def floor(task: Task) -> MethodAnswer:
    """GICP from the true motion: how far the truth is from what the depth itself says."""
    return gicp(task.pair, task.cache, task.config, task.pair.T_target_source)


def refine_truth(pair: FramePair, cache: FrameCache, config: Config) -> FramePair:
    """The pair with its true motion refined by GICP, as is usual for KITTI."""
    refined = gicp(pair, cache, config, pair.T_target_source)
    assert refined.T_target_source is not None, "GICP always answers"
    return replace(pair, T_target_source=refined.T_target_source)
