#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writes the generated tables of docs/data.md anew: python tools/docs_tables.py"""

from __future__ import annotations

import re
from pathlib import Path

import hostile_table
import refusal_table

PAGE = Path(__file__).parents[1] / "docs" / "data.md"
TABLES = {"hostile inputs": hostile_table.table, "codes": refusal_table.table}


def updated(text: str) -> str:
    """The page with what stands between each table's markers replaced. Raises ValueError without markers."""
    for name, table in TABLES.items():
        begin, end = f"<!-- generated: {name} -->", f"<!-- end: {name} -->"
        pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
        if len(pattern.findall(text)) != 1:
            raise ValueError(f"{PAGE.name} needs the markers {begin} and {end}, once")
        block = f"{begin}\n\n{table()}\n\n{end}"
        text = pattern.sub(lambda _, block=block: block, text)
    return text


if __name__ == "__main__":
    PAGE.write_text(updated(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
