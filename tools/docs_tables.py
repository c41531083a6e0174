#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writes the generated tables of the pages anew: python tools/docs_tables.py

Those of docs/results.md, which are measured, are written by tools/results.py.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import checks_tables
import columns_table
import hostile_table
import readme_table
import refusal_table
import rooms_table
from results_page import with_block

from vigg_ros.node.settings import parameters_table

ROOT = Path(__file__).parents[1]
PAGES: dict[str, dict[str, Callable[[], str]]] = {
    "README.md": {"results": readme_table.table},
    "docs/architecture.md": {"rooms": rooms_table.table},
    "docs/data.md": {
        "columns": columns_table.table, "codes": refusal_table.table, "hostile inputs": hostile_table.table,
    },
    "docs/method.md": {
        "checks": checks_tables.checks, "reasons": checks_tables.reasons, "limits": checks_tables.limits,
    },
    "docs/node.md": {"parameters": parameters_table},
}  # fmt: skip
"""By page: what stands between the markers of each name."""


def updated(page: str, text: str) -> str:
    """The text of a page with its tables replaced. Raises ValueError without their markers."""
    for name, table in PAGES[page].items():
        text = with_block(text, name, f"\n{table().rstrip()}\n")
    return text


def write(page: str) -> None:
    """Write a page anew."""
    path = ROOT / page
    path.write_text(updated(page, path.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    for one in PAGES:
        write(one)
