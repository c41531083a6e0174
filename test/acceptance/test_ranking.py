# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The verdict on evidence made by hand: each objection has its own reason, and all of them are asked for."""

from types import SimpleNamespace

import numpy as np
import pytest

from vigg_ros.acceptance import ranking
from vigg_ros.acceptance.agreement import Agreement, Candidate, Pair
from vigg_ros.acceptance.checks import is_supported
from vigg_ros.acceptance.ranking import (
    MAX_COMPETITORS,
    best_and_competitors,
    by_significance,
    has_decisive_winner,
    judge,
)
from vigg_ros.registration import Config, Evidence, Reason, Registration, Rejection
from vigg_ros.registration.cliques import Hypotheses
from vigg_ros.registration.matches import Matches, no_matches
from vigg_ros.registration.refinement import Fit
from vigg_ros_testing.registration_samples import motion

CONFIG = Config()
VISUAL, GEOMETRIC = 100, 200
"""Matches of the made-up pair."""


def mask(count, of):
    return np.arange(of) < count


def candidate(x=0.0, *, overlap=0.6, in_front=0.02, hidden=0.05, visual=60, geometric=80, first=0, cells=30):
    """A sound answer, but for what is said; half a decade speaks for it with each match, after the first six.

    The visual matches that agree begin with this one.
    """
    return Candidate(
        motion((0, 0, 0), (x, 0, 0)),
        Agreement(overlap, in_front, hidden),
        np.roll(mask(visual, VISUAL), first),
        mask(geometric, GEOMETRIC),
        seen_cells=cells * np.array((overlap, in_front, hidden)),
        visual_tail=-0.5 * max(visual - 6, 0),
        geometric_tail=-0.5 * max(geometric - 6, 0),
        visual_log10_nfa=5 - 0.5 * visual,
    )


def fit(of, *, deviation_m=0.002, deviation_deg=0.1, pairs=4000):
    deviations = np.array((deviation_m,) * 3 + (np.deg2rad(deviation_deg),) * 3)
    return Fit(of.T_target_source, np.diag(deviations**2), 0.01, pairs)


def verdict(monkeypatch, *fits, config=CONFIG, alike=0.7, repeated=None, slid=None, unlike=0.1):
    """What ``judge`` says when the frames agree under each motion as the candidate says."""
    slid = slid or [candidate(3.0, overlap=0.2, hidden=0.6, visual=0, geometric=0)]
    by_motion = {one.T_target_source.tobytes(): one for one in (*(one for one, _ in fits), *slid)}
    monkeypatch.setattr(ranking, "aliases", lambda pair, T: [one.T_target_source for one in slid])
    monkeypatch.setattr(ranking, "polish", lambda pair, motions: [fit(by_motion[T.tobytes()]) for T in motions])
    preferred = fits[0][0].T_target_source
    monkeypatch.setattr(
        ranking, "photometric_correlation", lambda pair, T: alike if (preferred == T).all() else alike - unlike
    )
    monkeypatch.setattr(ranking, "seen_cells", lambda pair, T: by_motion[T.tobytes()].seen_cells)
    monkeypatch.setattr(ranking, "repeated_motion", lambda pair, T: repeated)
    monkeypatch.setattr(ranking, "assess", lambda pair, T: by_motion[T.tobytes()])
    points, rows = np.random.default_rng(0).uniform(-2, 2, (VISUAL, 3)), np.arange(VISUAL)
    visual = Matches(points, points, np.ones(VISUAL), rows, 1000 + rows, np.zeros(VISUAL))
    target, source = (SimpleNamespace(keypoints=SimpleNamespace(pixels=pixels(v))) for v in (0, 1))
    pair = Pair(target, source, visual, no_matches(), config)
    return judge(pair, [f for _, f in fits], Evidence(keypoints=7))


