# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A replay whose frames run out of time: no pose, a reason, and a report that explains it."""

from __future__ import annotations

import csv
from pathlib import Path

from vigg_ros.cli.console import ExitCode
from vigg_ros.cli.main import main
from vigg_ros_testing.short_recordings import CHEAP, ROOM, short_entries, write_entries


def test_frames_out_of_time_are_reported(tmp_path: Path) -> None:
    bag = write_entries(tmp_path / "bag", short_entries(ROOM, frames=3, every=4))
    changes = {**CHEAP, "time_budget_s": 1e-6}
    options = [word for name, value in changes.items() for word in ("--set", f"{name}={value}")]
    assert main(["replay", str(bag), "--output", str(tmp_path / "out"), *options]) == ExitCode.NOTHING_PAIRED
    with (tmp_path / "out" / "frames.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["state"], row["reason"]) for row in rows] == [("LOST", "TIMEOUT")] * 3
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "The time budget was used up" in page
    assert "raise time_budget_s" in page
