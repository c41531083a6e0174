# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg evaluate``: accuracy of pairs of a data set, by the protocol of the paper."""

from __future__ import annotations

import csv
from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from vigg_ros.bags.convert import LAYOUTS, open_dataset
from vigg_ros.commands.configuration import add_config_arguments, load_config
from vigg_ros.commands.console import ExitCode, Progress, UsageError, describe_machine, positive_int, table
from vigg_ros.evaluation.pairs import INDOOR, OUTDOOR, PairResult, PairRunner, pairs_at, pairs_listed, summarise


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of ``vigg evaluate``."""
    parser.add_argument("what", choices=("pairs",), help="pairs: frames k and k + gap of a folder with poses")
    parser.add_argument("layout", choices=list(LAYOUTS), help="how the folder is arranged")
    parser.add_argument("folder", help="the data set")
    parser.add_argument("--gaps", type=positive_int, nargs="+", default=[20, 60, 120], help="in frames (%(default)s)")
    parser.add_argument(
        "--every", type=positive_int, default=10, help="every so manyth source frame (default: %(default)s)"
    )
    parser.add_argument("--truth-pairs", metavar="FILE", help="pairs with refined poses: target source and 16 numbers")
    parser.add_argument("--within-view", action="store_true", help="only the points that the camera sees")
    parser.add_argument("--csv", metavar="FILE", help="a new file with a row for each pair")
    add_config_arguments(parser)


def run(arguments: Namespace) -> ExitCode:
    """Register all pairs and print one table."""
    config = load_config(arguments)
    dataset = open_dataset(arguments.layout, arguments.folder)
    limits = OUTDOOR if dataset.scans else INDOOR
    if arguments.truth_pairs:
        wanted = list(pairs_listed(dataset, Path(arguments.truth_pairs), arguments.gaps))
    else:
        wanted = list(pairs_at(dataset, arguments.gaps, arguments.every))
    if not wanted:
        raise UsageError(f"{arguments.folder} has no pairs of frames with poses at the gaps {arguments.gaps}")
    runner = PairRunner(dataset, config, within_view=arguments.within_view)
    results = []
    with Progress("pairs", len(wanted)) as progress:
        for pair in wanted:
            results.append(runner.run(pair))
            progress.step()
    if arguments.csv:
        write_csv(results, Path(arguments.csv))
    rows = []
    for gap in arguments.gaps:
        of_gap = [result for result in results if result.gap == gap]
        if of_gap:
            rows.append({"gap": gap, **summarise(of_gap, limits)})
    machine = describe_machine()
    print(f"recall at {limits.recall_deg:g} deg and {100 * limits.recall_m:g} cm; medians count failures")
    print(f"ms is the registration alone, on {machine['cores']} cores of {machine['processor']}")
    reasons = Counter(result.reason for result in results if not result.is_answered)
    if reasons:
        print("without an answer: " + ", ".join(f"{reason} {count}" for reason, count in reasons.most_common()))
    print(table([list(rows[0]), *(list(row.values()) for row in rows)]))
    return ExitCode.OK


def write_csv(results: Sequence[PairResult], path: Path) -> None:
    """A row for each pair; inf stands for no answer. Raises UsageError."""
    try:
        with path.open("x", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["gap", "target", "source", "reason", "rotation_error_deg", "translation_error_m"])
            for result in results:
                errors = f"{result.rotation_error_deg:.6g}", f"{result.translation_error_m:.6g}"
                writer.writerow([result.gap, result.target, result.source, result.reason, *errors])
    except OSError as error:
        raise UsageError(f"{path} cannot be written: {error}; give a new file") from error