def pixels(v):
    """Row k of the target's keypoints, and row 1000 + k of the source's, at (k, v)."""
    return np.array([(k % 1000, v) for k in range(2000)], np.float32)


def test_a_sound_answer_is_given_with_its_evidence(monkeypatch):
    sound = candidate(0.1)
    found = verdict(monkeypatch, (sound, fit(sound)))
    np.testing.assert_array_equal(found.T_target_source, sound.T_target_source)
    assert found.covariance[0, 0] == pytest.approx(0.002**2)
    assert found.visual_inliers_px.tolist() == [[k, 0, k, 1] for k in range(60)]
    evidence = found.evidence
    assert (evidence.keypoints, evidence.visual_inliers, evidence.geometric_inliers) == (7, 60, 80)
    assert (evidence.overlap, evidence.rmse_m, evidence.lead_log10) == (0.6, 0.01, np.inf)
    assert evidence.consistency == pytest.approx(0.6 / 0.67)
    assert evidence.conflict == pytest.approx(0.02 / 0.62)


OBJECTIONS: dict[str, tuple[dict[str, float], dict[str, float], Reason]] = {
    "a position free": ({}, {"deviation_m": 0.101}, Reason.DEGENERATE),
    "an angle free": ({}, {"deviation_deg": 5.1}, Reason.DEGENERATE),
    "a direction without end": ({}, {"deviation_m": np.inf}, Reason.DEGENERATE),
    "few matches": ({"visual": 3, "geometric": 4}, {}, Reason.TOO_FEW_INLIERS),
    "few matches and little surface": ({"visual": 0, "geometric": 13, "cells": 2}, {}, Reason.TOO_FEW_INLIERS),
    "few pairs of surface": ({}, {"pairs": 99}, Reason.LOW_OVERLAP),
    "little overlap": ({"overlap": 0.09, "in_front": 0.0, "hidden": 0.0}, {}, Reason.LOW_OVERLAP),
    "much hidden": ({"hidden": 0.45}, {}, Reason.CONFLICT),
    "seen through": ({"in_front": 0.16, "hidden": 0.0}, {}, Reason.CONFLICT),
}


@pytest.mark.parametrize(("shown", "fitted", "reason"), OBJECTIONS.values(), ids=OBJECTIONS)
def test_each_objection_has_its_reason(shown, fitted, reason, monkeypatch):
    poor_one = candidate(**shown)
    found = verdict(monkeypatch, (poor_one, fit(poor_one, **fitted)))
    assert isinstance(found, Rejection), found
    assert found.reason is reason
    assert "expected" in found.message or "agree" in found.message
    assert found.evidence.keypoints == 7
    is_surface_sound = reason in (Reason.DEGENERATE, Reason.TOO_FEW_INLIERS) or "pairs" in fitted
    assert is_supported(poor_one.described_by(Evidence()), CONFIG) == is_surface_sound


@pytest.mark.parametrize(("alike", "answered"), [(0.31, True), (0.29, False), (-0.5, False), (np.nan, True)])
def test_shapes_that_agree_are_not_believed_against_the_images(alike, answered, monkeypatch):
    """Few visual matches agree; where many do, the images have spoken."""
    shaped, seen = candidate(visual=5), candidate(visual=60)
    found = verdict(monkeypatch, (shaped, fit(shaped)), alike=alike)
    assert isinstance(found, Registration) == answered
    assert found.evidence.photometric_correlation == pytest.approx(alike, nan_ok=True)
    if isinstance(found, Rejection):
        assert found.reason is Reason.CONFLICT
        assert "correlation" in found.message
    clear = verdict(monkeypatch, (seen, fit(seen)), alike=alike)
    assert isinstance(clear, Registration)
    assert np.isnan(clear.evidence.photometric_correlation)


def test_what_is_not_finite_is_no_answer(monkeypatch):
    broken = candidate(np.nan)
    found = verdict(monkeypatch, (broken, fit(broken)))
    assert found.reason is Reason.NOT_FINITE


