# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg evaluate rendered``: methods on rendered pairs, whose motion is known exactly."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from dataclasses import replace

from vigg_ros.bench.commands.comparison import (
    add_comparison_arguments,
    compare,
    method_names,
    output_folder,
    print_details,
    print_machine,
    report,
)
from vigg_ros.bench.pair_results import INDOOR_LIMITS, OUTDOOR_LIMITS, PairResult
from vigg_ros.bench.pairs import FramePair
from vigg_ros.bench.rendered_pairs import OVERLAPS, STREET, rendered_pairs
from vigg_ros.bench.runner import EvaluationPlan
from vigg_ros.cli.config_arguments import load_config
from vigg_ros.cli.console import ExitCode, Progress, add_examples, positive_int

SCENE_GROUPS = {"rooms": ("rgbd", INDOOR_LIMITS), "streets": ("lidar", OUTDOOR_LIMITS)}
"""What is seen with a depth camera and what with a LiDAR: preset and limits."""


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of ``vigg evaluate rendered``."""
    parser.add_argument("--pairs", type=positive_int, default=200, help="of all kinds (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of places, motions and noise (default: %(default)s)")
    add_comparison_arguments(parser, presets=False)
    add_examples(
        parser,
        "vigg evaluate rendered --pairs 20",
        "vigg evaluate rendered --pairs 100 --methods default paper --jobs 2 --output rendered",
    )


def run(arguments: Namespace) -> ExitCode:
    """Render and register; a table for rooms and one for streets, by kind and by overlap."""
    config_of = {
        subject: load_config(Namespace(config=preset, set=arguments.set))
        for subject, (preset, _) in SCENE_GROUPS.items()
    }
    methods = {subject: method_names(arguments, outdoor=subject == "streets") for subject in SCENE_GROUPS}
    pairs = draw(arguments.pairs, arguments.seed)
    plans = [
        (
            EvaluationPlan(f"rendered {arguments.seed}", pairs[subject], methods[subject], config_of[subject]),
            SCENE_GROUPS[subject][1],
        )
        for subject in SCENE_GROUPS
        if pairs[subject]
    ]
    folder = output_folder(arguments)
    subjects = [subject for subject in SCENE_GROUPS if pairs[subject]]
    for subject, (_, limits), results in zip(subjects, plans, compare(plans, arguments), strict=True):
        report(results, limits, subject, folder)
        report(by_overlap(results), limits, f"{subject}_by_overlap", folder)
        print_details(results, limits)
    print_machine(arguments.jobs)
    return ExitCode.OK


def draw(count: int, seed: int) -> dict[str, list[FramePair]]:
    """The pairs of rooms and of streets; about half a second each."""
    pairs: dict[str, list[FramePair]] = {subject: [] for subject in SCENE_GROUPS}
    with Progress("pairs drawn", count) as progress:
        for pair in rendered_pairs(count, seed):
            pairs["streets" if pair.group == STREET else "rooms"].append(pair)
            progress.step()
    return pairs


def by_overlap(results: Sequence[PairResult]) -> list[PairResult]:
    """The results grouped by how much the frames share, least first."""
    regrouped = [
        replace(result, group=f"{low:.0%} to {high:.0%}")
        for low, high in OVERLAPS
        for result in results
        if low <= result.overlap < high
    ]
    assert len(regrouped) == len(results), "pairs are drawn from these ranges"
    return regrouped
