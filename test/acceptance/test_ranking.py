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
    competition,
    has_decisive_winner,
    is_decisive,
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


def candidate(x=0.0, *, overlap=0.6, in_front=0.02, hidden=0.05, visual=60, geometric=80):
    """A sound answer, but for what is said."""
    return Candidate(
        motion((0, 0, 0), (x, 0, 0)),
        Agreement(overlap, in_front, hidden),
        mask(visual, VISUAL),
        mask(geometric, GEOMETRIC),
    )


def fit(of, *, deviation_m=0.002, deviation_deg=0.1, pairs=4000):
    deviations = np.array((deviation_m,) * 3 + (np.deg2rad(deviation_deg),) * 3)
    return Fit(of.T_target_source, np.diag(deviations**2), 0.01, pairs)


def verdict(monkeypatch, *fits, config=CONFIG, alike=0.7, repeated=None, seen=None):
    """What ``judge`` says when the frames agree under each motion as the candidate says."""
    by_motion = {one.T_target_source.tobytes(): one for one, _ in fits} | (seen or {})
    monkeypatch.setattr(ranking, "photometric_correlation", lambda pair, T: alike)
    monkeypatch.setattr(ranking, "repeated_motion", lambda pair, T: repeated)
    monkeypatch.setattr(ranking, "assess", lambda pair, T: by_motion[T.tobytes()])
    points, rows = np.zeros((VISUAL, 3)), np.arange(VISUAL)
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
    assert (evidence.overlap, evidence.rmse_m, evidence.runner_up) == (0.6, 0.01, 0)
    assert evidence.consistency == pytest.approx(0.6 / 0.67)
    assert evidence.conflict == pytest.approx(0.02 / 0.62)


OBJECTIONS: dict[str, tuple[dict[str, float], dict[str, float], Reason]] = {
    "a position free": ({}, {"deviation_m": 0.101}, Reason.DEGENERATE),
    "an angle free": ({}, {"deviation_deg": 5.1}, Reason.DEGENERATE),
    "a direction without end": ({}, {"deviation_m": np.inf}, Reason.DEGENERATE),
    "few matches": ({"visual": 3, "geometric": 4}, {}, Reason.TOO_FEW_INLIERS),
    "few matches for so much surface": ({"visual": 0, "geometric": 8}, {}, Reason.TOO_FEW_INLIERS),
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
    assert is_supported(poor_one.described_by(Evidence()), CONFIG) == (reason is Reason.DEGENERATE or "pairs" in fitted)


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
    seen = {shifted.T_target_source.tobytes(): shifted}
    found = verdict(monkeypatch, (here, fit(here)), repeated=shifted.T_target_source, seen=seen)
    assert isinstance(found, Registration) == answered
    if isinstance(found, Rejection):
        assert found.reason is Reason.AMBIGUOUS
        assert "repeats: a motion that differs by 0.5 m" in found.message


@pytest.mark.hostile("Scene: repeated texture and repeated structure: reject rather than choose wrongly")
def test_two_answers_that_explain_as_much_are_ambiguous(monkeypatch):
    """A step of 0 and one of 1.2 m, both with most of the surface and half of the matches."""
    here, there = candidate(0.0, visual=50), candidate(1.2, visual=45)
    found = verdict(monkeypatch, (here, fit(here)), (there, fit(there)))
    assert found.reason is Reason.AMBIGUOUS
    assert found.evidence.runner_up >= 1
    # The same answer twice is no competitor of itself, and neither is one with a fraction of the matches.
    for other in (candidate(0.05, visual=45), candidate(1.2, visual=10, geometric=20)):
        assert isinstance(verdict(monkeypatch, (here, fit(here)), (other, fit(other))), Registration)


def test_competition_is_the_lesser_of_surface_and_matches():
    best = candidate(0.0)
    # Balance 0.53 against 0.265: half, of which 0.75 are asked for. Matches 140 against 126: 0.9 of 0.6.
    half = candidate(1.0, overlap=0.335, visual=46)
    assert competition(half, best, CONFIG) == pytest.approx(0.5 / 0.75)
    few = candidate(1.0, visual=2, geometric=40)
    assert competition(few, best, CONFIG) == pytest.approx(0.3 / 0.6)
    assert competition(candidate(1.0, overlap=0.05), best, CONFIG) == 0, "a negative balance is no support"
    assert competition(candidate(0.29), best, CONFIG) == 0, "three thresholds apart is the same answer"


def test_the_best_is_followed_by_its_competitors():
    best = candidate(0.0, overlap=0.7)
    competitors = [candidate(float(x), overlap=0.6 - 0.01 * x) for x in range(1, MAX_COMPETITORS + 2)]
    lesser, twin = candidate(9.0, overlap=0.2), candidate(0.1, overlap=0.65)
    found = best_and_competitors([lesser, *reversed(competitors), twin, best], CONFIG)
    assert found[0] is best
    assert [one.T_target_source[0, 3] for one in found[1:]] == [1, 2, 3][:MAX_COMPETITORS]


def hypotheses(*scores):
    """Steps of 0, 1, 2, ... m with these scores."""
    return Hypotheses(np.array([motion((0, 0, 0), (x, 0, 0)) for x in range(len(scores))]), np.array(scores))


@pytest.mark.parametrize(
    ("agreeing", "of", "scores", "clear"),
    [
        (60, 100, (5.0,), True),
        (60, 100, (5.0, 2.9), True),
        (60, 100, (5.0, 3.0), False),  # a competitor
        (19, 100, (5.0,), False),  # too few
        (20, 100, (5.0,), True),
        (22, 150, (5.0,), False),  # of too many
        (23, 150, (5.0,), True),
        (0, 0, (), False),
    ],
)
def test_only_clear_visual_evidence_spares_the_geometric_search(agreeing, of, scores, clear):
    source, rows = np.zeros((of, 3)), np.arange(of)
    target = np.where(mask(agreeing, of)[:, None], 0.05, 5.0) * np.ones((of, 3))
    visual = Matches(target, source, np.ones(of), rows, rows, np.zeros(of))
    if scores:
        assert is_decisive(agreeing, of) == (clear or len(scores) > 1)
    few = hypotheses(*scores) if scores else Hypotheses(np.empty((0, 4, 4)), np.empty(0))
    assert has_decisive_winner(few, visual, CONFIG) == clear
