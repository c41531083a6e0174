# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The table of results: the same figures in frames.csv and in messages."""

from __future__ import annotations

import csv
import math
from pathlib import Path

from vigg_ros.report.replay_files import write_frames
from vigg_ros.tracking.columns import RENAMED_COLUMNS, known_values_of, values_of
from vigg_ros_testing.report_samples import lost, refused, started, tracked


def test_frames_and_messages_say_the_same(tmp_path: Path) -> None:
    results = [started(), tracked(1, runner_up=0.25, keyframe_stamp_ns=7), lost(2), refused(3)]
    write_frames(results, tmp_path / "frames.csv")
    with (tmp_path / "frames.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for result, row in zip(results, rows, strict=True):
        for name, text in known_values_of(result).items():
            assert row[name] == {"True": "1", "False": "0"}.get(text, text)
        blank = {name for name in values_of(result) if row[name] in ("", "nan")}
        assert blank.isdisjoint(name for name, text in known_values_of(result).items() if text)
    assert (rows[1]["runner_up"], rows[1]["keyframe_stamp_ns"], rows[1]["ms_keypoints"]) == ("0.25", "7", "20.000")
    assert (rows[2]["reason"], rows[2]["message"]) == ("CONFLICT", "40.0% coincides, expected 60.0%")
    assert (rows[3]["state"], rows[3]["overlap"], rows[3]["ms_keypoints"]) == ("REFUSED", "", "")


def test_renamed_columns_keep_their_old_names_for_a_release() -> None:
    values = values_of(tracked(1, photometric_correlation=0.8))
    assert RENAMED_COLUMNS == {"likeness": "photometric_correlation"}
    assert values["likeness"] == values["photometric_correlation"] == 0.8


def test_messages_carry_no_figure_that_is_not_finite() -> None:
    known = known_values_of(tracked(1, runner_up=math.nan))
    assert "runner_up" not in known
    assert all(math.isfinite(float(text)) for name, text in known.items() if name.startswith(("sigma", "over", "con")))


def test_a_file_without_frames_has_its_heading(tmp_path: Path) -> None:
    write_frames([], tmp_path / "frames.csv")
    heading = ",".join([*values_of(started()), "message"])
    assert (tmp_path / "frames.csv").read_text(encoding="utf-8") == f"{heading}\n"
