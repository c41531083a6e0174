# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every compiled kernel against its NumPy twin, and both against what is known without either."""

import numpy as np
import pytest
from numpy.typing import NDArray

from vigg_ros.registration.geometric import describe, estimate_normals, voxel_downsample
from vigg_ros.registration.kernels.cells import CellIndex
from vigg_ros.registration.kernels.depth_planes import depth_planes, depth_planes_plain
from vigg_ros.registration.kernels.lifting import lift_depth, lift_depth_plain
from vigg_ros.registration.kernels.normals import surface_normals_plain
from vigg_ros.registration.kernels.projective_icp import projective_icp_residuals, projective_icp_residuals_plain
from vigg_ros.registration.kernels.symmetric_icp import symmetric_icp_residuals, symmetric_icp_residuals_plain
from vigg_ros.registration.kernels.voxels import HALF_RANGE_VOXELS, voxel_means, voxel_means_plain
from vigg_ros.registration.kernels.zone import nearest_in_zone, nearest_in_zone_plain
from vigg_ros_testing.registration_samples import motion

Points = NDArray[np.float32]


def cloud(seed: int, count: int = 400, spread_m: float = 1.0) -> Points:
    rng = np.random.default_rng(seed)
    return rng.uniform(-spread_m, spread_m, (count, 3)).astype(np.float32) + np.float32([0.3, -0.2, 2.0])


