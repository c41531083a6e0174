# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which pixel sees which point of a scan."""

from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from vigg_ros.bench.worlds import render_depth, render_lidar
from vigg_ros.bench.worlds.poses import Pose
from vigg_ros.registration import Frame
from vigg_ros.registration.errors import DataError
from vigg_ros.registration.rigid import inverse, transform
from vigg_ros_testing.street_samples import (
    CAMERA,
    LIDAR,
    T_BASE_CAMERA,
    T_BASE_LIDAR,
    T_CAMERA_LIDAR,
    a_street,
    along,
)

IMAGE = np.zeros((CAMERA.height_px, CAMERA.width_px, 3), np.uint8)


def grid(spacing_px: int) -> NDArray[np.float64]:
    """Pixels (K, 2) all over the image, none within 10 px of its border."""
    u, v = np.meshgrid(
        np.arange(10, CAMERA.width_px - 10, spacing_px), np.arange(10, CAMERA.height_px - 10, spacing_px)
    )
    return np.column_stack((u.ravel(), v.ravel())).astype(np.float64)


def at_depth(pixels: NDArray[np.float64], depth_m: float) -> NDArray[np.float64]:
    return CAMERA.lift(pixels, np.full(len(pixels), depth_m))


def frame_of(points: NDArray[Any], T_camera_points: NDArray[Any] | None = None, **options: Any) -> Frame:
    T_camera_points = np.eye(4) if T_camera_points is None else T_camera_points
    return Frame.from_points(IMAGE, points, CAMERA, T_camera_points, **options)


def street_view(T_world_base: Pose) -> tuple[Frame, NDArray[np.float32]]:
    """A frame without range noise, and the exact depth at its pixels."""
    points, _ = render_lidar(a_street(), T_world_base @ T_BASE_LIDAR, LIDAR)
    depth_m = render_depth(a_street(), CAMERA, T_world_base @ T_BASE_CAMERA)
    return frame_of(points, T_CAMERA_LIDAR), np.where(depth_m > 0, depth_m, np.float32(1e6))


@pytest.fixture(scope="module", params=[0.0, 6.0])
def view(request: pytest.FixtureRequest) -> tuple[Frame, NDArray[np.float32]]:
    """Between parked cars, where the camera stands 0.6 m ahead of the LiDAR and 0.4 m below it."""
    return street_view(along(request.param))


