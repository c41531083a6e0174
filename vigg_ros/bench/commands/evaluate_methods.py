# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg evaluate methods``: what can be compared, by name."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from vigg_ros.bench.ablations import BASE_METHODS, DEFAULT_METHOD, VARIATIONS
from vigg_ros.bench.alternatives import BASELINES
from vigg_ros.bench.catalogue import METHOD_SETS, find_method
from vigg_ros.cli.console import ExitCode, table


def add_arguments(_: ArgumentParser) -> None:
    """It takes none."""


def run(_: Namespace) -> ExitCode:
    """Print the names with a line about each."""
    rows: list[tuple[str, str]] = [("name", "what it is")]
    rows += [(method.name, method.what) for method in (find_method(name) for name in (DEFAULT_METHOD, *BASE_METHODS))]
    rows += [(f"whole:{name}, paper:{name}", variation.what) for name, variation in VARIATIONS.items()]
    rows += [(method.name, method.what) for method in BASELINES.values()]
    rows += [(name, f"set: {what}") for name, (_, what) in METHOD_SETS.items()]
    print(table(rows))
    return ExitCode.OK
