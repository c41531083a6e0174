#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writes the table of parameters in docs/node.md anew: python tools/parameters_table.py"""

from __future__ import annotations

import re
from pathlib import Path

from vigg_ros.node.parameter_table import markdown_table

PAGE = Path(__file__).parents[1] / "docs" / "node.md"
BEGIN, END = "<!-- generated: parameters -->", "<!-- end: parameters -->"


def updated(text: str) -> str:
    """The page with the table between its markers."""
    block = f"{BEGIN}\n\n{markdown_table()}\n{END}"
    return re.sub(f"{BEGIN}.*?{END}", lambda _: block, text, flags=re.DOTALL)


if __name__ == "__main__":
    PAGE.write_text(updated(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
