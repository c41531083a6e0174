# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rendered pairs are the same for the same seed, share what they say, and their truth is the truth."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from scipy.spatial import cKDTree

from vigg_ros.bench.rendered_pairs import (
    DISTURBANCES,
    HANDHELD_CAMERA,
    NEARLY_ALL,
    OVERLAPS,
    PLACES,
    SCENE_KINDS,
    kind_of,
    number_of,
    pair_numbers,
    rendered_pair,
    scene_of,
    swung,
)
from vigg_ros.bench.view_sampling import HandheldSampler
from vigg_ros.bench.worlds import render_depth
from vigg_ros.registration import ConfigError
from vigg_ros.registration.rigid import angle_rad, inverse, transform

SEED = 3
NUMBERS = (*range(6), *range(8, 16))
"""One of each kind."""


@pytest.fixture(scope="module")
def pairs():
    return {number: rendered_pair(number, SEED) for number in NUMBERS}


@pytest.fixture(scope="module")
def of_kind(pairs):
    return {pair.group: pair for pair in pairs.values()}


def things_seen_from(view):
    """T_camera_thing of all in the foreground of a view."""
    T_camera_world = inverse(np.reshape(view.T_world_body, (4, 4)))
    return [T_camera_world @ np.reshape(values, (4, 4)) for values in view.T_world_things]


def test_each_kind_comes_in_turn_with_overlaps_in_the_ranges_that_are_drawn_from(pairs):
    assert [pair.group for pair in pairs.values()] == list(SCENE_KINDS)
    assert [kind_of(number) for number in (6, 7, 16)] == ["room", "street", "room"]
    assert [sum(kind.share for kind in family.values()) for family in (PLACES, DISTURBANCES)] == [8, 8]
    for pair in pairs.values():
        low, high = SCENE_KINDS[pair.group].overlaps[0]
        assert low <= pair.overlap < high
    ranges = (*OVERLAPS, NEARLY_ALL)
    assert [one[0] for one in ranges[1:]] == [one[1] for one in ranges[:-1]]


def test_kinds_are_chosen_without_changing_their_pairs():
    assert list(islice(pair_numbers(["far depth", "street"]), 4)) == [1, 7, 8, 17]
    assert list(islice(pair_numbers(SCENE_KINDS), 40)) == list(range(40))
    for kinds in (["far depth", "kitchen"], []):
        with pytest.raises(ConfigError, match=r"expected some of: room, street, .*small motion"):
            pair_numbers(kinds)


@pytest.mark.parametrize("number", [0, 5, 8, 15, 16, 31, 32])
def test_a_view_names_its_pair(number):
    pair = rendered_pair(number, 7)
    assert number_of(pair.target.name, 7) == number_of(pair.source.name, 7) == number


def test_a_pair_is_the_same_whatever_was_drawn_before_and_its_frames_each_time(pairs):
    again = rendered_pair(2, SEED)
    assert (again.target, again.source, again.overlap) == (pairs[2].target, pairs[2].source, pairs[2].overlap)
    np.testing.assert_array_equal(again.T_target_source, pairs[2].T_target_source)
    assert rendered_pair(2, SEED + 1).source != again.source
    for number in (5, 13, 14):
        first, second = pairs[number].source.load(), pairs[number].source.load()
        np.testing.assert_array_equal(first.image, second.image)
        np.testing.assert_array_equal(first.points(), second.points())


@pytest.mark.parametrize("number", NUMBERS)
def test_under_the_truth_as_much_coincides_as_is_said(pairs, number):
    pair = pairs[number]
    target, source = pair.target.load().points(), pair.source.load().points()
    moved = transform(pair.T_target_source, source[::7])
    # A pixel at 4 m is 15 mm wide, a beam's spacing at 20 m half a metre; the noise of "noise" 4 cm at 3 m, that of
    # stereo 19 cm at 6 m.
    reach_m = {"street": 0.6, "far depth": 0.2}.get(pair.group, 0.08)
    distance, _ = cKDTree(target).query(moved, distance_upper_bound=reach_m)
    share = np.mean(np.isfinite(distance))
    # The share is a mean of both directions, one of which may differ from it, and of the scene without what hides up
    # to 40 % of it in each frame.
    assert share > (0.2 if SCENE_KINDS[pair.group].foreground else 0.4) * pair.overlap
    turned = pair.T_target_source.copy()
    turned[:3, 3] += (0.0, 0.0, 5.0)
    wrong, _ = cKDTree(target).query(transform(turned, source[::7]), distance_upper_bound=reach_m)
    assert np.mean(np.isfinite(wrong)) < share


