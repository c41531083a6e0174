# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The codes of refused and noted inputs, read from the source where they are raised."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "vigg_ros"
ROOMS = ("sensors", "tracking", "registration", "node")
RAISED_BY = {"DataError": "refused", "_layout": "refused", "Refusal": "refused", "Note": "noted"}
"""Calls that name a code, and what happens to the message then."""

CODE = re.compile(r"[A-Z][A-Z0-9]*(_[A-Z0-9]+)+|UNPAIRED")


def table() -> str:
    """The table in Markdown: code, what happens, what was expected or done, what to do."""
    said: dict[str, list[tuple[str, ...]]] = {}
    for room in ROOMS:
        for path in sorted((PACKAGE / room).glob("*.py")):
            for code, *row in codes_in(path.read_text(encoding="utf-8")):
                said.setdefault(code, []).append(tuple(row))
    rows = {code: [_joined(cell) for cell in zip(*found, strict=True)] for code, found in said.items()}
    lines = ["| code | message is | expected, or done with it | remedy |", "|---|---|---|---|"]
    cells = ((f"`{code}`", *row) for code, row in sorted(rows.items()))
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in cells)])


def codes_in(source: str) -> Iterator[tuple[str, str, str, str]]:
    """Code, kind, expectation and remedy of each call that names a code."""
    tree = ast.parse(source)
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    helpers = {one.name: _assigned(one).get("remedy") for one in functions if one.name in RAISED_BY}
    for scope in (*functions, *(node for node in tree.body if isinstance(node, ast.Assign))):
        for node in ast.walk(scope):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in RAISED_BY:
                yield from _codes_of(node, node.func.id, _assigned(scope), helpers.get(node.func.id))


def _assigned(scope: ast.AST) -> dict[str, ast.expr]:
    """What each name of a function is assigned."""
    return {
        target.id: node.value
        for node in ast.walk(scope)
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    }


def _codes_of(
    call: ast.Call, name: str, local: dict[str, ast.expr], helper_remedy: ast.expr | None
) -> Iterator[tuple[str, str, str, str]]:
    named = {keyword.arg: keyword.value for keyword in call.keywords}
    given = [local.get(node.id, node) if isinstance(node, ast.Name) else node for node in (*call.args, *[None] * 4)]
    expected = named.get("expected") or given[2]
    remedy = named.get("remedy") or helper_remedy or (given[3] if name == "Note" else None)
    texts = (_text(local.get(one.id, one) if isinstance(one, ast.Name) else one) for one in (expected, remedy))
    row = (RAISED_BY[name], *texts)
    for node in (inner for argument in given[:2] if argument is not None for inner in ast.walk(argument)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and CODE.fullmatch(node.value):
            yield node.value, *row


def _text(node: ast.expr | None) -> str:
    """A text of the source; what is only known at run time as an ellipsis."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        text = "".join(str(part.value) if isinstance(part, ast.Constant) else "…" for part in node.values)
        return text if text.strip("…") else ""
    return ""


def _joined(texts: Iterable[str]) -> str:
    """Several places may raise a code, each with words of its own."""
    return "<br>".join(filter(None, dict.fromkeys(_cell(text) for text in texts)))


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;")
