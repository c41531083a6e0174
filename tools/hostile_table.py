# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which tests cover which hostile inputs: the rows of test/hostile_inputs.txt against the tests' marks.

The tests are read, not run or imported: the table must not depend on what is installed.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROWS_FILE = ROOT / "test" / "hostile_inputs.txt"
MAX_NAMES = 3
"""So many tests are named in each file; the others are counted."""


def rows() -> list[str]:
    """All rows, "section: row", in the words of the list."""
    return ROWS_FILE.read_text(encoding="utf-8").splitlines()


def marked_tests(folder: Path = ROOT / "test") -> dict[str, list[tuple[str, str]]]:
    """By row: the files (relative to the folder) and names of the tests that are marked with it."""
    found: dict[str, list[tuple[str, str]]] = defaultdict(list)
    for path in sorted(folder.rglob("test_*.py")):
        for name, row in marks_in(path.read_text(encoding="utf-8")):
            found[row].append((str(path.relative_to(folder)), name))
    return found


def marks_in(source: str) -> Iterator[tuple[str, str]]:
    """Name and row of each mark of a test function, once each; marks may stand under names of the module."""
    tree = ast.parse(source)
    named = {
        target.id: node.value
        for node in tree.body
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            found = (row for decorator in node.decorator_list for row in _rows_of(decorator, named))
            yield from ((node.name, row) for row in dict.fromkeys(found))


def _rows_of(node: ast.AST, named: dict[str, ast.expr]) -> Iterator[str]:
    """The rows of all marks in an expression and in the names it uses."""
    for inner in ast.walk(node):
        if isinstance(inner, ast.Name) and inner.id in named:
            yield from _rows_of(named[inner.id], {name: value for name, value in named.items() if name != inner.id})
        elif isinstance(inner, ast.Call) and isinstance(inner.func, ast.Attribute) and inner.func.attr == "hostile":
            yield _text(inner.args[0], named)


def _text(node: ast.expr, named: dict[str, ast.expr]) -> str:
    value = named.get(node.id, node) if isinstance(node, ast.Name) else node
    return str(ast.literal_eval(value))


def table() -> str:
    """The table in Markdown, one part for each section, with the counts of rows covered."""
    marked = marked_tests()
    sections: dict[str, list[str]] = defaultdict(list)
    for row in rows():
        sections[row.partition(": ")[0]].append(row)
    counts = {section: sum(row in marked for row in own) for section, own in sections.items()}
    lines = ["| section | rows covered | rows |", "|---|---|---|"]
    lines += [f"| {section} | {counts[section]} | {len(own)} |" for section, own in sections.items()]
    lines += [f"| all | {sum(counts.values())} | {sum(map(len, sections.values()))} |"]
    for section, own in sections.items():
        lines += ["", f"**{section}**", "", "| row | tests |", "|---|---|"]
        lines += [f"| {_cell(row.partition(': ')[2])} | {_tests(marked.get(row, []))} |" for row in own]
    return "\n".join(lines)


def _tests(tests: list[tuple[str, str]]) -> str:
    files: dict[str, list[str]] = defaultdict(list)
    for file, name in tests:
        files[file].append(name)
    return "<br>".join(_file(file, names) for file, names in files.items()) or "none"


def _file(file: str, names: list[str]) -> str:
    more = f" and {len(names) - MAX_NAMES} more" if len(names) > MAX_NAMES else ""
    return f"{file}: {', '.join(f'`{name}`' for name in names[:MAX_NAMES])}{more}"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;").replace("*", "\\*")