def sheet(seed: int, count: int = 1500, noise_m: float = 0.002) -> Points:
    """A wavy sheet at 2 m, as a depth camera sees one."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-0.5, 0.5, (2, count))
    z = 2 + 0.1 * np.sin(5 * x) * np.cos(4 * y) + rng.normal(0, noise_m, count)
    return np.column_stack((x, y, z)).astype(np.float32)


def unit_vectors(seed: int, count: int, size: int = 3) -> NDArray[np.float32]:
    vectors = np.random.default_rng(seed).normal(size=(count, size))
    return (vectors / np.linalg.norm(vectors, axis=1, keepdims=True)).astype(np.float32)


def rows_sorted(points: Points) -> Points:
    return points[np.lexsort(points.T)]


@pytest.mark.parametrize(
    ("points", "voxel_m", "ranges_m", "voxels"),
    [
        *((cloud(seed, 3000), 0.2, (1.2, 2.8), 100) for seed in range(4)),
        (cloud(0, 200_000, 4.0), 0.1, (0.0, np.inf), 4 * 2**14),  # the first table has grown twice
    ],
)
def test_voxel_means_equal_their_twin(points, voxel_m, ranges_m, voxels) -> None:
    found, expected = (means(points, voxel_m, *ranges_m) for means in (voxel_means, voxel_means_plain))
    assert len(found) > voxels
    # Sums in another order, rounded to float32 at coordinates up to 6 m.
    np.testing.assert_allclose(rows_sorted(found), rows_sorted(expected), atol=1e-6)


def test_voxel_means_by_hand() -> None:
    points = np.array([(0.1, 0.1, 0.1), (-0.1, 0.1, 0.1), (0.3, 0.5, 0.7), (1.1, 0.1, 0.1)], np.float32)
    # In the order of each voxel's first point; -0.1 is in another voxel than 0.1.
    means = [(0.2, 0.3, 0.4), (-0.1, 0.1, 0.1), (1.1, 0.1, 0.1)]
    np.testing.assert_allclose(voxel_means(points, 1.0, 0.0, np.inf), means, atol=1e-7)
    # The last is 1.109 m from the origin, the second 0.173.
    np.testing.assert_allclose(voxel_means(points, 1.0, 0.0, 1.1), means[:2], atol=1e-7)
    np.testing.assert_allclose(voxel_means(points, 1.0, 1.0, np.inf), means[2:], atol=1e-7)


def test_voxels_at_the_edges_of_the_grid_are_told_apart() -> None:
    far = (HALF_RANGE_VOXELS - 1) * 0.5
    corners = np.array([(x, y, z) for x in (-far, far) for y in (-far, far) for z in (-far, far)], np.float32)
    assert len(voxel_downsample(corners, 0.5)) == 8
    assert len(voxel_downsample(np.float32([(0, 0, HALF_RANGE_VOXELS * 0.5), (1, 2, 3)]), 0.5)) == 1
    assert voxel_downsample(np.empty((0, 3), np.float32), 0.5).shape == (0, 3)


@pytest.mark.parametrize("seed", range(3))
def test_normals_equal_their_twin(seed: int) -> None:
    points = voxel_downsample(sheet(seed), 0.03)
    found, expected = estimate_normals(points, 0.08), surface_normals_plain(points, 0.08)
    known = np.any(expected != 0, axis=1)
    assert known.mean() > 0.9
    np.testing.assert_array_equal(np.any(found != 0, axis=1), known)
    # float32 sums of some ten products: 1e-6 of the patch, magnified by its flatness.
    cosine = np.einsum("ni,ni->n", found[known], expected[known])
    assert np.quantile(cosine, 0.01) > 1 - 1e-5
    assert cosine.min() > 0.999


def line(seed: int) -> tuple[Points, NDArray[np.float64]]:
    """Forty points 2 cm apart, and the unit vector (3,) along them."""
    (along,) = unit_vectors(seed, 1).astype(float)
    return (np.outer(np.arange(40) * 0.02, along) + (0.3, 0.2, 2)).astype(np.float32), along


@pytest.mark.parametrize(
    "points",
    [cloud(0, 1, 0.01), cloud(0, 3, 0.01), np.tile(cloud(0, 1), (9, 1)), *(line(seed)[0] for seed in range(5))],
    ids=["one point", "three points", "one place", *(f"line {seed}" for seed in range(5))],
)
def test_what_is_no_surface_has_no_normal(points: Points) -> None:
    assert not estimate_normals(points, 0.07).any()
    assert not surface_normals_plain(points, 0.07).any()


@pytest.mark.parametrize("seed", range(5))
def test_one_point_beside_a_line_makes_a_strip(seed: int) -> None:
    points, along = line(seed)
    strip = np.concatenate((points, points[20:21] + np.float32([0.006, -0.008, 0])))
    known = estimate_normals(strip, 0.07)[20]
    assert np.linalg.norm(known) == pytest.approx(1, abs=1e-5)
    assert abs(known @ along) < 0.02


def test_fpfh_agrees_with_open3d() -> None:
    o3d = pytest.importorskip("open3d", reason="open3d is not installed")
    points = voxel_downsample(sheet(5, 4000), 0.03)
    normals = estimate_normals(points, 0.1)
    peer = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points.astype(float)))
    peer.normals = o3d.utility.Vector3dVector(normals.astype(float))
    search = o3d.geometry.KDTreeSearchParamRadius(0.2)
    expected = np.asarray(o3d.pipelines.registration.compute_fpfh_feature(peer, search).data).T
    expected = expected / np.linalg.norm(expected, axis=1, keepdims=True)
    cosine = np.einsum("ni,ni->n", describe(points, normals, 0.2), expected)
    # Same definition; rounding moves single counts between bins, and pairs at the radius in or out.
    assert np.median(cosine) > 0.9999
    assert np.quantile(cosine, 0.01) > 0.998


def test_a_point_alone_has_no_feature() -> None:
    points = np.float32([(0, 0, 2), (5, 0, 2), (5.05, 0, 2)])
    features = describe(points, np.float32([(0, 0, -1)] * 3), 0.2)
    assert not features[0].any()
    np.testing.assert_allclose(np.linalg.norm(features[1:], axis=1), 1, atol=1e-6)
    assert describe(points[:0], points[:0], 0.2).shape == (0, 33)


@pytest.mark.parametrize("seed", range(3))
def test_the_cells_hold_all_neighbours(seed: int) -> None:
    """Whatever is within one cell size of a query is in its runs, which do not overlap."""
    points, size_m = cloud(seed), 0.25
    index = CellIndex.build(points, size_m)
    queries = np.concatenate((cloud(seed + 100, 200, 1.5), points[:50]))
    for query, around in zip(queries.astype(float), index.runs_at(queries), strict=True):
        places = np.concatenate([np.arange(begin, end) for begin, end in around])
        assert len(set(places)) == len(places)
        near = np.linalg.norm(points[index.order] - query, axis=1) <= size_m
        assert set(np.flatnonzero(near)) <= set(places)
        # Nor much more than that: 27 cells reach 2 sizes along each axis at most.
        assert (np.abs(points[index.order[places]] - query) <= 2 * size_m + 1e-5).all()


@pytest.mark.parametrize("radius", [0.05, 0.2, 0.25])
def test_symmetric_icp_residuals_equal_their_twin(radius: float) -> None:
    source, target = ((cloud(seed, count), unit_vectors(seed, count)) for seed, count in ((2, 400), (3, 600)))
    T_target_source = motion((5, -3, 2), (0.05, 0.02, -0.1))
    index = CellIndex.build(target[0], 0.25)
    in_cells = target[0][index.order], target[1][index.order]
    rows, values, jacobian = symmetric_icp_residuals(source, T_target_source, in_cells, index.lookup(), radius, 0.5)
    wanted = symmetric_icp_residuals_plain(source, T_target_source, target, radius=radius, min_cosine=0.5)
    assert 0 < len(rows) < 400
    np.testing.assert_array_equal(rows, wanted[0])
    np.testing.assert_allclose(values, wanted[1], atol=1e-7)
    np.testing.assert_allclose(jacobian, wanted[2], atol=1e-6)


def test_points_far_off_have_no_neighbours() -> None:
    target = cloud(0)
    index = CellIndex.build(target, 0.25)
    far = np.array([(1e6, 0, 0), (-1e6, 0, 0), (0, 0, 1e30), (np.nan, 0, 2), (0.3, -0.2, -5)])
    runs = index.runs_at(far)
    assert (runs[..., 1] - runs[..., 0] == 0).all()
    points, in_cells = far.astype(np.float32), (target[index.order], unit_vectors(0, 400)[index.order])
    found = symmetric_icp_residuals((points, points), np.eye(4), in_cells, index.lookup(), 0.25, -1.0)
    assert [values.shape for values in found] == [(0,), (0,), (0, 6)]
    with pytest.raises(ValueError, match="at most"):  # more cells than can be numbered
        CellIndex.build(np.array([(0, 0, 0), (1e6, 0, 0)]), 0.1)


def test_lifting_equals_its_twin_and_leaves_out_what_was_not_measured() -> None:
    depth_m = np.random.default_rng(0).uniform(0.5, 4, (30, 40)).astype(np.float32)
    depth_m[::3, 5:] = 0
    intrinsics = [np.float32(value) for value in (31.5, 33.25, 19.5, 14.5)]
    found = lift_depth(depth_m, *intrinsics)
    np.testing.assert_allclose(found, lift_depth_plain(depth_m, *intrinsics), rtol=1e-6)
    assert len(found) == np.count_nonzero(depth_m)
    assert lift_depth(np.zeros((3, 4), np.float32), *intrinsics).shape == (0, 3)


@pytest.mark.parametrize("radius", [0.05, 0.2, 0.25])
def test_nearest_in_zone_equals_its_twin(radius: float) -> None:
    points, queries = cloud(4, 600), cloud(5, 300)
    features, wanted = unit_vectors(0, 600, 33), unit_vectors(1, 300, 33)
    index = CellIndex.build(points, 0.25)
    in_cells = points[index.order], features[index.order]
    found, similarity = nearest_in_zone(queries, wanted, *in_cells, index.runs_at(queries), radius)
    expected, cosine = nearest_in_zone_plain(queries, wanted, *in_cells, radius)
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_allclose(similarity, cosine, atol=1e-6)
    assert (found == -1).any()
    assert (found >= 0).any()


def broken_depth(seed: int, shape: tuple[int, int]) -> NDArray[np.float32]:
    """Two slanted planes that meet in a jump, noisy, with holes of all sizes and a band without any depth."""
    rng = np.random.default_rng(seed)
    v, u = np.indices(shape)
    inverse = 0.4 + 0.002 * u - 0.001 * v + 0.2 * (u > 0.6 * shape[1]) + rng.normal(0, 0.002, shape)
    depth_m = 1 / inverse
    depth_m[rng.random(shape) < 0.1] = 0
    depth_m[shape[0] // 3 : shape[0] // 3 + 4, :20] = 0
    return depth_m.astype(np.float32)


def intrinsics(shape: tuple[int, int]) -> tuple[float, float, float, float]:
    return 0.9 * shape[1], 0.92 * shape[1], (shape[1] - 1) / 2 + 0.3, (shape[0] - 1) / 2 - 0.2


@pytest.mark.parametrize("shape", [(48, 64), (61, 83)])
@pytest.mark.parametrize(("step", "half", "stride"), [(1, 2, 1), (2, 3, 1), (3, 5, 2), (4, 6, 2), (5, 8, 2)])
def test_depth_planes_equal_their_twin(shape: tuple[int, int], step: int, half: int, stride: int) -> None:
    depth_m, camera = broken_depth(step, shape), intrinsics(shape)
    found, expected = (planes(depth_m, camera, step, half, stride) for planes in (depth_planes, depth_planes_plain))
    assert found.shape == (shape[0] // step, shape[1] // step, 5)
    assert 0.2 < np.mean(found[..., 0] > 0) < 0.95, "some windows are planes, some are not"
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_projective_icp_residuals_equal_their_twin(seed: int) -> None:
    shape, step = (48, 64), 2
    camera = intrinsics(shape)
    target, source = (depth_planes(broken_depth(n, shape), camera, step, 3, 1) for n in (seed, seed + 10))
    rows, columns = np.nonzero(source[..., 0] > 0)
    z = source[rows, columns, 0]
    rays = ((step * columns + 1 - camera[2]) / camera[0], (step * rows + 1 - camera[3]) / camera[1], np.ones(len(z)))
    points = (np.column_stack(rays) * z[:, None]).astype(np.float32)
    points[:5, 2] = (-1, 0, 1e-3, 5, 50)  # behind, in the camera, and far off
    samples = points, np.ascontiguousarray(source[rows, columns, 1:4]), (0.004 * z**2).astype(np.float32)
    planes = target, (0.004 * target[..., 0] ** 2).astype(np.float32)
    T = motion((1, -2, 3), (0.02, -0.01, 0.03))
    arguments = samples, T, planes, camera, step, (4.0, 0.02, 0.5)
    found, expected = projective_icp_residuals(*arguments), projective_icp_residuals_plain(*arguments)
    assert 0.2 < len(found[0]) / len(points) < 0.95
    np.testing.assert_array_equal(found[0], expected[0])
    for one, other in zip(found[1:], expected[1:], strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-6)


def test_samples_that_see_no_plane_have_no_residuals() -> None:
    nothing = np.zeros((24, 32, 5), np.float32), np.zeros((24, 32), np.float32)
    samples = cloud(0), unit_vectors(0, 400), np.full(400, 0.01, np.float32)
    found = projective_icp_residuals(samples, np.eye(4), nothing, intrinsics((48, 64)), 2, (4.0, 0.05, -1.0))
    assert [part.shape for part in found] == [(0,), (0,), (0,), (0, 6)]
