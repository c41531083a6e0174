# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg evaluate rendered``: methods on rendered pairs, whose motion is known exactly."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from itertools import islice

from vigg_ros.bench.commands.comparison import MethodComparison, add_comparison_arguments, method_names, run_comparisons
from vigg_ros.bench.methods import code_digest
from vigg_ros.bench.pair_results import INDOOR_LIMITS, OUTDOOR_LIMITS
from vigg_ros.bench.pairs import FramePair
from vigg_ros.bench.rendered_pairs import NEARLY_ALL, OVERLAPS, SCENE_KINDS, STREET, pair_numbers, rendered_pair
from vigg_ros.bench.runner import EvaluationPlan
from vigg_ros.cli.config_arguments import load_config
from vigg_ros.cli.console import ExitCode, Progress, add_examples, positive_int

SCENE_GROUPS = {"rooms": ("rgbd", INDOOR_LIMITS), "streets": ("lidar", OUTDOOR_LIMITS)}
"""What is seen with a depth camera and what with a LiDAR: preset and limits."""

SOURCES = (
    "vigg_ros.bench.worlds", "vigg_ros.bench.foregrounds", "vigg_ros.bench.rendered_pairs",
    "vigg_ros.bench.view_sampling",
)  # fmt: skip
"""What the pictures depend on: results with others are left alone."""


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--pairs", type=positive_int, default=200, help="of all kinds together (default: %(default)s)")
    parser.add_argument(
        "--kinds", metavar="NAME,...", default=",".join(SCENE_KINDS),
        help="kinds of places, with commas between; the pairs of a kind are the same with or without others "
        "(default: %(default)s)",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, help="of places, motions and noise (default: %(default)s)")
    add_comparison_arguments(parser, presets=False)
    add_examples(
        parser,
        "vigg evaluate rendered --pairs 40 --kinds 'small motion,far depth'",
        "vigg evaluate rendered --pairs 100 --methods default paper --jobs 2 --output rendered",
    )


def run(arguments: Namespace) -> ExitCode:
    """Render and register; a table for rooms and one for streets, by kind and by overlap."""
    groups = [
        (name, load_config(Namespace(config=preset, set=arguments.set)), limits)
        for name, (preset, limits) in SCENE_GROUPS.items()
    ]
    methods = {name: method_names(arguments, outdoor=name == "streets") for name in SCENE_GROUPS}
    kinds = [name.strip() for name in arguments.kinds.split(",") if name.strip()]
    pairs = draw(arguments.pairs, arguments.seed, kinds)
    subject = f"rendered {arguments.seed} {code_digest(SOURCES)}"
    overlaps = (*OVERLAPS, NEARLY_ALL)
    comparisons = [
        MethodComparison(name, EvaluationPlan(subject, pairs[name], methods[name], config), limits, overlaps)
        for name, config, limits in groups
        if pairs[name]
    ]
    return run_comparisons(comparisons, arguments)


def draw(count: int, seed: int, kinds: Sequence[str]) -> dict[str, list[FramePair]]:
    """The pairs of rooms and of streets, all kinds in turn; about half a second each. Raises ConfigError."""
    numbers = islice(pair_numbers(kinds), count)
    pairs: dict[str, list[FramePair]] = {name: [] for name in SCENE_GROUPS}
    with Progress("pairs drawn", count) as progress:
        for number in numbers:
            pair = rendered_pair(number, seed)
            pairs["streets" if pair.group == STREET else "rooms"].append(pair)
            progress.step()
    return pairs
