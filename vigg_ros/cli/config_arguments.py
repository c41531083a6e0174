# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The option --config and --set, common to all commands that register, and the preset that suits a bag."""

from __future__ import annotations

import math
import re
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import TopicChoice
from vigg_ros.registration.config import PRESETS, Config
from vigg_ros.registration.errors import ConfigError
from vigg_ros.report.bag_messages import find_preset

HOLDINGS = {"rgbd": "depth images or near points", "lidar": "scans that reach far"}
"""What each preset is made for."""

_EXPONENT = re.compile(r"[-+]?\d+(\.\d*)?[eE][-+]?\d+")
"""YAML 1.1 takes 1e-5, without a point or without a sign, for text."""


def add_config_arguments(parser: ArgumentParser, *, default: str | None = "rgbd", choose: bool = True) -> None:
    """--config and --set; without a default the command finds the preset itself, without ``choose`` always."""
    if choose:
        parser.add_argument(
            "--config",
            default=default,
            metavar="NAME_OR_FILE",
            help=f"a preset ({', '.join(PRESETS)}) or a YAML file (default: {default or 'by what the data holds'})",
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


@dataclass(frozen=True, slots=True)
class ChosenConfig:
    """A configuration for an open bag, and where it comes from."""

    config: Config
    source: str
    """For a reader: the preset or file, and who named it."""
    notes: tuple[str, ...]
    """Where it does not suit what the bag holds."""


def choose_config(arguments: Namespace, reader: BagReader, choice: TopicChoice) -> ChosenConfig:
    """The configuration asked for, or the preset for what the bag holds. Raises ConfigError."""
    return choose_suited(arguments, lambda: find_preset(reader, choice))


def choose_suited(arguments: Namespace, find_suited: Callable[[], str], holder: str = "bag") -> ChosenConfig:
    """The configuration asked for, or the preset that suits the data of the holder. Raises ConfigError."""
    if arguments.config is not None:
        config = load_config(arguments)  # a mistake in it is told before the data is read
        return ChosenConfig(config, f"{arguments.config}, as asked for", notes_on(config, find_suited(), holder))
    preset = find_suited()
    config = load_config(Namespace(config=preset, set=arguments.set))
    return ChosenConfig(config, f"{preset}, by what the {holder} holds", ())


def notes_on(config: Config, suited: str, holder: str = "bag") -> tuple[str, ...]:
    """One sentence where a configuration has another scale than the preset that suits the data; none where it fits.

    The scale is told by the voxels: those of the presets are a factor of ten apart, and whoever tunes one stays near.
    """
    voxel_m = config.geometric.voxel_size_m
    voxels_m = {name: Config.preset(name).geometric.voxel_size_m for name in HOLDINGS}
    nearest = min(voxels_m, key=lambda name: abs(math.log(voxel_m / voxels_m[name])))
    if nearest == suited:
        return ()
    return (
        f"the {holder} holds {HOLDINGS[suited]}, but the configuration is made for {HOLDINGS[nearest]} (voxels of "
        f"{voxel_m:g} m, where {voxels_m[suited]:g} m suits); leave --config out, or give --config {suited}",
    )


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
