# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg config``: the options, as a file that can be edited or as a table that can be read."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

import yaml

from vigg_ros.cli.config_arguments import add_config_arguments, load_config
from vigg_ros.cli.console import ExitCode
from vigg_ros.registration.config import Config


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of ``vigg config``."""
    add_config_arguments(parser)
    parser.add_argument("--markdown", action="store_true", help="as a table for the documentation")


def run(arguments: Namespace) -> ExitCode:
    """Print the configuration that the other commands would use."""
    config = load_config(arguments)
    print(markdown_table(config) if arguments.markdown else commented_yaml(config), end="")
    return ExitCode.OK


def commented_yaml(config: Config) -> str:
    """A configuration file with every option explained; ``Config.load`` reads it back."""
    lines, current = [], ""
    for name, spec, value in config.options():
        section, _, key = name.rpartition(".")
        if section and section != current:
            lines.append(f"{section}:")
        current = section
        indent = "  " if section else ""
        lines.append(f"{indent}# {spec.metadata['doc']}{_bounds(spec.metadata)}")
        lines.append(f"{indent}{key}: {_yaml(value)}")
    return "\n".join(lines) + "\n"


def markdown_table(config: Config) -> str:
    """All options as rows of a table."""
    rows = ["| option | default | range | when to touch it |", "|---|---|---|---|"]
    for name, spec, value in config.options():
        rows.append(f"| `{name}` | {_yaml(value)} | {_bounds(spec.metadata).strip(' ()')} | {spec.metadata['doc']} |")
    return "\n".join(rows) + "\n"


def _bounds(meta: object) -> str:
    low, high, unit, choices = (meta[key] for key in ("low", "high", "unit", "choices"))  # type: ignore[index]
    if choices:
        return f" ({' or '.join(choices)})"
    return "" if low is None else f" ({low:g} to {high:g} {unit}".rstrip() + ")"


def _yaml(value: object) -> str:
    """As YAML writes it: Python's 5e-05 would be read back as a text."""
    return str(yaml.safe_dump(value)).removesuffix("...\n").strip()
