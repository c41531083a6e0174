# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of the node: its own options and those of the method, one flat list with one set of rules."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from vigg_ros.registration.config import PRESETS, Config, renamed
from vigg_ros.registration.errors import ConfigError, DataError
from vigg_ros.registration.options import check_option, coerced, option, unknown_name
from vigg_ros.registration.rigid import inverse, rigid_from_quaternion

DYNAMIC = frozenset({"max_rate", "time_budget"})
"""Parameters that can be set while the node runs. All others are read-only."""

SHORT_NAMES = {
    "pairing.sync_slop_s": "sync_slop",
    "pairing.queue_size": "queue_size",
    "input.depth_scale_m": "depth_scale",
    "input.rectify": "rectify",
    "geometric.min_range_m": "min_range",
    "geometric.max_range_m": "max_range",
    "time_budget_s": "time_budget",
}
"""Options that users of a node set most, as nodes of this kind call them. At the start both names are accepted, since
files of the method's options have the long ones."""
_LONG_NAMES = {short: long for long, short in SHORT_NAMES.items()}

RESERVED = ("use_sim_time", "start_type_description_service", "qos_overrides.")
"""Beginnings of the names that rclpy gives to every node."""


@dataclass(frozen=True, slots=True)
class NodeOptions:
    """What only the node asks; the method's options follow it in the list of parameters."""

    config: str = option(
        "rgbd", "preset of the method's options, or a YAML file of them; each can be set by its own name besides"
    )
    geometry: str = option(
        "points",
        "where depth comes from: points for a PointCloud2 (LiDAR, or an RGB-D cloud), depth for an aligned depth image",
        choices=("points", "depth"),
    )
    base_frame: str = option("", "frame whose pose is published, such as base_link; empty for the sensor's own")
    odom_frame: str = option("odom", "name of the frame in which poses are given")
    publish_tf: bool = option(False, "on to publish odom_frame to base_frame on /tf; only one node may do so")
    tf_timeout: float = option(
        0.2, "longer where transforms arrive after the frames that need them", unit="s", low=0.0, high=10.0
    )
    extrinsics: str = option(
        "tf",
        "tf, or seven numbers x y z qx qy qz qw where no transform is published: the camera (optical frame) in the "
        "frame of the points, or, with depth images, in base_frame",
    )
    qos: str = option(
        "auto",
        "reliability asked of publishers; auto follows what they offer",
        choices=("auto", "sensor_data", "reliable"),
    )
    image_transport: str = option(
        "auto",
        "raw or compressed images on rgb/image and depth/image; auto follows what is published",
        choices=("auto", "raw", "compressed"),
    )
    max_rate: float = option(
        0.0, "frames registered per second of stamps at most, to save CPU; 0 for all", unit="Hz", low=0.0, high=1000.0
    )
    output_dir: str = option("", "existing folder into which save_trajectory writes; empty to write nothing")
    save_at_exit: bool = option(False, "on to save the trajectory into output_dir when the node ends")


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter as ROS shall describe it."""

    name: str
    default: Any
    doc: str
    unit: str
    low: float | None
    high: float | None
    choices: tuple[str, ...]

    @property
    def is_dynamic(self) -> bool:
        """Whether it can be set while the node runs."""
        return self.name in DYNAMIC

    @property
    def description(self) -> str:
        """When to touch it, its unit and choices, in one line."""
        notes = [f"[{self.unit}]"] if self.unit else []
        notes += [f"one of {', '.join(self.choices)}"] if self.choices else []
        return "; ".join([self.doc, *notes])


@dataclass(frozen=True, slots=True)
class Settings:
    """All parameters, checked one by one and together."""

    options: NodeOptions = NodeOptions()
    config: Config = Config()

    @classmethod
    def resolve(cls, given: Mapping[str, Any]) -> Settings:
        """Given values over the preset or file that ``config`` names. Raises ConfigError, and then nothing holds."""
        named = {name: value for name, value in given.items() if not name.startswith(RESERVED)}
        own = {name: value for name, value in named.items() if name in _OWN}
        options = _replaced(NodeOptions(), own)
        return cls(options, _configuration(options.config)).replace({n: v for n, v in named.items() if n not in own})

    def replace(self, changes: Mapping[str, Any]) -> Settings:
        """With some parameters changed. Raises ConfigError, and then nothing is changed."""
        changes = _short_names(changes)
        known = [parameter.name for parameter in self.parameters()]
        for name in changes:
            if name not in known:
                listed = "`registrar --parameters` lists all of them"
                raise unknown_name(name, known, what="parameter", otherwise=listed)
        own = {name: value for name, value in changes.items() if name in _OWN}
        options = _replaced(self.options, own)
        of_method = {name: value for name, value in changes.items() if name not in own}
        config = self.config.replace({_LONG_NAMES.get(name, name): value for name, value in of_method.items()})
        _check_together(options)
        return Settings(options, config)

    def parameters(self) -> Iterator[Parameter]:
        """All parameters with their values as defaults, the node's first."""
        for spec in dataclasses.fields(self.options):
            yield Parameter(spec.name, getattr(self.options, spec.name), **spec.metadata)
        for name, spec, value in self.config.options():
            yield Parameter(SHORT_NAMES.get(name, name), value, **spec.metadata)

    @property
    def T_parent_camera(self) -> NDArray[np.float64] | None:
        """The camera in the frame of the points (or, with depth images, in base_frame); None if TF is to say."""
        return parse_extrinsics(self.options.extrinsics)

    @property
    def T_camera_points(self) -> NDArray[np.float64] | None:
        """Where the points are in the camera's frame, if ``extrinsics`` says so."""
        T_parent_camera = self.T_parent_camera
        return None if T_parent_camera is None else inverse(T_parent_camera)


