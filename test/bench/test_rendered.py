# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rendered pairs are the same for the same seed, share what they say, and their truth is the truth."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from vigg_ros.bench.rendered_pairs import OVERLAPS, SCENE_KINDS, rendered_pair, scene_of
from vigg_ros.bench.view_sampling import HandheldSampler
from vigg_ros.registration.rigid import transform

SEED = 3


@pytest.fixture(scope="module")
def pairs():
    """One of each kind."""
    return [rendered_pair(number, SEED) for number in range(6)]


def test_each_kind_comes_in_turn_with_overlaps_in_the_ranges_that_are_drawn_from(pairs):
    assert [pair.group for pair in pairs] == list(SCENE_KINDS)
    assert sum(kind.share for kind in SCENE_KINDS.values()) == 8
    assert all(OVERLAPS[0][0] <= pair.overlap < OVERLAPS[0][1] for pair in pairs)
    assert [OVERLAPS[i][0] for i in (1, 2)] == [OVERLAPS[i][1] for i in (0, 1)]


def test_a_pair_is_the_same_whatever_was_drawn_before_and_its_frames_each_time(pairs):
    again = rendered_pair(2, SEED)
    assert (again.target, again.source, again.overlap) == (pairs[2].target, pairs[2].source, pairs[2].overlap)
    np.testing.assert_array_equal(again.T_target_source, pairs[2].T_target_source)
    assert rendered_pair(2, SEED + 1).source != again.source
    first, second = pairs[5].source.load(), pairs[5].source.load()
    np.testing.assert_array_equal(first.image, second.image)
    np.testing.assert_array_equal(first.points(), second.points())


@pytest.mark.parametrize("number", range(6))
def test_under_the_truth_as_much_coincides_as_is_said(pairs, number):
    pair = pairs[number]
    target, source = pair.target.load().points(), pair.source.load().points()
    moved = transform(pair.T_target_source, source[::7])
    # A pixel at 4 m is 15 mm wide, a beam's spacing at 20 m half a metre; the noise of "noise" 4 cm at 3 m.
    reach_m = 0.6 if pair.group == "street" else 0.08
    distance, _ = cKDTree(target).query(moved, distance_upper_bound=reach_m)
    share = np.mean(np.isfinite(distance))
    # The share is a mean of both directions; one of them may differ from it.
    assert share > 0.4 * pair.overlap
    turned = pair.T_target_source.copy()
    turned[:3, 3] += (0.0, 0.0, 5.0)
    wrong, _ = cKDTree(target).query(transform(turned, source[::7]), distance_upper_bound=reach_m)
    assert np.mean(np.isfinite(wrong)) < share


def test_the_overlap_of_a_view_with_itself_is_nearly_whole():
    sampler = HandheldSampler(scene_of("room", 1))
    view = sampler.draw(np.random.default_rng(0))
    assert sampler.overlap(view, view) > 0.99