def test_the_best_supported_fit_is_the_answer(monkeypatch):
    """Support is what coincides less what contradicts, and a quarter of the share of visual matches."""
    poor, good = candidate(0.0, overlap=0.4), candidate(0.05, overlap=0.6)
    assert good.support == pytest.approx(0.6 - 0.02 - 0.05 + 0.25 * 0.6)
    for fits in (((poor, fit(poor)), (good, fit(good))), ((good, fit(good)), (poor, fit(poor)))):
        found = verdict(monkeypatch, *fits)
        np.testing.assert_array_equal(found.T_target_source, good.T_target_source)


@pytest.mark.hostile("Scene: repeated texture and repeated structure: reject rather than choose wrongly")
@pytest.mark.parametrize(
    ("shown", "answered"), [({}, False), ({"hidden": 0.45}, True), ({"in_front": 0.2, "hidden": 0.0}, True)]
)
def test_a_repeated_motion_competes_unless_the_surfaces_know_better(shown, answered, monkeypatch):
    here, shifted = candidate(0.0), candidate(0.5, **shown)
    found = verdict(monkeypatch, (here, fit(here)), repeated=shifted.T_target_source, slid=(shifted,))
    assert isinstance(found, Registration) == answered
    if isinstance(found, Rejection):
        assert found.reason is Reason.AMBIGUOUS
        assert "repeats: a motion that differs by 0.5 m" in found.message


@pytest.mark.hostile("Scene: repeated texture and repeated structure: reject rather than choose wrongly")
def test_two_motions_that_matches_of_their_own_show_are_ambiguous(monkeypatch):
    """A step of 0 and one of 1.2 m, each with most of the surface, and 50 visual matches of which some are shared."""
    here = candidate(0.0, visual=50)
    for first, answered in ((50, False), (2, True)):
        there = candidate(1.2, visual=50, first=first, overlap=0.55)
        found = verdict(monkeypatch, (here, fit(here)), (there, fit(there)))
        assert isinstance(found, Registration) == answered, first
        assert answered or found.reason is Reason.AMBIGUOUS
    # The same answer twice is no competitor of itself, nor is one that the surfaces contradict.
    for other in (candidate(0.05, first=50, visual=50), candidate(1.2, first=50, visual=50, hidden=0.5)):
        assert isinstance(verdict(monkeypatch, (here, fit(here)), (other, fit(other))), Registration)


@pytest.mark.hostile("Scene: repeated texture and repeated structure: reject rather than choose wrongly")
@pytest.mark.parametrize(("geometric", "answered"), [(76, False), (70, True)])
def test_an_answer_by_shapes_must_win_against_its_aliases(geometric, answered, monkeypatch):
    """Each geometric match is half a decade; three are asked for. The alias has the same surfaces."""
    here, slid = candidate(0.0, visual=4), candidate(0.5, visual=4, geometric=geometric)
    elsewhere = [candidate(x, overlap=0.1, hidden=0.7, visual=0, geometric=0) for x in (2.0, 3.0, 4.0, 5.0)]
    found = verdict(monkeypatch, (here, fit(here)), slid=(slid, *elsewhere))
    assert isinstance(found, Registration) == answered
    assert found.evidence.lead_log10 == pytest.approx(0.5 * (80 - geometric))
    assert answered or found.reason is Reason.AMBIGUOUS


@pytest.mark.hostile("Scene: repeated texture and repeated structure: reject rather than choose wrongly")
@pytest.mark.parametrize(("unlike", "answered"), [(0.1, True), (-0.1, False), (0.0, False)])
def test_of_two_fits_of_the_shapes_the_images_must_prefer_the_answer(unlike, answered, monkeypatch):
    """Where shapes repeat, the matches choose one of the copies together; they do not tell which."""
    here, slid = candidate(0.0, visual=4), candidate(1.2, visual=4, geometric=30)
    elsewhere = [candidate(x, overlap=0.1, hidden=0.7, visual=0, geometric=0) for x in (2.0, 3.0, 4.0, 5.0)]
    found = verdict(monkeypatch, (here, fit(here)), slid=(slid, *elsewhere), unlike=unlike)
    assert isinstance(found, Registration) == answered
    assert answered or found.reason is Reason.AMBIGUOUS


