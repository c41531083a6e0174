# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The configuration as a whole: presets, files, and changes by dotted names such as ``visual.top_k``."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import yaml

from vigg_ros.registration.errors import ConfigError
from vigg_ros.registration.options import (
    MAX_CELLS_PER_AXIS,
    AcceptanceConfig,
    CliqueConfig,
    GeometricConfig,
    InputConfig,
    KeyframeConfig,
    LocalMatchConfig,
    NoiseConfig,
    PairingConfig,
    RefinementConfig,
    VisualConfig,
    check_option,
    coerced,
    mask_boxes,
    option,
    unknown_name,
)


@dataclass(frozen=True, slots=True)
class Config:
    """Everything that can be chosen. The defaults are the ``rgbd`` preset."""

    visual: VisualConfig = VisualConfig()
    geometric: GeometricConfig = GeometricConfig()
    noise: NoiseConfig = NoiseConfig()
    cliques: CliqueConfig = CliqueConfig()
    local_match: LocalMatchConfig = LocalMatchConfig()
    refinement: RefinementConfig = RefinementConfig()
    acceptance: AcceptanceConfig = AcceptanceConfig()
    keyframes: KeyframeConfig = KeyframeConfig()
    pairing: PairingConfig = PairingConfig()
    input: InputConfig = InputConfig()
    time_budget_s: float = option(
        0.0, "time after which a frame is given up (TIMEOUT); 0 for none, and the same answers on every computer",
        unit="s", low=0.0, high=3600.0,
    )
    seed: int = option(0, "another draw of the sampled source points", low=0, high=2**31 - 1)

    def __post_init__(self) -> None:
        for name, spec, value in self.options():
            check_option(name, spec, value)
        mask_boxes(self.input.mask_boxes)
        if self.geometric.min_range_m >= self.geometric.max_range_m:
            raise ConfigError(
                f"geometric.min_range_m is {self.geometric.min_range_m} and geometric.max_range_m is "
                f"{self.geometric.max_range_m}; the first must be below the second"
            )

        # The shortest search radius cuts the range into cells, whose numbers must stay countable.
        widest_m = math.sqrt(self.local_match.gamma_squared / 3) * self.cliques.inlier_threshold_m
        reach_m = self.local_match.fixed_zone_m or widest_m
        cells = 2 * self.geometric.max_range_m / min(1.5 * self.geometric.voxel_size_m, reach_m)
        if cells >= MAX_CELLS_PER_AXIS - 4:
            raise ConfigError(
                f"geometric.max_range_m is {self.geometric.max_range_m}, too far for cells of "
                f"geometric.voxel_size_m {self.geometric.voxel_size_m} and cliques.inlier_threshold_m "
                f"{self.cliques.inlier_threshold_m}; lower the range or use larger voxels"
            )

    def options(self) -> Iterator[tuple[str, dataclasses.Field[Any], Any]]:
        """Dotted name, field and value of every option, in order of declaration."""
        for entry in fields(self):
            value = getattr(self, entry.name)
            if dataclasses.is_dataclass(value):
                yield from ((f"{entry.name}.{f.name}", f, getattr(value, f.name)) for f in fields(value))
            else:
                yield entry.name, entry, value

    def replace(self, changes: Mapping[str, Any]) -> Config:
        """A copy with options changed, by dotted name. Raises ConfigError, and then nothing is changed."""
        known = {name: spec for name, spec, _ in self.options()}
        changes = renamed(changes)
        sections: dict[str, dict[str, Any]] = {}
        for name, value in changes.items():
            if name not in known:
                raise unknown_name(name, list(known), what="option", otherwise=f"known are {', '.join(known)}")
            section, _, key = name.rpartition(".")
            sections.setdefault(section, {})[key] = coerced(known[name], value)
        top = sections.pop("", {})
        new = {section: dataclasses.replace(getattr(self, section), **keys) for section, keys in sections.items()}
        return dataclasses.replace(self, **new, **top)

    @classmethod
    def preset(cls, name: str) -> Config:
        """A named configuration; see ``PRESETS``."""
        if name not in PRESETS:
            raise unknown_name(name, list(PRESETS), what="preset", otherwise=f"known are {', '.join(PRESETS)}")
        return cls().replace(PRESETS[name])

    @classmethod
    def load(cls, path: str | Path) -> Config:
        """Read a YAML file of sections, or a ROS parameter file that holds them.

        ``preset: lidar`` at the top starts from another preset. Raises ConfigError.
        """
        try:
            content = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
            raise ConfigError(f"{path} cannot be read as a YAML file: {error}") from error
        flat = dict(_flatten(_parameters(content, path)))
        return cls.preset(str(flat.pop("preset", "rgbd"))).replace(flat)

    def to_yaml(self) -> str:
        """The file that ``load`` reads back to an equal configuration."""
        tree: dict[str, Any] = {}
        for name, _, value in self.options():
            section, _, key = name.rpartition(".")
            (tree.setdefault(section, {}) if section else tree)[key] = value
        return str(yaml.safe_dump(tree, sort_keys=False))


