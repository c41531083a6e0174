# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg evaluate``: accuracy of pairs of a recording, of rendered pairs, and of trajectories."""

from __future__ import annotations

import importlib
from argparse import ArgumentParser, Namespace

from vigg_ros.cli.console import ExitCode

EVALUATIONS = {
    "pairs": "pairs of frames of a data set folder or a bag with known poses",
    "rendered": "pairs of rendered rooms and streets, whose motion is known exactly",
    "trajectory": "a trajectory against a reference: ATE, RPE and coverage",
    "methods": "list the methods and ablations that can be compared",
}
"""Each is a module ``evaluate_<name>`` with ``add_arguments(parser)`` and ``run(arguments)``."""


def add_arguments(parser: ArgumentParser) -> None:
    parts = parser.add_subparsers(dest="part", required=True, metavar="WHAT")
    for name, text in EVALUATIONS.items():
        part = parts.add_parser(name, help=text, description=f"{text[0].upper()}{text[1:]}.")
        module = importlib.import_module(f"vigg_ros.bench.commands.evaluate_{name}")
        module.add_arguments(part)
        part.set_defaults(run_part=module.run)


def run(arguments: Namespace) -> ExitCode:
    return ExitCode(arguments.run_part(arguments))