def has_point(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.isfinite(points).all(axis=1)


def test_a_pixel_sees_the_point_that_projects_onto_it_in_the_frame_of_the_points() -> None:
    pixels = grid(20)
    T_camera_points = np.round(inverse(T_BASE_CAMERA) @ T_BASE_LIDAR, 4)  # as printed in some file
    points = transform(inverse(T_camera_points), at_depth(pixels, 12.0)).astype(np.float32)
    frame = frame_of(points, T_camera_points)
    np.testing.assert_array_equal(frame.points_at(pixels), points)
    np.testing.assert_array_equal(frame.points(), points)


@pytest.mark.parametrize(("offset_px", "sees"), [(0.0, True), (4.9, True), (5.1, False)])
def test_a_pixel_sees_as_far_as_five_pixels(offset_px: float, sees: bool) -> None:
    # Points 20 px apart: no other one is nearer than 14.9 px. Float32 metres at 10 m are good for 0.0001 px.
    pixels = grid(20)
    for direction in ((1, 0), (0, -1), (0.6, 0.8)):
        seen = frame_of(at_depth(pixels, 10.0)).points_at(pixels + offset_px * np.asarray(direction))
        assert (has_point(seen) == sees).all()


def test_a_pixel_takes_the_nearest_of_several_points() -> None:
    pixels = grid(20)
    left, right = at_depth(pixels, 10.0), at_depth(pixels + (6.0, 0.0), 10.2)
    frame = frame_of(np.vstack((left, right)))
    np.testing.assert_allclose(frame.points_at(pixels + (2.9, 0.0)), left, atol=1e-5)
    np.testing.assert_allclose(frame.points_at(pixels + (3.1, 0.0)), right, atol=1e-5)


def test_points_behind_the_camera_or_beside_the_image_are_kept_but_not_seen() -> None:
    pixels = grid(20)
    ahead = at_depth(pixels, 10.0)
    # Mirrored through the camera they would project onto the same pixels.
    behind = -at_depth(pixels, 3.0)
    beside = at_depth(pixels + (CAMERA.width_px, 0.0), 10.0)
    frame = frame_of(np.vstack((behind, ahead, beside)))
    np.testing.assert_allclose(frame.points_at(pixels), ahead, atol=1e-5)
    assert len(frame.points()) == 3 * len(pixels)


def test_a_panel_hides_what_the_scanner_saw_behind_it() -> None:
    """A panel 4 m away, 200 x 100 px, before a wall at 20 m that the scanner saw as if there were no panel."""
    pixels = grid(3)
    in_panel = (np.abs(pixels - (256, 128)) < (100, 50)).all(axis=1)
    wall, panel = at_depth(pixels, 20.0), at_depth(pixels[in_panel], 4.0)
    rows, _ = frame_of(np.vstack((wall, panel))).geometry.visible()  # type: ignore[union-attr]
    wall_seen = np.isin(np.arange(len(wall)), rows)
    # Decided in cells of 5 px: within one of the panel's border either is right.
    beside_px = (np.abs(pixels - (256, 128)) - (100, 50)).max(axis=1)
    assert not wall_seen[beside_px < -5].any()
    assert wall_seen[beside_px > 10].all()
    assert np.isin(len(wall) + np.arange(len(panel)), rows).all()


def test_ground_that_runs_away_hides_nothing() -> None:
    # 1.5 m below the camera. Beyond 16 m one cell of 5 px spans 17 % of the depth, and its far part goes.
    x, z = np.meshgrid(np.linspace(-3, 3, 40), np.linspace(4.5, 15, 120))
    ground = np.column_stack((x.ravel(), np.full(x.size, 1.5), z.ravel()))
    rows, _ = frame_of(ground).geometry.visible()  # type: ignore[union-attr]
    inside = CAMERA.contains(CAMERA.project(ground))
    assert len(rows) == np.count_nonzero(inside) > 1000


def test_points_that_are_not_finite_go_with_their_times() -> None:
    points = at_depth(grid(20), 10.0)
    points[::5] = (np.nan, 0, 1)
    points[1::5] = (0, np.inf, 1)
    frame = frame_of(points, times_s=np.arange(len(points)) * 1e-4)
    kept = np.flatnonzero(np.isfinite(points).all(axis=1))
    scan = frame.scan_with_times()
    assert scan is not None
    np.testing.assert_array_equal(scan[0], points[kept].astype(np.float32))
    np.testing.assert_array_equal(scan[1], kept * 1e-4)


@pytest.mark.parametrize("times_s", [np.zeros(3), np.zeros((5, 1)), np.full(5, np.nan)])
def test_times_that_do_not_belong_to_the_points_are_refused(times_s: NDArray[np.float64]) -> None:
    with pytest.raises(DataError, match=r"times_s") as caught:
        frame_of(np.ones((5, 3)), times_s=times_s)
    assert caught.value.code == "POINT_TIMES"


def test_within_view_keeps_what_the_camera_sees() -> None:
    pixels = grid(10)
    points = np.vstack((-at_depth(pixels, 3.0), at_depth(pixels, 10.0)))
    times_s = np.arange(len(points)) * 1e-5
    frame = frame_of(points, times_s=times_s, within_view=True)
    scan = frame.scan_with_times()
    assert scan is not None
    np.testing.assert_array_equal(scan[0], points[len(pixels) :].astype(np.float32))
    np.testing.assert_array_equal(scan[1], times_s[len(pixels) :])
    np.testing.assert_array_equal(frame.points_at(pixels), frame_of(points).points_at(pixels))


def spoiled(row: int, column: int, value: float) -> NDArray[np.float64]:
    T_camera_points = np.eye(4)
    T_camera_points[row, column] = value
    return T_camera_points


AHEAD = at_depth(grid(20), 10.0)


NO_SHAPES = [np.zeros((60, 4), "f4"), np.zeros((60, 2), "f4"), np.zeros(60, "f4"), np.zeros((60, 3), int)]
SPOILED = [(0, 3, np.nan), (0, 0, -1.0), (0, 1, 0.1), (3, 2, 1.0)]  # by NaN, mirrored, sheared, projective


@pytest.mark.parametrize(
    ("points", "T_camera_points", "code", "expected"),
    [
        *((points, None, "POINTS_SHAPE", r"floating-point metres of shape \(N, 3\)") for points in NO_SHAPES),
        *((AHEAD, spoiled(*entry), "BAD_EXTRINSICS", "orthonormal rotation") for entry in SPOILED),
        *((AHEAD, T, "BAD_EXTRINSICS", "orthonormal rotation") for T in (np.eye(3), 2 * np.eye(4))),
        (np.empty((0, 3), np.float32), None, "NO_DEPTH", "0 of 0 points"),
        (-AHEAD, None, "NO_DEPTH", "T_camera_points takes points to the optical frame"),
        # The turn to the optical frame is missing: the scanner's z axis, up, is taken for the camera's, forward.
        (transform(inverse(T_CAMERA_LIDAR), AHEAD), np.eye(4), "NO_DEPTH", "0 of 300 points"),
    ],
)
def test_scans_that_do_not_fit_are_refused(points, T_camera_points, code: str, expected: str) -> None:
    with pytest.raises(DataError, match=expected) as caught:
        frame_of(points, T_camera_points)
    assert caught.value.code == code


def test_corrected_points_replace_the_scan_and_have_no_times() -> None:
    pixels = grid(20)
    frame = frame_of(at_depth(pixels, 10.0), times_s=np.zeros(len(pixels)), stamp_ns=7)
    corrected = frame.with_points(at_depth(pixels, 11.0).astype(np.float32))
    np.testing.assert_allclose(corrected.points_at(pixels)[:, 2], 11.0, atol=1e-5)
    assert corrected.scan_with_times() is None
    assert corrected.stamp_ns == 7


def test_pixels_of_a_street_see_the_surface_that_the_camera_sees(view: tuple[Frame, NDArray[np.float32]]) -> None:
    frame, depth_m = view
    pixels = grid(4)
    points = frame.points_at(pixels)
    seen = has_point(points)
    assert seen.mean() > 0.75
    # A point within 5 px has one of the depths that the camera sees within 5 px, to a pixel's rounding.
    window = np.ones((11, 11), np.uint8)
    u, v = pixels[seen].astype(int).T
    nearest, farthest = cv2.erode(depth_m, window)[v, u], cv2.dilate(depth_m, window)[v, u]
    found_m = transform(T_CAMERA_LIDAR, points[seen])[:, 2]
    assert (found_m > nearest - 0.1).all()
    # Beams are 1.3 deg (7 px) apart: between two of them a car's edge may leave the wall behind it standing.
    assert np.mean(found_m > farthest + 0.1) < 0.025


def test_hidden_points_of_a_street_go_and_visible_ones_stay(view: tuple[Frame, NDArray[np.float32]]) -> None:
    frame, depth_m = view
    in_camera = transform(T_CAMERA_LIDAR, frame.points())
    pixels = CAMERA.project(in_camera)
    inside = np.flatnonzero(CAMERA.contains(pixels))
    u, v = np.rint(pixels[inside]).astype(int).T
    beyond_m = in_camera[inside, 2] - depth_m[v, u]
    kept = np.isin(inside, frame.geometry.visible()[0])  # type: ignore[union-attr]
    hidden, visible = beyond_m > 0.15 * depth_m[v, u] + 0.3, np.abs(beyond_m) < 0.1
    # Without the test all would be kept; what stays lies between the beams that met the nearer surface.
    assert kept[hidden].mean() < 0.6
    assert kept[visible].mean() > 0.985
