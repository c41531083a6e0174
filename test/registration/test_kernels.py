# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every compiled kernel against its NumPy twin, and both against what is known without either."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from vigg_ros.registration.geometric import describe, estimate_normals, voxel_downsample
from vigg_ros.registration.kernels import cells
from vigg_ros.registration.kernels.cells import CellIndex
from vigg_ros.registration.kernels.lifting import lift_depth, lift_depth_plain
from vigg_ros.registration.kernels.symmetric_icp import symmetric_icp_residuals, symmetric_icp_residuals_plain
from vigg_ros.registration.kernels.normals import surface_normals_plain
from vigg_ros.registration.kernels.voxels import HALF_RANGE_VOXELS, voxel_means, voxel_means_plain
from vigg_ros.registration.kernels.zone import nearest_in_zone, nearest_in_zone_plain
from vigg_ros_testing.registration_samples import motion


def cloud(seed: int, count: int = 400, spread_m: float = 1.0) -> NDArray[np.float32]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-spread_m, spread_m, (count, 3)).astype(np.float32) + np.float32([0.3, -0.2, 2.0])


def sheet(seed: int, count: int = 1500, noise_m: float = 0.002) -> NDArray[np.float32]:
    """A wavy sheet at 2 m, as a depth camera sees one."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-0.5, 0.5, (2, count))
    z = 2 + 0.1 * np.sin(5 * x) * np.cos(4 * y) + rng.normal(0, noise_m, count)
    return np.column_stack((x, y, z)).astype(np.float32)


def rows_sorted(points: NDArray[np.float32]) -> NDArray[np.float32]:
    return points[np.lexsort(points.T)]


@pytest.mark.parametrize("seed", range(4))
def test_voxel_means_equal_their_twin(seed: int) -> None:
    points = cloud(seed, 3000)
    found, expected = (means(points, 0.2, 1.2, 2.8) for means in (voxel_means, voxel_means_plain))
    assert len(voxel_means(points, 0.2, 0.0, np.inf)) > len(found) > 100, "out of range on either side"
    # Sums in another order, rounded to float32 at coordinates up to 3 m.
    np.testing.assert_allclose(rows_sorted(found), rows_sorted(expected), atol=1e-6)


def test_more_voxels_than_the_first_table_holds() -> None:
    points = cloud(0, 200_000, 4.0)
    found = voxel_means(points, 0.1, 0.0, np.inf)
    assert len(found) > 4 * 2**14, "the table has grown twice"
    expected = voxel_means_plain(points, 0.1, 0.0, np.inf)
    np.testing.assert_allclose(rows_sorted(found), rows_sorted(expected), atol=1e-6)


def test_voxel_means_by_hand() -> None:
    points = np.array([(0.1, 0.1, 0.1), (-0.1, 0.1, 0.1), (0.3, 0.5, 0.7), (1.1, 0.1, 0.1)], np.float32)
    found = voxel_means(points, 1.0, 0.0, np.inf)
    # In the order of each voxel's first point; -0.1 is in another voxel than 0.1.
    np.testing.assert_allclose(found, [(0.2, 0.3, 0.4), (-0.1, 0.1, 0.1), (1.1, 0.1, 0.1)], atol=1e-7)


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


def test_normals_of_a_plane_are_known() -> None:
    """x + 2 y + 2 z = 6, seen from the origin: the normal towards it is -(1, 2, 2) / 3."""
    rng = np.random.default_rng(0)
    u, v = np.linalg.svd(np.array([[1.0, 2, 2]]))[2][1:]
    offsets = rng.uniform(-0.3, 0.3, (300, 2))
    points = np.array([6 / 9, 12 / 9, 12 / 9]) + offsets[:, :1] * u + offsets[:, 1:] * v
    found = estimate_normals(points.astype(np.float32), 0.15)
    np.testing.assert_allclose(found, np.tile((-1 / 3, -2 / 3, -2 / 3), (300, 1)), atol=1e-4)


@pytest.mark.parametrize("count", [1, 3])
def test_too_few_neighbours_have_no_normal(count: int) -> None:
    assert not estimate_normals(cloud(0, count, 0.01), 0.1).any()
    assert not surface_normals_plain(cloud(0, count, 0.01), 0.1).any()


def test_points_in_one_place_have_no_normal() -> None:
    points = np.tile(np.float32([0.3, 0.2, 2.0]), (9, 1))
    assert not estimate_normals(points, 0.1).any()
    assert not surface_normals_plain(points, 0.1).any()


@pytest.mark.parametrize("seed", range(5))
def test_points_on_a_line_have_no_normal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    along = rng.normal(size=3)
    points = (np.outer(np.arange(40) * 0.02, along / np.linalg.norm(along)) + (0.3, 0.2, 2)).astype(np.float32)
    assert not estimate_normals(points, 0.07).any()
    assert not surface_normals_plain(points, 0.07).any()
    # One point beside it, 1 cm off, makes a strip; its normal is at right angles to the line.
    strip = np.concatenate((points, points[20:21] + np.float32([0.006, -0.008, 0])))
    known = estimate_normals(strip, 0.07)[20]
    assert np.linalg.norm(known) == pytest.approx(1, abs=1e-5)
    assert abs(known @ along) < 0.02 * np.linalg.norm(along)


def fpfh_plain(
    points: NDArray[np.float32], normals: NDArray[np.float32], radius: float
) -> NDArray[np.float64]:
    """FPFH as Rusu 2009 defines it, one pair after another, unit length at the end."""
    count, bins = len(points), 11
    p, n = points.astype(float), normals.astype(float)
    distance = np.linalg.norm(p[:, None] - p[None], axis=2)
    near = (distance <= radius) & ~np.eye(count, dtype=bool)
    spfh = np.zeros((count, 3 * bins))
    for i, j in np.argwhere(near):
        line = (p[j] - p[i]) / distance[i, j]
        # The normal at the smaller angle to the line is the frame's; the line leads away from it.
        if abs(n[i] @ line) < abs(n[j] @ line):
            own, other, line = n[j], n[i], -line
        else:
            own, other = n[i], n[j]
        v = np.cross(line, own)
        v /= np.linalg.norm(v)
        w = np.cross(own, v)
        angles = (
            (np.arctan2(w @ other, own @ other) + np.pi) / (2 * np.pi),
            (v @ other + 1) / 2,
            (own @ line + 1) / 2,
        )
        for block, angle in enumerate(angles):
            spfh[i, block * bins + min(max(int(angle * bins), 0), bins - 1)] += 100 / near[i].sum()
    out = np.zeros_like(spfh)
    for i in range(count):
        if not near[i].any():
            continue
        around = (spfh[near[i]] / distance[i, near[i], None] ** 2).sum(axis=0).reshape(3, bins)
        around *= 100 / around.sum(axis=1, keepdims=True)
        out[i] = around.ravel() + spfh[i]
        out[i] /= np.linalg.norm(out[i])
    return out


@pytest.mark.parametrize("seed", range(3))
def test_fpfh_is_that_of_its_definition(seed: int) -> None:
    points = voxel_downsample(sheet(seed, 700), 0.05)
    normals = estimate_normals(points, 0.15)
    found, expected = describe(points, normals, 0.2), fpfh_plain(points, normals, 0.2)
    cosine = np.einsum("ni,ni->n", found, expected)
    # An angle on the border of two bins may fall to either side by rounding: one count of some hundred.
    assert np.median(cosine) > 1 - 1e-6
    assert cosine.min() > 0.999


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


@pytest.mark.parametrize("seed", range(6))
def test_the_cells_hold_all_neighbours(seed: int) -> None:
    """Whatever is within one cell size of a query is in its runs, which do not overlap."""
    points, size_m = cloud(seed), 0.25
    index = CellIndex.build(points, size_m)
    queries = np.concatenate((cloud(seed + 100, 200, 1.5), points[:50]))
    runs = index.runs_at(queries)
    for query, around in zip(queries.astype(float), runs, strict=True):
        places = np.concatenate([np.arange(begin, end) for begin, end in around])
        assert len(set(places)) == len(places)
        near = np.linalg.norm(points[index.order] - query, axis=1) <= size_m
        assert set(np.flatnonzero(near)) <= set(places)
        # Nor much more than that: 27 cells reach 2 sizes along each axis at most.
        assert (np.abs(points[index.order[places]] - query) <= 2 * size_m + 1e-5).all()


def test_far_and_missing_queries_have_no_neighbours() -> None:
    index = CellIndex.build(cloud(0), 0.25)
    queries = np.array([(1e6, 0, 0), (-1e6, 0, 0), (0, 0, 1e30), (np.nan, 0, 2), (0.3, -0.2, -5)])
    runs = index.runs_at(queries)
    assert (runs[..., 1] - runs[..., 0] == 0).all()


def test_runs_equal_their_twin() -> None:
    index = CellIndex.build(cloud(1), 0.25)
    steps = np.array([(dx * index.shape[1] + dy) * index.shape[2] for dx in (-1, 0, 1) for dy in (-1, 0, 1)])
    keys = np.random.default_rng(0).integers(-3, int(np.prod(index.shape)), 500)
    np.testing.assert_array_equal(
        cells.runs_of_keys(keys, index.keys, index.starts, index.runs, steps),
        cells.runs_of_keys_plain(keys, index.keys, index.starts, steps),
    )


def test_more_cells_than_can_be_numbered_are_refused() -> None:
    with pytest.raises(ValueError, match="at most"):
        CellIndex.build(np.array([(0, 0, 0), (1e6, 0, 0)]), 0.1)


def facing(points: NDArray[np.float32], seed: int) -> NDArray[np.float32]:
    """A random direction (N, 3) for each point."""
    normals = np.random.default_rng(seed).normal(size=points.shape)
    return (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)


@pytest.mark.parametrize("radius", [0.05, 0.2, 0.25])
def test_symmetric_icp_residuals_equals_its_twin(radius: float) -> None:
    points, target = cloud(2, 400), cloud(3, 600)
    normals, target_normals = facing(points, 0), facing(target, 1)
    T = motion((5, -3, 2), (0.05, 0.02, -0.1))
    index = CellIndex.build(target, 0.25)
    rows, values, jacobian = symmetric_icp_residuals(
        (points, normals), T, (target[index.order], target_normals[index.order]), index.lookup(), radius, 0.5
    )
    wanted = symmetric_icp_residuals_plain((points, normals), T, (target, target_normals), radius=radius, min_cosine=0.5)
    assert 0 < len(rows) < 400
    np.testing.assert_array_equal(rows, wanted[0])
    np.testing.assert_allclose(values, wanted[1], atol=1e-7)
    np.testing.assert_allclose(jacobian, wanted[2], atol=1e-6)


def test_points_far_off_pair_with_nothing() -> None:
    target = cloud(0)
    index = CellIndex.build(target, 0.25)
    points = np.float32([(1e6, 0, 0), (-1e6, 0, 0), (0, 0, 1e30), (np.nan, 0, 2), (0.3, -0.2, -5)])
    lying = target[index.order], facing(target, 0)[index.order]
    rows, values, jacobian = symmetric_icp_residuals((points, points), np.eye(4), lying, index.lookup(), 0.25, -1.0)
    assert (len(rows), values.shape, jacobian.shape) == (0, (0,), (0, 6))


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
    rng = np.random.default_rng(0)
    points, queries = cloud(4, 600), cloud(5, 300)
    features, wanted = (rng.normal(size=(n, 33)).astype(np.float32) for n in (600, 300))
    features /= np.linalg.norm(features, axis=1, keepdims=True)
    wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    index = CellIndex.build(points, 0.25)
    order = index.order
    found, similarity = nearest_in_zone(
        queries, wanted, points[order], features[order], index.runs_at(queries), radius
    )
    expected, cosine = nearest_in_zone_plain(queries, wanted, points[order], features[order], radius)
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_allclose(similarity, cosine, atol=1e-6)
    assert (found == -1).any()
    assert (found >= 0).any()


def test_the_zone_decides_before_the_feature() -> None:
    """Three points at 5, 9 and 11 cm; the farthest is the most similar, the nearest the least."""
    points = np.float32([(0.05, 0, 2), (0.09, 0, 2), (0.11, 0, 2)])
    features = np.float32([(0, 1, 0), (0.6, 0.8, 0), (1, 0, 0)])
    query, wanted = np.float32([(0, 0, 2)]), np.float32([(1, 0, 0)])
    index = CellIndex.build(points, 0.2)
    for radius, best, cosine in ((0.04, -1, 0.0), (0.06, 0, 0.0), (0.10, 1, 0.6), (0.12, 2, 1.0)):
        found, similarity = nearest_in_zone(
            query, wanted, points[index.order], features[index.order], index.runs_at(query), radius
        )
        assert (index.order[found[0]] if found[0] >= 0 else -1) == best
        assert similarity[0] == pytest.approx(cosine, abs=1e-6)
