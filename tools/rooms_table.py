# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The rooms of the package: what each is for (its docstring), and what it may import (test/test_architecture.py)."""

from __future__ import annotations

import ast
import importlib.util
from pathlib import Path

ROOT = Path(__file__).parents[1]
PLACES = {"player": "node/player/", "vigg_ros": "__init__.py"}
"""Rooms that do not lie where their name says."""


def table() -> str:
    """The table in Markdown, in the order of the flow."""
    rules = _rules()
    rows = []
    for room, allowed in rules.items():
        place = PLACES.get(room, f"{room}/" if (ROOT / "vigg_ros" / room).is_dir() else f"{room}.py")
        imports = ", ".join(one for one in rules if one in allowed) or "nothing"
        rows.append((f"`{place}`", purpose(ROOT / "vigg_ros" / place), imports))
    lines = (f"| {' | '.join(row)} |" for row in rows)
    return "\n".join(["| room | what it is for | may import |", "|---|---|---|", *lines])


def purpose(place: Path) -> str:
    """The first paragraph of the docstring of a package or module, on one line."""
    path = place / "__init__.py" if place.is_dir() else place
    said = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return " ".join(said.split("\n\n")[0].split()).replace("``", "`")


def _rules() -> dict[str, set[str]]:
    """What the test allows: the rules stand there, and nowhere else."""
    spec = importlib.util.spec_from_file_location("test_architecture", ROOT / "test" / "test_architecture.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    rules: dict[str, set[str]] = module.MAY_IMPORT
    return rules
