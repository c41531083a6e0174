# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Figures of results made by hand, worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vigg_ros.bench.curves import cumulative, draw_curves
from vigg_ros.bench.pair_results import INDOOR_LIMITS
from vigg_ros.bench.pair_summary import figure, reasons, summarise, summarise_all
from vigg_ros_testing.pair_samples import result


def test_the_figures_of_five_pairs():
    # Two right, one far off, two without an answer.
    rows = [result(1.0, 0.04), result(4.0, 0.08), result(90.0, 2.0), result(), result(reason="LOW_OVERLAP")]
    summary = summarise(rows, INDOOR_LIMITS)
    # Of 1, 4, 90, inf, inf the middle is 90.
    assert (summary.rotation_deg, summary.translation_m) == (90.0, 2.0)
    assert (summary.pairs, summary.recall, summary.answered, summary.wrong) == (5, 40.0, 60.0, 1)
    assert summary.accuracy_deg == (20.0, 40.0, 40.0)
    assert summary.accuracy_m == (20.0, 40.0, 40.0)
    assert reasons(rows) == {"m": {"LOST": 1, "LOW_OVERLAP": 1}}


@pytest.mark.parametrize("answered", [0, 1, 2])
def test_a_median_among_failures_is_no_number(answered):
    summary = summarise([result(1.0, 0.1)] * answered + [result()] * (4 - answered), INDOOR_LIMITS)
    assert summary.rotation_deg == math.inf
    assert summary.cells()["RE deg"] == summary.cells()["TE cm"] == "-"
    assert summary.as_dict()["rotation_deg"] is None


def test_times_are_those_of_pairs_that_were_measured():
    rows = [result(1, 0.1, timings_ms={"a": 10.0, "b": 1.0}), result(timings_ms={}), result(timings_ms={"a": 30.0})]
    summary = summarise(rows, INDOOR_LIMITS)
    # Totals 11 and 30: median 20.5, p95 11 + 0.95 * 19. Stage b: 1 and 0.
    assert summary.ms == pytest.approx(20.5)
    assert summary.ms_p95 == pytest.approx(29.05)
    assert summary.stages_ms == {"a": 20.0, "b": 0.5}
    assert math.isnan(summarise([result(timings_ms={})], INDOOR_LIMITS).ms)


def test_groups_come_first_and_methods_within_them():
    rows = [result(method=method, group=group) for method in "ab" for group in ("20", "60")]
    assert [(one.group, one.method) for one in summarise_all(rows, INDOOR_LIMITS)] == [
        ("20", "a"), ("20", "b"), ("60", "a"), ("60", "b"),
    ]  # fmt: skip
    assert all(one.pairs == 1 for one in summarise_all(rows, INDOOR_LIMITS))


@pytest.mark.parametrize(
    ("value", "text"), [(0.05, "0.0500"), (1.234, "1.23"), (100.0, "100"), (math.nan, "-"), (math.inf, "-")]
)
def test_figures_have_three_digits(value, text):
    assert figure(value) == text


def test_a_curve_counts_the_errors_below():
    errors = np.array([3.0, 1.0, math.inf, 2.0])
    np.testing.assert_array_equal(cumulative(errors, np.array([0.0, 1.0, 1.5, 10.0])), [0, 0, 0.25, 0.75])


def test_curves_are_drawn_the_same_each_time(tmp_path):
    rows = [result(x, 0.01 * x, method=m, group=g) for x in (0.5, 3, 20) for m in "abcdefghijkl" for g in ("20", "60")]
    for name in ("a.png", "b.png"):
        draw_curves([*rows, result(method="a", group="20")], INDOOR_LIMITS, tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (tmp_path / "a.png").stat().st_size > 5000
