# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The option --config and --set, common to all commands that register."""

from __future__ import annotations

import re
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

import yaml

from vigg_ros.registration.config import PRESETS, Config
from vigg_ros.registration.errors import ConfigError

_EXPONENT = re.compile(r"[-+]?\d+(\.\d*)?[eE][-+]?\d+")
"""YAML 1.1 takes 1e-5, without a point or without a sign, for text."""


def add_config_arguments(parser: ArgumentParser, *, default: str | None = "rgbd", choose: bool = True) -> None:
    """--config and --set; without a default the command finds the preset itself, without ``choose`` always."""
    if choose:
        parser.add_argument(
            "--config",
            default=default,
            metavar="NAME_OR_FILE",
            help=f"a preset ({', '.join(PRESETS)}) or a YAML file (default: {default or 'by what the bag holds'})",
        )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="OPTION=VALUE",
        help="change one option, e.g. visual.detector=orb; see `vigg config` for all of them",
    )


def load_config(arguments: Namespace) -> Config:
    """Command line over file over default. Raises ConfigError."""
    return _named(arguments.config).replace(dict(map(_assignment, arguments.set)))


def _named(name: str) -> Config:
    """A preset or a file; presets come first, lest a file that happens to lie here changes what they mean."""
    path = Path(name)
    if name in PRESETS or not (path.suffix or "/" in name or path.exists()):
        return Config.preset(name)
    if not path.exists():
        raise ConfigError(f"--config {name} does not exist; give a file or one of {', '.join(PRESETS)}")
    return Config.load(path)


def _assignment(text: str) -> tuple[str, Any]:
    name, equals, value = text.partition("=")
    if not equals:
        raise ConfigError(f"--set {text!r} has no =; expected OPTION=VALUE, e.g. visual.top_k=300")
    if _EXPONENT.fullmatch(value.strip()):
        return name.strip(), float(value)
    try:
        return name.strip(), yaml.safe_load(value)
    except yaml.YAMLError as error:
        raise ConfigError(f"--set {name}: {value!r} is not a value: {' '.join(str(error).split())}") from error