def test_the_overlap_of_a_view_with_itself_is_nearly_whole():
    sampler = HandheldSampler(scene_of("room", 1))
    view = sampler.draw(np.random.default_rng(0))
    assert sampler.overlap(view, view) > 0.99


def hidden_share(view) -> float:
    """The share of a view where its foreground is nearer than the scene, which is measured to 2 cm at 3 m."""
    with_it, without = (depth_of(one) for one in (view, replace(view, T_world_things=())))
    return float(np.mean((with_it > 0) & ((without == 0) | (with_it < without - 0.05))))


def depth_of(view):
    """Measured depth (H, W)."""
    points = view.load().points()
    column, row = np.rint(HANDHELD_CAMERA.project(points.astype(np.float64))).astype(int).T
    depth_m = np.zeros((HANDHELD_CAMERA.height_px, HANDHELD_CAMERA.width_px))
    depth_m[row, column] = points[:, 2]
    return depth_m


@pytest.mark.parametrize(("kind", "shift_m"), [("own body", 0.0), ("moving board", 0.15)])
def test_a_board_goes_with_the_camera_and_shifts_as_said(of_kind, kind, shift_m):
    views = of_kind[kind].target, of_kind[kind].source
    (first,), (second,) = map(things_seen_from, views)
    np.testing.assert_allclose(first[:3, :3], second[:3, :3], atol=1e-12)
    assert np.linalg.norm(first[:3, 3] - second[:3, 3]) == pytest.approx(shift_m, abs=1e-12)
    # Placed with views of 64x48 px, whose pixels at its edges are 3 % of the view; edges measure nothing.
    low, high = SCENE_KINDS[kind].foreground.coverage
    assert all(low - 0.05 < hidden_share(view) < high + 0.03 for view in views)


def test_people_stand_somewhere_else_and_cover_a_part_of_the_view(of_kind):
    views = of_kind["people walking"].target, of_kind["people walking"].source
    feet = [np.array(view.T_world_things).reshape(-1, 4, 4)[:, :3, 3] for view in views]
    assert len(feet[0]) == len(feet[1]) in (2, 3)
    assert np.linalg.norm(feet[0] - feet[1], axis=1).min() > 0.3
    assert all(0.07 < hidden_share(view) < 0.33 for view in views)


def test_rows_of_a_swung_camera_are_exposed_one_after_the_other(of_kind):
    view = of_kind["rolling shutter"].target
    pose, scene = np.reshape(view.T_world_body, (4, 4)), scene_of("rolling shutter", view.scene_seed)
    shutter = swung(pose, 0.025, np.random.default_rng(1))
    assert 50 < np.degrees(np.linalg.norm(shutter.turn_rate_radps)) < 120
    rolled, still = render_depth(scene, HANDHELD_CAMERA, shutter), render_depth(scene, HANDHELD_CAMERA, pose)
    # Half a row from the middle the camera has turned by 0.006 deg, an eightieth of a pixel; at the ends by 0.6 deg
    # and more, three pixels.
    off = np.mean(np.abs(rolled - still) > 0.005 * still, axis=1)
    assert off[119:121].max() < 0.05
    assert min(off[:5].mean(), off[-5:].mean()) > 5 * off[119:121].max()


@pytest.mark.parametrize(
    ("kind", "shift_m", "turn_deg"), [("small motion", (0.01, 0.05), 3), ("close shelf", (0.03, 0.2), 15)]
)
def test_small_motions_are_small(kind, shift_m, turn_deg):
    for number in islice(pair_numbers([kind]), 3):
        T = rendered_pair(number, SEED).T_target_source
        assert shift_m[0] <= np.linalg.norm(T[:3, 3]) <= shift_m[1]
        assert np.degrees(angle_rad(T[:3, :3])) <= turn_deg + 1e-6


@pytest.mark.parametrize(("kind", "near_m", "far_m"), [("close shelf", 0.3, 1.1), ("far depth", 0.3, 10.0)])
def test_things_are_as_far_away_as_their_kind_says(of_kind, kind, near_m, far_m):
    depth_m = of_kind[kind].target.load().points()[:, 2]
    assert near_m < np.quantile(depth_m, 0.01)
    assert 0.7 * far_m < np.quantile(depth_m, 0.99) <= far_m
