# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The generated tables of docs/data.md are those of the source, and every mark names a row of the list."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from vigg_ros.bench.datasets.convert import LAYOUTS
from vigg_ros.cli.console import ExitCode

ROOT = Path(__file__).parents[1]

import docs_tables  # noqa: E402
import hostile_table  # noqa: E402
import refusal_table  # noqa: E402

PAGE = ROOT / "docs" / "data.md"


def test_the_tables_are_up_to_date() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert docs_tables.updated(text) == text, "run: python tools/docs_tables.py"


def test_every_mark_names_a_row_of_the_list() -> None:
    unknown = {row: tests for row, tests in hostile_table.marked_tests().items() if row not in hostile_table.rows()}
    assert not unknown


def test_no_row_stands_twice() -> None:
    rows = hostile_table.rows()
    assert len(rows) == len(set(rows))


def test_marks_are_those_that_pytest_sees(request: pytest.FixtureRequest) -> None:
    """Reading the source finds what importing it gives, for all tests collected in this run."""
    read = {(file, name, row) for row, tests in hostile_table.marked_tests().items() for file, name in tests}
    seen = {
        (str(item.path.relative_to(ROOT / "test")), item.originalname, mark.args[0])
        for item in request.session.items
        for mark in item.iter_markers("hostile")
    }
    assert seen <= read


@pytest.mark.parametrize(
    "source",
    [
        '@pytest.mark.hostile("A: b")\ndef test_it(): ...',
        'ROW = pytest.mark.hostile("A: b")\n@ROW\ndef test_it(): ...',
        'TEXT = "A: b"\n@pytest.mark.hostile(TEXT)\ndef test_it(): ...',
        'CASES = [pytest.param(1, marks=pytest.mark.hostile("A: " "b"))]\n'
        '@pytest.mark.parametrize("x", CASES)\ndef test_it(x): ...',
    ],
)
def test_a_mark_is_found_wherever_it_stands(source: str) -> None:
    assert list(hostile_table.marks_in(source)) == [("test_it", "A: b")]


def test_a_page_without_markers_is_an_error() -> None:
    with pytest.raises(ValueError, match="needs the markers"):
        docs_tables.updated("# Data\n")


def test_every_code_of_the_source_is_in_the_table() -> None:
    documented = set(re.findall(r"^\| `([A-Z_0-9]+)` \|", refusal_table.table(), re.MULTILINE))
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "vigg_ros" / "messages").glob("*.py")]
    # Every text in capitals with an underscore, however it is used: a code that a new helper raises is found too.
    written = {code for source in sources for code in re.findall(r'"([A-Z][A-Z0-9]*(?:_[A-Z0-9]+)+)"', source)}
    assert written - {"MAX_PIXELS", "MAX_POINTS", "MAX_RANGE_M"} <= documented


def test_every_exit_code_and_layout_is_on_the_page() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert all(f"\n| {int(code)} | " in text for code in ExitCode)
    assert all(f"`{layout}`" in text for layout in LAYOUTS)
