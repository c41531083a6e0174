# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters as the table of docs/node.md."""

from __future__ import annotations

import yaml

from vigg_ros.node.settings import Parameter, Settings


def markdown_table() -> str:
    """All parameters with their defaults (preset rgbd), ranges, and when to touch them."""
    rows = ["| parameter | default | range | when to touch it |", "|---|---|---|---|"]
    for one in Settings().parameters():
        name = f"`{one.name}`" + (" (dynamic)" if one.is_dynamic else "")
        rows.append(f"| {name} | {_yaml(one.default)} | {_range(one)} | {one.doc} |")
    return "\n".join(rows) + "\n"


def _range(one: Parameter) -> str:
    if one.choices:
        return ", ".join(one.choices)
    if one.low is None:
        return "on or off" if isinstance(one.default, bool) else "text"
    return f"{one.low:g} to {one.high:g} {one.unit}".rstrip()


def _yaml(value: object) -> str:
    return "(empty)" if value == "" else str(yaml.safe_dump(value)).removesuffix("...\n").strip()