_OWN = {spec.name: spec for spec in dataclasses.fields(NodeOptions)}


def _short_names(changes: Mapping[str, Any]) -> dict[str, Any]:
    """The changes by the names that parameters have. Raises ConfigError where one is given by both of its names."""
    named = {SHORT_NAMES.get(name, name): value for name, value in renamed(changes).items()}
    if len(named) < len(changes):
        twice = next(short for long, short in SHORT_NAMES.items() if {long, short} <= changes.keys())
        raise ConfigError(f"{twice} and {_LONG_NAMES[twice]} are the same parameter; give one of them")
    return named


def parse_extrinsics(text: str) -> NDArray[np.float64] | None:
    """(4, 4) of "x y z qx qy qz qw", commas and brackets allowed; None for "tf". Raises ConfigError."""
    if text.strip() == "tf":
        return None
    words = text.replace(",", " ").strip(" []()").split()
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != 7 or not all(map(math.isfinite, numbers)):
        raise ConfigError(f"extrinsics is {text!r}, expected tf or seven numbers: x y z qx qy qz qw")
    try:
        return rigid_from_quaternion(numbers[:3], numbers[3:])
    except DataError as error:
        raise ConfigError(f"extrinsics: {error}") from error


def _configuration(name: str) -> Config:
    """A preset by name, or a file."""
    if name in PRESETS:
        return Config.preset(name)
    if not Path(name).exists():
        raise ConfigError(f"config is {name!r}, expected a YAML file that exists or one of {', '.join(PRESETS)}")
    return Config.load(name)


def _replaced(options: NodeOptions, changes: Mapping[str, Any]) -> NodeOptions:
    values = {name: coerced(_OWN[name], _as_text(name, value)) for name, value in changes.items()}
    for name, value in values.items():
        check_option(name, _OWN[name], value)
    return dataclasses.replace(options, **values)


def _as_text(name: str, value: Any) -> Any:
    """A list of numbers is taken for the extrinsics."""
    is_list = name == "extrinsics" and not isinstance(value, (str, bool, int, float))
    return " ".join(str(item) for item in value) if is_list else value


def _check_together(options: NodeOptions) -> None:
    """What no option can know alone."""
    T_parent_camera = parse_extrinsics(options.extrinsics)
    if T_parent_camera is not None and options.geometry == "depth" and not options.base_frame:
        raise ConfigError(
            "extrinsics is given with geometry depth, but base_frame is empty; name the base_frame in which the camera "
            "stands, or leave extrinsics at tf"
        )
    if not options.odom_frame:
        raise ConfigError("odom_frame is empty; poses need the name of a frame, such as odom")
    if options.odom_frame == options.base_frame:
        raise ConfigError(f"odom_frame and base_frame are both {options.base_frame!r}; they must differ")
    if options.save_at_exit and not options.output_dir:
        raise ConfigError("save_at_exit is on, but output_dir is empty; name the folder to save into")
    if options.output_dir and not Path(options.output_dir).expanduser().is_dir():
        raise ConfigError(f"output_dir is {options.output_dir!r}, which is no folder; create it first")


def parameters_table() -> str:
    """All parameters with their defaults (preset rgbd), ranges, and when to touch them: the table of docs/node.md."""
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
