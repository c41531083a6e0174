# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All methods by name, and sets of them."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence

from vigg_ros.bench.ablations import BASE_METHODS, DEFAULT_METHOD, VARIATIONS, ablation
from vigg_ros.bench.alternatives import BASELINES
from vigg_ros.bench.methods import Method
from vigg_ros.registration import ConfigError

INDOOR_VARIATIONS = ("zone-0.05", "zone-0.1", "zone-0.2")
OUTDOOR_VARIATIONS = ("zone-0.3", "zone-0.6", "zone-1.2", "within-view")
DEPTH_IMAGE_METHODS = ("rgbd-odometry",)
EQUIVALENT_VARIATIONS = {"iterations-3", "gamma2-10", "iterations-0"}
"""Variations that are the full method or no-vgm by another name: they can be asked for, and are left out of sets."""

PAPER_SWEEPS = ("iterations-", "gamma2-", "zone-", "sample-")
"""Sweeps of the paper's parameters, left out of the set of our own ablations."""


def all_names() -> list[str]:
    """Every method."""
    ours = [name for base in BASE_METHODS for name in (base, *(f"{base}:{variation}" for variation in VARIATIONS))]
    return [DEFAULT_METHOD, *ours, *BASELINES]


def find_method(name: str) -> Method:
    """The method of this name. Raises ConfigError."""
    if name not in all_names():
        close = difflib.get_close_matches(name, [*all_names(), *METHOD_SETS], n=1, cutoff=0.5)
        hint = f"did you mean {close[0]}?" if close else "see `vigg evaluate methods`"
        raise ConfigError(f"unknown method {name!r}; {hint}")
    base, _, variation = name.partition(":")
    return BASELINES[name] if name in BASELINES else ablation(base, variation)


def expand(names: Sequence[str], *, outdoor: bool) -> list[Method]:
    """The methods of these names, sets among them resolved; each once, in order. Raises ConfigError."""
    wanted = [one for name in names for one in (_members(name, outdoor=outdoor) if name in METHOD_SETS else [name])]
    return [find_method(name) for name in dict.fromkeys(wanted)]


def _members(name: str, *, outdoor: bool) -> Iterator[str]:
    """The methods of a set that make sense for this sensor."""
    if name == "baselines":
        yield from (n for n in BASELINES if n != "floor" and not (outdoor and n in DEPTH_IMAGE_METHODS))
        return
    base = METHOD_SETS[name][0]
    # Which number of sampled points is the full method's depends on the sensor's preset.
    repeated = {*EQUIVALENT_VARIATIONS, "sample-10000" if outdoor else "sample-5000"}
    left_out = {*repeated, *(INDOOR_VARIATIONS if outdoor else OUTDOOR_VARIATIONS)}
    sweeps = () if base == "paper" else PAPER_SWEEPS
    yield base
    for variation in VARIATIONS:
        if variation not in left_out and not any(map(variation.startswith, sweeps)):
            yield f"{base}:{variation}"


METHOD_SETS = {
    "baselines": ("", "the alternatives, without the floor"),
    "ablations": ("whole", "ablations of our whole method"),
    "paper-ablations": ("paper", "ablations of the paper's method as published"),
}
"""Names that stand for several: the base of their members, and what they are."""
