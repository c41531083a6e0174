# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The list of checks: each objects beyond its limit and not at it, and everything that tells of refusals knows it."""

import dataclasses
import math

import pytest

from vigg_ros.acceptance import limits
from vigg_ros.acceptance.checks import (
    ANSWER_CHECKS,
    CHECKS,
    EXPLANATIONS,
    SEARCH_CHECKS,
    answer_margin,
    answer_objection,
    is_supported,
    search_objection,
)
from vigg_ros.registration import Config, Evidence, Reason
from vigg_ros.tracking.columns import COLUMNS

CONFIG = Config()
SOUND = Evidence(
    keypoints=500, visual_matches=100, geometric_matches=200, hypotheses=50, candidates=3, visual_inliers=60,
    geometric_inliers=80, visual_log10_nfa=-40.0, match_log10_p=-60.0, log10_nfa=-40.0,
    surface_pairs=4000, rmse_m=0.004, motion_sigma_m=0.002, motion_sigma_deg=0.1,
    overlap=0.7, consistency=0.95, conflict=0.01, lead_log10=30.0,
)  # fmt: skip
SETTABLE = [check for check in (*SEARCH_CHECKS, *ANSWER_CHECKS) if not math.isinf(check.limit(SOUND, CONFIG))]


def showing(check, value):
    """The sound evidence, but for what this check measures."""
    return dataclasses.replace(SOUND, **{check.measured: value})


def test_sound_evidence_meets_no_objection():
    assert search_objection(SOUND, CONFIG) is answer_objection(SOUND, CONFIG) is None
    assert is_supported(SOUND, CONFIG)
    assert 0 < answer_margin(SOUND, CONFIG) < 1


@pytest.mark.parametrize("check", SETTABLE, ids=lambda check: f"{check.reason.value} {check.measured}")
def test_a_check_objects_beyond_its_limit_and_not_at_it(check):
    limit = check.limit(SOUND, CONFIG)
    is_count = isinstance(check.measure(SOUND), int)
    step = 1 if is_count else max(abs(limit), 1.0) * 1e-6
    inside, beyond = (limit, limit - step) if check.bound == "at least" else (limit, limit + step)
    if check.bound == "below":
        inside, beyond = limit - step, limit
    assert check.passes(showing(check, inside), CONFIG)
    objection = check.objection(showing(check, beyond), CONFIG)
    assert objection[0] is check.reason
    assert "{" not in objection[1]
    assert check.margin(showing(check, beyond), CONFIG) == 0
    assert is_count or check.passes(showing(check, math.nan), CONFIG) == check.nan_passes


def test_an_unknown_figure_is_an_objection_unless_the_check_says_otherwise():
    unknown = {check.measured for check in ANSWER_CHECKS if check.nan_passes}
    assert unknown == {"photometric_correlation", "repeated_shift_m"}
    broken = dataclasses.replace(SOUND, motion_sigma_m=math.nan)
    assert answer_objection(broken, CONFIG) == (Reason.NOT_FINITE, "the fit is not finite")


def test_without_verification_only_the_basic_checks_are_asked():
    config = CONFIG.replace({"acceptance.enabled": False})
    poor = dataclasses.replace(SOUND, overlap=0.0, consistency=0.0, visual_inliers=0, geometric_inliers=0)
    assert answer_objection(poor, config) is None
    assert answer_objection(dataclasses.replace(poor, motion_sigma_deg=6.0), config) is not None


def test_every_reason_is_given_by_a_check_or_by_the_clock_and_is_explained():
    assert {check.reason for check in CHECKS} | {Reason.TIMEOUT} == set(Reason) == set(EXPLANATIONS)
    for explanation in EXPLANATIONS.values():
        assert explanation.meaning.endswith((".", "?"))
        assert explanation.remedy
        assert not explanation.remedy.endswith(".")


def test_every_figure_that_a_check_measures_is_in_the_table():
    names = {column.name for column in COLUMNS}
    assert {field.name for field in dataclasses.fields(Evidence)} <= names
    assert {check.measured for check in ANSWER_CHECKS} <= names


def test_where_a_limit_is_set_exists():
    options = {name for name, _, _ in CONFIG.options()}
    constants = {name for name, value in vars(limits).items() if isinstance(value, limits.Limit)}
    named = {name for check in CHECKS for name in check.limit_text.split(", ")} - {"by definition"}
    assert named <= options | constants
