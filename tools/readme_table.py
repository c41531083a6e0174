# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The figures of the README, taken from the tables of docs/results.md: nothing is measured or rounded here."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import failures

PAGE = Path(__file__).parents[1] / "docs" / "results.md"


@dataclass(frozen=True, slots=True)
class Row:
    """A row of the README, and the column of the results that it shows."""

    words: str
    block: str
    group: str


ROWS = (
    Row("kitchen (7-Scenes), RGB-D, frames 20 apart", "kitchen", "20"),
    Row("the same, 60 apart", "kitchen", "60"),
    Row("the same, 120 apart", "kitchen", "120"),
    Row("KITTI 04, camera and LiDAR, 11 m apart", "kitti", "8"),
    Row("the same, 22 m apart", "kitti", "16"),
    Row("rendered: furnished rooms", "rendered", "room"),
    Row("rendered: a hall that repeats every 1.2 m", "rendered", "repeated structure"),
    Row("rendered: one tile everywhere", "rendered", "repeated texture"),
    Row("rendered: white rooms with two boxes", "rendered", "weak texture"),
    Row("rendered: furnished rooms, three times the noise", "rendered", "noise"),
    Row("rendered: streets, camera and LiDAR", "rendered", "street"),
)


def table(page: str | None = None) -> str:
    """The table in Markdown, for ``failures.METHOD``."""
    page = PAGE.read_text(encoding="utf-8") if page is None else page
    lines = ["| data | pairs | RE (deg) | TE (cm) | recall | wrong answers |", "|---|---|---|---|---|---|"]
    return "\n".join([*lines, *(f"| {' | '.join(_cells(row, page))} |" for row in ROWS)])


def _cells(row: Row, page: str) -> tuple[str, ...]:
    found = _column(_block(page, row.block), row.group)
    if found is None:
        return (row.words, *["not measured"] * 5)
    pairs, cell = found
    rotation_deg, translation_cm, recall = cell.split(" / ")
    wrong = len(re.findall(rf"^- {row.group}, ", _block(page, f"{row.block} failures"), re.MULTILINE))
    return row.words, pairs, rotation_deg, translation_cm, f"{recall} %", str(wrong)


def _column(block: str, group: str) -> tuple[str, str] | None:
    """The number of pairs in a group, and what the method made of them; None where it was not measured."""
    heading: list[str] = []
    for line in block.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if cells[0] == f"`{failures.METHOD}`":
            for title, cell in zip(heading, cells, strict=True):
                match = re.fullmatch(rf"{re.escape(group)} \((\d+) pairs\)", title)
                if match:
                    return match[1], cell
        elif line.startswith("| ") and not line.startswith("| `"):
            heading = cells
    return None


def _block(page: str, name: str) -> str:
    """What stands between the markers of this name. Raises ValueError without them."""
    found = re.search(f"<!-- generated: {re.escape(name)} -->\n(.*?)<!-- end: {re.escape(name)} -->", page, re.DOTALL)
    if found is None:
        raise ValueError(f"{PAGE.name} needs the markers of {name!r}")
    return found[1]
