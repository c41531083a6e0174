# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures whose pixels can be foretold."""

import numpy as np
import pytest

from vigg_ros.pictures import BODY_AXES, MAX_MATCH_LINES, draw_aligned, draw_depth, draw_matches, draw_scan

BLACK = np.zeros((48, 64, 3), np.uint8)
GAP = 6


def lit(picture):
    """(H, W) where a black picture is not black."""
    return picture.max(axis=2) > 40


def test_a_match_is_a_line_from_its_pixel_on_the_left_to_its_pixel_on_the_right():
    picture = draw_matches(BLACK, BLACK, np.array([[10.0, 12.0]]), np.array([[40.0, 12.0]]))
    assert picture.shape == (48, 64 + GAP + 64, 3)
    panels = np.hstack((lit(picture)[:, :64], lit(picture)[:, -64:]))
    rows, columns = np.nonzero(panels)
    # A dot of two pixels around each end, and a line between them: x 10 to 64 + 40 without the gap.
    assert (rows.min(), rows.max()) == (10, 14)
    assert (columns.min(), columns.max()) == pytest.approx((8, 64 + 40 + 2), abs=1)
    assert lit(picture)[12, 20:60].all()


def test_matches_that_agree_are_coloured_and_the_others_grey():
    target, source = np.array([[5.0, 10.0], [5.0, 40.0]]), np.array([[55.0, 10.0], [55.0, 40.0]])
    picture = draw_matches(BLACK, BLACK, target, source, agrees=np.array([True, False])).astype(int)
    assert np.ptp(picture[10, 30]) > 80
    assert np.ptp(picture[40, 30]) == 0 < picture[40, 30, 0]


def test_one_direction_is_one_colour_and_the_opposite_another():
    target = np.array([[5.0, 10.0], [10.0, 20.0], [50.0, 40.0]])
    source = np.array([[35.0, 10.0], [40.0, 20.0], [20.0, 40.0]])
    picture = draw_matches(BLACK, BLACK, target, source)
    np.testing.assert_array_equal(picture[10, 60], picture[20, 60])
    assert np.abs(picture[10, 60].astype(int) - picture[40, 60]).max() > 80


def test_panels_of_a_width_move_the_pixels_with_them():
    pixel = np.array([[10.0, 12.0]])
    large = draw_matches(BLACK, BLACK, pixel, pixel, panel_width_px=256)
    assert large.shape == (192, 256 + GAP + 256, 3)
    # Pixel 10 reaches from 40 to 43 when it is four times as large: its centre is 41.5.
    rows, columns = np.nonzero(lit(large[:, :256]))
    assert rows.mean() == pytest.approx(4 * 12.5 - 0.5, abs=0.6)
    assert columns.min() == pytest.approx(4 * 10.5 - 0.5 - 2, abs=1)


def test_images_of_any_size_and_colour_stand_side_by_side_and_are_not_drawn_into():
    grey = np.full((30, 40), 128, np.uint8)
    grey.setflags(write=False)
    picture = draw_matches(grey, BLACK, np.array([[1.0, 2.0]]), np.array([[3.0, 4.0]]))
    assert picture.shape == (48, 40 + GAP + 64, 3)
    assert (grey == 128).all()


def test_of_many_matches_some_are_drawn_from_all_of_them():
    v = np.linspace(0, 47, 10 * MAX_MATCH_LINES)
    pixels = np.column_stack((np.full_like(v, 30.0), v))
    rows = np.flatnonzero(lit(draw_matches(BLACK, BLACK, pixels, pixels)).any(axis=1))
    assert (rows.min(), rows.max()) == (0, 47)


def test_depth_goes_from_red_to_blue_and_is_dark_where_there_is_none():
    depth_m = np.tile(np.linspace(1, 5, 200, dtype=np.float32), (60, 1))
    depth_m[:20] = 0
    picture = draw_depth(depth_m).astype(int)
    assert (picture[:20] == 40).all()
    near, far = picture[25, 3], picture[25, -10]
    assert near[2] > near[0]
    assert far[0] > far[2]
    nothing = draw_depth(np.zeros((48, 200), np.float32), panel_width_px=400)
    assert nothing.shape == (96, 400, 3)
    assert (nothing > 200).any(), "it says so"