OLD_SECTION = "verification."
"""What ``acceptance`` was called in version 0.1."""

REMOVED = {
    f"{section}min_inliers": "acceptance.max_false_alarms says how often chance may show what speaks for an answer"
    for section in ("acceptance.", OLD_SECTION)
}
"""Options that are gone, and what to use instead."""

PAPER: dict[str, Any] = {
    "visual.max_pixels": 100_000_000,
    "geometric.feature_grid_voxels": 1.0,
    "geometric.normal_radius_voxels": 2.0,
    "geometric.feature_radius_voxels": 5.0,
    "geometric.always": True,
    "noise.model": "none",
    "geometric.mutual": False,
    "cliques.geometric_hypotheses": False,
    "local_match.geometric_prior": False,
    "refinement.iterations": 0,
    "acceptance.enabled": False,
    "acceptance.candidates": 1,
}
"""Changes to a preset that give the paper's method as published: no geometric hypotheses, refinement or refusal."""

PRESETS: dict[str, dict[str, Any]] = {
    "rgbd": {},
    "lidar": {
        "visual.max_pixels": 200_000,
        "visual.max_keypoints": 3000,
        "visual.top_k": 300,
        "geometric.voxel_size_m": 0.3,
        "geometric.min_range_m": 2.5,
        "geometric.max_range_m": 80.0,
        "geometric.sample_k": 10000,
        "cliques.inlier_threshold_m": 0.6,
        # Between the beams of a scan surfaces are missed that a depth image would show.
        "acceptance.min_consistency": 0.4,
        "keyframes.max_translation_m": 10.0,
        "keyframes.max_rotation_deg": 30.0,
        "pairing.sync_slop_s": 0.05,
    },
}
PRESETS |= {f"{name}_paper": {**PRESETS[name], **PAPER} for name in ("rgbd", "lidar")}


def renamed(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Options by the names they have now; a FutureWarning tells of old ones. Raises ConfigError for both at once and
    for options that are gone."""
    out: dict[str, Any] = {}
    for name, value in changes.items():
        if name in REMOVED:
            raise ConfigError(f"{name} is no option any more; {REMOVED[name]}")
        new = name
        if name.startswith(OLD_SECTION):
            new = f"acceptance.{name.removeprefix(OLD_SECTION)}"
            warnings.warn(f"{name} is called {new} now; the old name works in this release only", FutureWarning, 3)
        if new in out:
            raise ConfigError(f"{new} is given by its old name too; give one of them")
        out[new] = value
    return out


def _parameters(content: Any, path: str | Path) -> Mapping[str, Any]:
    """The options of a plain file, or those below ros__parameters."""
    if content is None:
        return {}
    if isinstance(content, Mapping) and len(content) == 1:
        inner = next(iter(content.values()))
        if isinstance(inner, Mapping) and "ros__parameters" in inner:
            content = inner["ros__parameters"]
    if not isinstance(content, Mapping):
        raise ConfigError(f"{path} holds {type(content).__name__}, expected sections of options")
    return content


def _flatten(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in tree.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            yield from _flatten(value, f"{name}.")
        else:
            yield name, value
