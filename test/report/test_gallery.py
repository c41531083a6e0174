# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which frames the gallery keeps, and that it keeps no more."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vigg_ros.acceptance.checks import answer_margin
from vigg_ros.pictures import beside, draw_depth
from vigg_ros.registration import Config, Reason
from vigg_ros.report.gallery import LOST_MARGIN, Gallery
from vigg_ros.tracking.frame_result import State
from vigg_ros_testing.report_samples import compared, lost, started, tracked

COMPARED = compared()


def offered(*results, limit=6):
    gallery = Gallery(Config(), limit)
    for result in results:
        gallery.offer(replace(result, compared=COMPARED))
    return gallery


def shown(gallery):
    return [frame.index for frame in gallery.pictured]


def test_a_frame_that_starts_a_session_is_not_shown():
    assert shown(offered(started(), tracked(1), started(2), lost(3))) == [1, 3]
    assert shown(offered()) == []


def test_lost_frames_come_before_answered_ones():
    results = [tracked(i, overlap=0.11) for i in range(40)]
    for i in (3, 13, 33):
        results[i] = lost(i)
    assert shown(offered(*results, limit=3)) == [3, 13, 33]


def test_of_frames_lost_in_a_row_the_first_is_shown():
    results = [tracked(i) for i in range(64)]
    results[17:30] = [lost(i) for i in range(17, 30)]
    assert 17 in shown(offered(*results, limit=4))


def test_the_least_margin_is_shown_first():
    results = [tracked(i, overlap=0.9 - 0.01 * ((i * 7) % 50)) for i in range(8)]
    # Overlaps 0.90 0.83 0.76 ... 0.55 0.48 (i = 6) and 0.41 (i = 7).
    assert shown(offered(*results, limit=2)) == [6, 7]


def test_neighbours_give_way_to_frames_elsewhere():
    results = [tracked(i, overlap=0.3 if 100 <= i < 140 else 0.8 - 1e-4 * i) for i in range(400)]
    indices = shown(offered(*results, limit=4))
    assert 100 in indices
    assert np.diff(indices).min() >= 20


@given(st.integers(1, 8), st.lists(st.sampled_from([*Reason, None]), max_size=150))
def test_at_most_the_limit_in_order_of_time_and_no_lost_frame_less_than_possible(limit, reasons):
    results = [tracked(i) if reason is None else lost(i, reason) for i, reason in enumerate(reasons)]
    pictured = offered(*results, limit=limit).pictured
    indices = [frame.index for frame in pictured]
    assert indices == sorted(set(indices))
    assert len(pictured) <= limit
    kinds = {reason for reason in reasons if reason is not None}
    assert len({frame.reason for frame in pictured} - {None}) == min(limit, len(kinds))
    if reasons:
        assert pictured


def test_memory_holds_a_few_frames_however_long_the_replay():
    gallery = Gallery(Config(), limit=3)
    alive = []
    for i in range(300):
        seen = compared(i)
        alive.append(weakref.ref(seen.frame.image))
        gallery.offer(lost(i, list(Reason)[i % 9], compared=seen))
    del seen
    gc.collect()
    # Twice the limit, or one for each of nine reasons and one that was answered.
    assert sum(image() is not None for image in alive) <= 10
    assert len(gallery.pictured) == 3


@pytest.mark.parametrize(
    ("evidence", "margin"),
    [
        # Presets: overlap over 0.1, consistency over 0.6, NFA 1e-5; the limits of the others in acceptance/limits.py.
        ({"overlap": 0.55}, 0.5),
        ({"consistency": 0.7}, 0.25),
        ({"log10_nfa": -10.0}, 0.5),
        ({"match_log10_p": -2.5}, 0.2),  # of -2
        ({"lead_log10": 10.0}, 0.5),
        ({"conflict": 0.15}, 0.25),  # of 0.2
        ({"photometric_correlation": 0.44}, 0.2),  # from 0.3 to 1
        ({"photometric_correlation": np.nan, "overlap": 0.55}, 0.5),
        ({"surface_pairs": 125}, 0.2),  # 100 are asked for
        ({"motion_sigma_m": 0.09}, 0.1),  # of 0.1
        ({"overlap": 0.1}, 0.0),
        ({"overlap": 0.0, "consistency": 0.0, "log10_nfa": 2.0, "lead_log10": 0.0}, 0.0),
    ],
)
def test_the_margin_is_that_of_the_weakest_evidence(evidence, margin):
    found = answer_margin(tracked(0, **evidence).evidence, Config())
    assert found == pytest.approx(margin, abs=1e-9)
    (frame,) = offered(tracked(0, **evidence)).pictured
    assert frame.margin == found


def test_an_answer_shows_its_matches_in_colour_and_both_surfaces():
    (frame,) = offered(tracked(1, state=State.RELOCALISED)).pictured
    picture = frame.draw_matches(Config(), panel_width_px=256)
    assert picture.shape[0] == 192  # of 96 rows of 128 columns
    (other,) = offered(lost(1)).pictured
    changed = np.any(picture != other.draw_matches(Config(), panel_width_px=256), axis=2)
    # The same matches: twelve that agree are drawn otherwise, and most of the picture is as before.
    assert 0.001 < changed.mean() < 0.3
    assert frame.draw_shapes() is not None


def test_a_lost_frame_shows_both_depth_images():
    (frame,) = offered(lost(1)).pictured
    assert frame.margin == LOST_MARGIN < 0
    depth = draw_depth(frame.compared.frame.geometry.depth_m, panel_width_px=100)
    np.testing.assert_array_equal(frame.draw_shapes(panel_width_px=100), beside(depth, depth))


def test_a_frame_lost_before_there_was_a_keyframe_is_shown_alone():
    gallery = Gallery(Config())
    gallery.offer(lost(0, Reason.NO_DEPTH, keyframe_id=None, compared=compared(with_keyframe=False)))
    (frame,) = gallery.pictured
    assert frame.compared.keyframe is None
    assert frame.draw_shapes() is None
    assert frame.draw_matches(Config()).ndim == 3