def square(x, y, z):
    """A small patch of points around a place."""
    u, v = np.meshgrid(*[np.linspace(-0.02, 0.02, 9)] * 2)
    return np.column_stack((x + u.ravel(), y + v.ravel(), np.full(u.size, z) + u.ravel()))


def centres(picture, channel):
    """Of the ink without this colour, in the left and the right panel: (u, v), below the panels' titles."""
    width = (picture.shape[1] - GAP) // 2
    found = []
    for panel in (picture[:, :width], picture[:, -width:]):
        ink = panel[..., 2 - channel].astype(int) - panel[..., channel] > 60
        ink[:30] = ink[-30:] = False
        found.append(np.argwhere(ink).mean(axis=0)[::-1])
    return np.array(found)


def test_the_views_show_right_ahead_and_up():
    # Target (blue) at the middle of things, source (red) 1 m right, 0.5 m up (y down), 0.4 m further ahead.
    corners = np.vstack((square(-1, -1, 1), square(1, 1, 3)))
    target = np.vstack((corners, square(0, 0, 2)))
    red = centres(draw_aligned(target, square(1, -0.5, 2.4)), 0)
    blue = centres(draw_aligned(target, corners), 2)
    px_per_m = (red - blue)[0, 0]
    assert px_per_m > 50
    np.testing.assert_allclose((red - blue) / px_per_m, [(1, -0.4), (1, -0.5)], atol=0.05)


def test_a_body_frame_is_drawn_like_the_same_scene_in_an_optical_frame():
    optical = np.vstack((square(0, 0, 2), square(0.5, 0.2, 3)))
    x, y, z = optical.T
    body = np.column_stack((z, -x, -y))
    np.testing.assert_array_equal(
        draw_aligned(body, body + 0.01, axes=BODY_AXES), draw_aligned(optical, optical + (-0.01, -0.01, 0.01))
    )


def test_where_clouds_coincide_is_darker_than_either():
    points = np.vstack((square(0, 0, 2), square(1, 1, 3)))
    both = draw_aligned(points, points)[30:-30].astype(int)
    one = draw_aligned(points, np.empty((0, 3)))[30:-30].astype(int)
    assert both.sum(axis=2).min() < one.sum(axis=2).min() - 50


def test_the_bar_has_a_round_length():
    # Clouds 2 m apart in x; the bar is the widest dark run in the lowest rows of the left panel.
    points = np.vstack((square(-1, 0, 2), square(1, 0, 2.1)))
    picture = draw_aligned(points, np.empty((0, 3)), panel_width_px=480).astype(int)[:, :480]
    ink = picture[30:-30, :, 2] < 150
    columns = np.flatnonzero(ink.any(axis=0))
    px_per_m = (columns.max() - columns.min()) / 2.04
    bar_px = np.flatnonzero((np.ptp(picture[-13], axis=1) < 10) & (picture[-13, :, 0] < 100))
    length_m = (bar_px.max() - bar_px.min()) / px_per_m
    # 480 px show about 2.2 m; a quarter of that is 0.55 m, so that the bar is 0.5 m.
    assert length_m == pytest.approx(0.5, rel=0.02)


@pytest.mark.parametrize("counts", [(0, 0), (1, 0), (0, 3)])
def test_next_to_no_points_are_drawn_all_the_same(counts):
    target, source = (np.ones((count, 3)) for count in counts)
    assert draw_aligned(target, source, panel_width_px=100).shape == (75, 206, 3)


def test_points_of_a_scan_are_drawn_where_they_project_the_near_ones_on_top() -> None:
    pixels = np.array([[10.0, 20.0], [30.0, 20.0], [30.0, 20.0]])
    picture = draw_scan(BLACK, pixels, np.array([2.0, 50.0, 2.0]))
    assert picture.shape == BLACK.shape
    near, same_place = picture[20, 10].astype(int), picture[20, 30].astype(int)
    # Near is red (BGR), and covers the far point behind it.
    assert near[2] > near[0]
    np.testing.assert_array_equal(near, same_place)
    assert not picture[5, 50].any()
    assert draw_scan(BLACK, np.empty((0, 2)), np.empty(0)).any(), "it says that there is none"
