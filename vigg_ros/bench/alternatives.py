# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The alternatives, through their own libraries, with the settings their documents suggest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.frame_cache import timed, timed_stages
from vigg_ros.bench.methods import Method, MethodAnswer, Task
from vigg_ros.bench.pairs import FramePair
from vigg_ros.registration import Config, Frame
from vigg_ros.registration.cliques import propose
from vigg_ros.registration.config import PAPER
from vigg_ros.registration.geometric import match_global, rows_in_range
from vigg_ros.registration.geometry import DepthMap
from vigg_ros.registration.local_match import refit
from vigg_ros.registration.matches import no_matches

FEATURE_VOXELS = 2.0
"""Grid of Open3D's global methods, in voxels: 5 cm for depth images, as its tutorial has it, 60 cm for scans."""

REACH_VOXELS = 4.0
"""How far from a point ICP looks for its counterpart."""

NO_ANSWER = "NO_ANSWER"
"""What a library gives no more reason for."""


def points_in_range(frame: Frame, config: Config) -> NDArray[np.float64]:
    """The points (N, 3) that our method would use too."""
    points = frame.points()
    return points[rows_in_range(points, config.geometric)].astype(np.float64)


def cloud_with_normals(task: Task, voxel_m: float, frame: Frame) -> Any:
    """Open3D's cloud on a grid, with normals."""
    import open3d as o3d

    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points_in_range(frame, task.config)))
    cloud = cloud.voxel_down_sample(voxel_m)
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius=2 * voxel_m, max_nn=30))
    return cloud


def cloud_with_features(task: Task, voxel_m: float, frame: Frame) -> tuple[Any, Any]:
    """Open3D's cloud with normals towards the sensor, and FPFH."""
    import open3d as o3d

    cloud = cloud_with_normals(task, voxel_m, frame)
    cloud.orient_normals_towards_camera_location(np.zeros(3))
    around = o3d.geometry.KDTreeSearchParamHybrid(radius=5 * voxel_m, max_nn=100)
    return cloud, o3d.pipelines.registration.compute_fpfh_feature(cloud, around)


def _search_by_features(task: Task, voxel_m: float, search: Callable[[Any, Any, Any, Any], Any]) -> Any:
    """What Open3D finds from source, target and their features, and the milliseconds by stage."""
    import open3d as o3d

    make = partial(cloud_with_features, task, voxel_m)
    (target, of_target), (source, of_source), prepared_ms = task.derived(("fpfh", voxel_m), make)
    o3d.utility.random.seed(task.config.seed)
    result, search_ms = timed(lambda: search(source, target, of_source, of_target))
    return result, {"clouds and features": prepared_ms, "matches and search": search_ms}


def fpfh_ransac(task: Task) -> MethodAnswer:
    """Open3D's tutorial: mutual FPFH matches, RANSAC with edge lengths and distances checked."""
    from open3d.pipelines import registration as kit

    voxel_m = FEATURE_VOXELS * task.config.geometric.voxel_size_m
    reach_m = 1.5 * voxel_m
    checks = [kit.CorrespondenceCheckerBasedOnEdgeLength(0.9), kit.CorrespondenceCheckerBasedOnDistance(reach_m)]
    settings = (
        True, reach_m, kit.TransformationEstimationPointToPoint(False), 4, checks,
        kit.RANSACConvergenceCriteria(100000, 0.999),
    )  # fmt: skip
    ransac = kit.registration_ransac_based_on_feature_matching
    result, timings_ms = _search_by_features(task, voxel_m, lambda *clouds: ransac(*clouds, *settings))
    return _answer(result.transformation, timings_ms, found=result.fitness > 0)


def fpfh_fgr(task: Task) -> MethodAnswer:
    """Open3D's fast global registration on the same features."""
    from open3d.pipelines import registration as kit

    voxel_m = FEATURE_VOXELS * task.config.geometric.voxel_size_m
    option = kit.FastGlobalRegistrationOption(maximum_correspondence_distance=0.5 * voxel_m)
    fgr = kit.registration_fgr_based_on_feature_matching
    result, timings_ms = _search_by_features(task, voxel_m, lambda *clouds: fgr(*clouds, option))
    return _answer(result.transformation, timings_ms, found=True)


def icp(task: Task, *, to_plane: bool) -> MethodAnswer:
    """Open3D's ICP from no motion."""
    from open3d.pipelines import registration as kit

    voxel_m = task.config.geometric.voxel_size_m
    target, source, prepared_ms = task.derived(("normals", voxel_m), partial(cloud_with_normals, task, voxel_m))
    estimation = kit.TransformationEstimationPointToPlane() if to_plane else kit.TransformationEstimationPointToPoint()
    reach_m = REACH_VOXELS * voxel_m
    result, align_ms = timed(lambda: kit.registration_icp(source, target, reach_m, np.eye(4), estimation))
    return _answer(result.transformation, {"clouds": prepared_ms, "alignment": align_ms}, found=result.fitness > 0)


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
    return gicp(task, np.eye(4))


def floor(task: Task) -> MethodAnswer:
    """GICP from the true motion: how far the truth is from what the depth itself says."""
    return gicp(task, task.pair.T_target_source)


def refine_truth(task: Task) -> FramePair:
    """The pair with its true motion refined by GICP, as is usual for KITTI."""
    refined = floor(task)
    assert refined.T_target_source is not None, "GICP always answers"
    return replace(task.pair, T_target_source=refined.T_target_source)


