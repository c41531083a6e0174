# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Results kept in a file, and what counts as right."""

from __future__ import annotations

import csv
import math

import pytest

from vigg_ros.bench.pair_results import INDOOR_LIMITS, OUTDOOR_LIMITS, ResultFile, write_csv
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
    ],
)
def test_right_is_below_both_limits_of_the_paper(limits, rotation_deg, translation_m, right):
    one = result(rotation_deg, translation_m)
    assert one.is_right(limits) is right
    assert one.is_wrong(limits) is not right


def test_no_answer_is_neither_right_nor_wrong():
    assert not result().is_right(INDOOR_LIMITS)
    assert not result().is_wrong(INDOOR_LIMITS)


def test_what_was_written_is_there_the_next_time(tmp_path):
    path = tmp_path / "pairs.jsonl"
    answered, refused = result(0.1 + 0.2, 1e-9), result(overlap=math.nan)
    with ResultFile.open(path) as file:
        file.add("a", answered)
        file.add("b", refused)
    with ResultFile.open(path) as file:
        assert file.get("a") == answered
        again = file.get("b")
        assert again is not None
        assert again.rotation_error_deg == math.inf
        assert math.isnan(again.overlap)
        assert file.get("c") is None


def test_a_line_that_was_cut_costs_only_itself(tmp_path):
    path = tmp_path / "pairs.jsonl"
    with ResultFile.open(path) as file:
        file.add("a", result(1, 1))
        file.add("b", result(2, 2))
    path.write_text(path.read_text()[:-20])
    with ResultFile.open(path) as file:
        assert file.get("a") == result(1, 1)
        assert file.get("b") is None
        file.add("b", result(3, 3))
    with ResultFile.open(path) as file:
        assert (file.get("a"), file.get("b")) == (result(1, 1), result(3, 3))


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
