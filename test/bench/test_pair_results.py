# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Results kept in a file, what counts as right, and figures worked out by hand."""

import csv
import math

import numpy as np
import pytest

from vigg_ros.bench.curves import cumulative, draw_curves
from vigg_ros.bench.pair_results import INDOOR_LIMITS, OUTDOOR_LIMITS, ResultFile, write_csv
from vigg_ros.bench.pair_summary import figure, reasons, summarise, summarise_all
from vigg_ros.registration import BagError
from vigg_ros_testing.pair_samples import result


@pytest.mark.parametrize(
    ("limits", "rotation_deg", "translation_m", "right"),
    [
        (INDOOR_LIMITS, 14.9, 0.29, True),
        (INDOOR_LIMITS, 15.0, 0.1, False),
        (INDOOR_LIMITS, 1.0, 0.30, False),
        (OUTDOOR_LIMITS, 4.9, 0.59, True),
        (OUTDOOR_LIMITS, 5.0, 0.1, False),
        (OUTDOOR_LIMITS, 1.0, 0.60, False),
        (OUTDOOR_LIMITS, math.inf, math.inf, None),  # no answer is neither right nor wrong
    ],
)
def test_right_is_below_both_limits_of_the_paper(limits, rotation_deg, translation_m, right):
    one = result(rotation_deg, translation_m)
    assert (one.is_right(limits), one.is_wrong(limits)) == (right is True, right is False)


def test_what_was_written_is_there_the_next_time_and_a_line_that_was_cut_costs_only_itself(tmp_path):
    path = tmp_path / "pairs.jsonl"
    answered, refused = result(0.1 + 0.2, 1e-9), result(overlap=math.nan)
    with ResultFile.open(path) as file:
        for key, one in (("a", answered), ("b", refused), ("c", answered)):
            file.add(key, one)
    path.write_text(path.read_text()[:-20])
    with ResultFile.open(path) as file:
        assert (file.get("a"), file.get("c"), file.get("d")) == (answered, None, None)
        again = file.get("b")
        assert again is not None
        assert again.rotation_error_deg == math.inf
        assert math.isnan(again.overlap)
        file.add("c", result(3, 3))
    with ResultFile.open(path) as file:
        assert (file.get("a"), file.get("c")) == (answered, result(3, 3))


@pytest.mark.parametrize("line", ["", "{}", "[]", "3", '{"key": "a"}', '{"key": "a", "method": "m", "shoe": 43}'])
def test_lines_of_something_else_are_left_alone(tmp_path, line):
    (tmp_path / "pairs.jsonl").write_text(line + "\n")
    with ResultFile.open(tmp_path / "pairs.jsonl") as file:
        assert file.get("a") is None


def test_a_file_that_cannot_be_written_is_said(tmp_path):
    with pytest.raises(BagError, match="cannot be written"), ResultFile.open(tmp_path / "missing" / "pairs.jsonl"):
        raise AssertionError("it was not opened")
    with pytest.raises(BagError, match="cannot be written"):
        write_csv([], tmp_path / "missing" / "pairs.csv")


def test_the_table_has_a_row_for_each_result(tmp_path):
    write_csv([result(1.5, 0.25, timings_ms={"a": 1.0, "b": 2.5}), result()], tmp_path / "pairs.csv")
    rows = list(csv.DictReader((tmp_path / "pairs.csv").read_text().splitlines()))
    assert [row["rotation_error_deg"] for row in rows] == ["1.5", "inf"]
    assert [row["reason"] for row in rows] == ["", "LOST"]
    assert rows[0]["ms"] == "3.5"


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