def test_surfaces_that_coincide_wherever_they_are_slid_say_nothing(monkeypatch):
    """Along a corridor, whose matches alone are too few."""
    here = candidate(0.0, visual=3, geometric=14, in_front=0.0, hidden=0.0)
    for shown, answered in (({"overlap": 0.6, "in_front": 0.0, "hidden": 0.0}, False), ({"overlap": 0.1}, True)):
        slid = candidate(2.0, visual=0, geometric=0, **({"hidden": 0.6} | shown))
        found = verdict(monkeypatch, (here, fit(here)), slid=(slid,))
        assert isinstance(found, Registration) == answered, found


def test_the_best_is_followed_by_its_competitors():
    best = candidate(0.0, overlap=0.7)
    competitors = [candidate(float(x), overlap=0.6 - 0.01 * x) for x in range(1, MAX_COMPETITORS + 2)]
    contradicted, twin = candidate(9.0, hidden=0.5), candidate(0.1, overlap=0.65)
    unmatched = candidate(8.0, overlap=0.9, visual=0, geometric=3)
    found = best_and_competitors([unmatched, contradicted, *reversed(competitors), twin, best], CONFIG)
    assert found[0] is best
    assert [one.T_target_source[0, 3] for one in found[1:]] == [1, 2, 3][:MAX_COMPETITORS]


def steps(count):
    """Hypotheses of steps of 0, 1, 2, ... m."""
    return Hypotheses(np.array([motion((0, 0, 0), (x, 0, 0)) for x in range(count)]), np.ones(count))


def spread(rng, count, agreeing):
    """Matches all over a room, of which ``agreeing[x]`` agree with a step of x metres, and the others with none."""
    source, rows = rng.uniform(-3, 3, (count, 3)), np.arange(count)
    target, done = rng.uniform(-3, 3, (count, 3)), 0
    for x, share in enumerate(agreeing):
        target[done : done + share] = source[done : done + share] + (x, 0, 0)
        done += share
    return Matches(target, source, np.ones(count), rows, rows, np.zeros(count))


@pytest.mark.parametrize(
    ("agreeing", "of", "clear"),
    [
        ((60,), 100, True),
        ((60, 4), 100, True),
        ((60, 25), 100, False),  # another motion is there as well
        ((5,), 100, False),  # as chance lets expect of so many tries
        ((35,), 150, True),
        ((25,), 150, False),  # beyond chance, and imprecise
        ((), 100, False),
    ],
)
def test_only_clear_visual_evidence_spares_the_geometric_search(agreeing, of, clear):
    visual = spread(np.random.default_rng(0), of, agreeing)
    pair = Pair(None, None, visual, no_matches(), CONFIG)
    assert has_decisive_winner(pair, steps(len(agreeing))) == clear


def test_the_best_by_either_kind_of_matches_come_first():
    """5 of 200 visual matches that agree drown in the sum among 20 or more of 200 geometric ones."""
    rng = np.random.default_rng(1)
    visual, geometric = spread(rng, 200, (0, 0, 0, 5)), spread(rng, 200, (40, 30, 20))
    hypotheses = Hypotheses(steps(4).T_target_source[::-1].copy(), np.ones(4))
    pair = Pair(None, None, visual, geometric, CONFIG)
    ranked = by_significance(pair, hypotheses)
    assert ranked.T_target_source[:, 0, 3].tolist() == [0, 3, 1, 2]
    assert len(by_significance(pair, Hypotheses(np.empty((0, 4, 4)), np.empty(0)))) == 0