def rgbd_odometry(task: Task) -> MethodAnswer:
    """Open3D's RGB-D odometry (hybrid term) from no motion; it needs depth images."""
    import open3d as o3d

    geometry = task.cache.frame(task.pair.target).geometry
    if not isinstance(geometry, DepthMap):
        return MethodAnswer(None, "NO_DEPTH_IMAGE", {})
    make = partial(_rgbd_image, task.config.geometric.max_range_m)
    target, source, prepared_ms = task.derived(("rgbd", task.config.geometric.max_range_m), make)
    camera = geometry.camera
    pinhole = o3d.camera.PinholeCameraIntrinsic(
        camera.width_px, camera.height_px, camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px
    )
    option = o3d.pipelines.odometry.OdometryOption(
        depth_min=task.config.geometric.min_range_m, depth_max=task.config.geometric.max_range_m
    )
    term = o3d.pipelines.odometry.RGBDOdometryJacobianFromHybridTerm()
    (found, T_target_source, _), align_ms = timed(
        lambda: o3d.pipelines.odometry.compute_rgbd_odometry(source, target, pinhole, np.eye(4), term, option)
    )
    return _answer(T_target_source, {"images": prepared_ms, "alignment": align_ms}, found=bool(found))


def _rgbd_image(max_range_m: float, frame: Frame) -> Any:
    import open3d as o3d

    assert isinstance(frame.geometry, DepthMap), "checked by the caller"
    colours = frame.image if frame.image.ndim == 3 else np.repeat(frame.image[..., None], 3, axis=2)
    return o3d.geometry.RGBDImage.create_from_color_and_depth(
        o3d.geometry.Image(np.ascontiguousarray(colours[..., ::-1])),
        o3d.geometry.Image(np.ascontiguousarray(frame.geometry.depth_m)),
        depth_scale=1.0,
        depth_trunc=max_range_m,
        convert_rgb_to_intensity=True,
    )


def kiss_matcher(task: Task) -> MethodAnswer:
    """KISS-Matcher with its defaults, on grids of 5 cm for depth images and 30 cm for scans, as its authors have."""
    import kiss_matcher as kiss

    is_depth = isinstance(task.cache.frame(task.pair.target).geometry, DepthMap)
    voxel_m = (2.0 if is_depth else 1.0) * task.config.geometric.voxel_size_m
    target, source, prepared_ms = task.derived(
        ("list", task.config.geometric), lambda frame: list(points_in_range(frame, task.config).astype(np.float32))
    )
    matcher = kiss.KISSMatcher(kiss.KISSMatcherConfig(voxel_m))
    solution, solve_ms = timed(lambda: matcher.estimate(source, target))
    T_target_source = np.eye(4)
    T_target_source[:3, :3] = np.asarray(solution.rotation)
    T_target_source[:3, 3] = np.asarray(solution.translation).ravel()
    return _answer(T_target_source, {"points": prepared_ms, "all else": solve_ms}, found=bool(solution.valid))


def fpfh_mac(task: Task) -> MethodAnswer:
    """MAC on geometric matches alone: our FPFH, one-directional matches and clique code, then post-refinement."""
    config = task.config.replace(PAPER).replace({"cliques.geometric_hypotheses": True})
    target, source, features_ms = task.features(config)

    def work() -> NDArray[np.float64] | None:
        matches = match_global(target.landmarks, source.landmarks, config.geometric, seed=config.seed)
        hypotheses = propose(no_matches(), matches, config.cliques)
        if not len(hypotheses):
            return None
        return refit(matches, hypotheses.T_target_source[0], config.cliques.inlier_threshold_m)

    T_target_source, timings_ms = timed_stages(work)
    reason = NO_ANSWER if T_target_source is None else ""
    return MethodAnswer(T_target_source, reason, {"extraction": features_ms, **timings_ms})


def _answer(T_target_source: NDArray[np.float64], timings_ms: dict[str, float], *, found: bool) -> MethodAnswer:
    if not found or not np.isfinite(T_target_source).all():
        return MethodAnswer(None, NO_ANSWER, timings_ms)
    return MethodAnswer(np.array(T_target_source, np.float64), "", timings_ms)


_CODE = (__name__, "vigg_ros.bench.frame_cache")
_CLIQUE_CODE = (__name__, "vigg_ros.registration")

BASELINES = {
    method.name: method
    for method in (
        Method("fpfh-ransac", "Open3D: FPFH and RANSAC", fpfh_ransac, "open3d", _CODE),
        Method("fpfh-fgr", "Open3D: FPFH and fast global registration", fpfh_fgr, "open3d", _CODE),
        Method("icp-point", "Open3D: point-to-point ICP from no motion", partial(icp, to_plane=False), "open3d", _CODE),
        Method("icp-plane", "Open3D: point-to-plane ICP from no motion", partial(icp, to_plane=True), "open3d", _CODE),
        Method("gicp", "small_gicp: GICP from no motion", gicp_from_rest, "small_gicp", _CODE),
        Method("rgbd-odometry", "Open3D: RGB-D odometry from no motion", rgbd_odometry, "open3d", _CODE),
        Method("kiss-matcher", "KISS-Matcher", kiss_matcher, "kiss_matcher", _CODE),
        Method("fpfh-mac", "FPFH and maximal cliques, by our own code", fpfh_mac, "", _CLIQUE_CODE),
        Method("floor", "GICP from the truth, against the truth: nobody can be measured below it", floor, "small_gicp",
               _CODE),
    )
}  # fmt: skip
