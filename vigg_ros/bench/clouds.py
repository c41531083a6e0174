# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Clouds aligned by small_gicp: as baselines, as the floor, and to refine poses that serve as the truth."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.frame_cache import timed
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


def gicp(task: Task, T_start: NDArray[np.float64]) -> MethodAnswer:
    """GICP from a first guess, on one thread. It always answers."""
    import small_gicp

    voxel_m = task.config.geometric.voxel_size_m

    def prepare(frame: Frame) -> Any:
        points = points_in_range(frame, task.config)
        return small_gicp.preprocess_points(points, downsampling_resolution=voxel_m, num_threads=1)

    (target, tree), (source, _), prepared_ms = task.derived(("gicp", task.config.geometric), prepare)
    options = {"registration_type": "GICP", "num_threads": 1, "max_iterations": 50}
    reach_m = REACH_VOXELS * voxel_m
    result, align_ms = timed(
        lambda: small_gicp.align(
            target, source, tree, init_T_target_source=T_start, max_correspondence_distance=reach_m, **options
        )
    )
    return MethodAnswer(np.asarray(result.T_target_source), "", {"clouds": prepared_ms, "alignment": align_ms})


def gicp_from_rest(task: Task) -> MethodAnswer:
    """GICP from no motion."""
    return gicp(task, np.eye(4))


def floor(task: Task) -> MethodAnswer:
    """GICP from the true motion: how far the truth is from what the depth itself says."""
    return gicp(task, task.pair.T_target_source)


def refine_truth(task: Task) -> FramePair:
    """The pair with its true motion refined by GICP, as is usual for KITTI."""
    refined = floor(task)
    assert refined.T_target_source is not None, "GICP always answers"
    return replace(task.pair, T_target_source=refined.T_target_source)
