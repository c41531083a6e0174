# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Methods compared on pairs: the options that ``vigg evaluate pairs`` and ``rendered`` share, and their output."""

from __future__ import annotations

import json
import shlex
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from vigg_ros.bench.catalogue import METHOD_SETS, expand
from vigg_ros.bench.methods import require
from vigg_ros.bench.pair_results import RESULTS_FILE, Limits, PairResult, ResultFile, write_csv
from vigg_ros.bench.pair_summary import Summary, figure, reasons, summarise_all
from vigg_ros.bench.reliability import LEGEND, reliabilities, write_reliabilities
from vigg_ros.bench.runner import EvaluationPlan, count_missing, run_plan
from vigg_ros.cli.config_arguments import add_config_arguments
from vigg_ros.cli.console import ExitCode, Progress, UsageError, describe_machine, positive_int, table

MAX_WRONG_LISTED = 20
"""Wrong answers listed on the screen; the .csv has all."""

MAX_CURVES = 12
"""Methods in one picture; more cannot be told apart."""


def add_comparison_arguments(parser: ArgumentParser, *, presets: bool = True) -> None:
    """--methods, --jobs, --output and --set; --config, without a default, where the preset is to be chosen."""
    what = f"what to compare (default: the configuration as given); sets: {', '.join(METHOD_SETS)}; all: "
    parser.add_argument(
        "--methods", nargs="+", default=["default"], metavar="NAME", help=f"{what}`vigg evaluate methods`"
    )
    parser.add_argument("--jobs", type=positive_int, default=1, help="processes of one core (default: %(default)s)")
    output = "tables (.csv, .json) and curves (.png) go there; the same command goes on where it was stopped"
    parser.add_argument("-o", "--output", metavar="FOLDER", help=output)
    add_config_arguments(parser, default=None, choose=presets)


@dataclass(frozen=True, slots=True)
class MethodComparison:
    """Methods on pairs that are judged by the same limits, and what their tables are called."""

    name: str
    plan: EvaluationPlan
    limits: Limits
    by_overlap: Sequence[tuple[float, float]] = ()
    """Ranges of overlap, least first: where there are some, a second table has a group for each of them."""


def method_names(arguments: Namespace, *, outdoor: bool) -> list[str]:
    """The methods asked for, checked. Raises ConfigError."""
    methods = expand(arguments.methods, outdoor=outdoor)
    require(methods)
    return [method.name for method in methods]


def run_comparisons(comparisons: Sequence[MethodComparison], arguments: Namespace) -> ExitCode:
    """Run them with progress and time left, print and write their tables.

    What is in the output folder already is not run again.
    """
    folder = output_folder(arguments)
    plans = [comparison.plan for comparison in comparisons]
    with (
        TemporaryDirectory() as scratch,
        ResultFile.open((folder or Path(scratch)) / RESULTS_FILE) as file,
        Progress("results", sum(count_missing(plan, file) for plan in plans)) as progress,
    ):
        results = [run_plan(plan, file, jobs=arguments.jobs, step=progress.step) for plan in plans]
    for comparison, found in zip(comparisons, results, strict=True):
        _report(found, comparison.limits, comparison.name, folder)
        if comparison.by_overlap:
            grouped = _by_overlap(found, comparison.by_overlap)
            _report(grouped, comparison.limits, f"{comparison.name}_by_overlap", folder)
        _print_reasons(found)
        _print_wrong(found, comparison.limits)
        _print_stages(found, comparison.limits)
    pairs = zip(comparisons, results, strict=True)
    _report_reliability([(one, comparison.limits) for comparison, found in pairs for one in found], folder)
    machine = describe_machine()
    parallel = f", {arguments.jobs} at a time" if arguments.jobs > 1 else ""
    print(f"ms is a whole pair, features of both frames included, on one core of {machine['processor']}{parallel}")
    return ExitCode.OK


def output_folder(arguments: Namespace) -> Path | None:
    """The folder of --output, made if need be. Raises UsageError."""
    if arguments.output is None:
        return None
    folder = Path(arguments.output)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"--output {folder} cannot be made: {error}") from error
    return folder


def _report(results: Sequence[PairResult], limits: Limits, name: str, folder: Path | None) -> None:
    """Print the table of results, and write it with its curves into the folder."""
    summaries = summarise_all(results, limits)
    print(f"{name}: recall at {limits.recall_deg:g} deg and {100 * limits.recall_m:g} cm; medians count failures")
    rows = [summary.cells() for summary in summaries]
    print(table([list(rows[0]), *(list(row.values()) for row in rows)]))
    if folder is not None:
        _write(results, limits, summaries, folder, name)


def _report_reliability(judged: Sequence[tuple[PairResult, Limits]], folder: Path | None) -> None:
    """Print, and write into the folder, how far answers can be relied on: by group, and all together."""
    found = reliabilities(judged)
    rows = [one.cells() for one in found]
    print("reliability:")
    print(table([list(rows[0]), *(list(row.values()) for row in rows)]))
    print(*LEGEND, sep="\n")
    if folder is not None:
        write_reliabilities(found, folder / "reliability.csv")
        content = {**_conditions(), "legend": LEGEND, "reliability": [one.as_dict() for one in found]}
        _write_json(content, folder / "reliability.json")


def _by_overlap(results: Sequence[PairResult], ranges: Sequence[tuple[float, float]]) -> list[PairResult]:
    """The results grouped by how much the frames share, least first."""
    regrouped = [
        replace(result, group=f"{low:.0%} to {high:.0%}")
        for low, high in ranges
        for result in results
        if low <= result.overlap < high or result.overlap == high == 1
    ]
    assert len(regrouped) == len(results), "pairs are drawn from these ranges"
    return regrouped


def _print_reasons(results: Sequence[PairResult]) -> None:
    for method, counted in reasons(results).items():
        print(f"without an answer, {method}: " + ", ".join(f"{why} {n}" for why, n in counted.most_common()))


def _print_wrong(results: Sequence[PairResult], limits: Limits) -> None:
    """The wrong answers of the first method, the worst first."""
    wrong = [result for result in results if result.method == results[0].method and result.is_wrong(limits)]
    wrong.sort(key=lambda result: -result.translation_error_m)
    for result in wrong[:MAX_WRONG_LISTED]:
        print(
            f"wrong, {result.method}: {result.group}, target {result.target}, source {result.source}: "
            f"{figure(result.rotation_error_deg)} deg, {figure(result.translation_error_m)} m"
        )
    if len(wrong) > MAX_WRONG_LISTED:
        print(f"and {len(wrong) - MAX_WRONG_LISTED} more")


def _print_stages(results: Sequence[PairResult], limits: Limits) -> None:
    """Where the time goes, of each method over all groups."""
    print("stages, median ms:")
    for summary in summarise_all([replace(result, group="all") for result in results], limits):
        print(f"  {summary.method}: " + ", ".join(f"{stage} {ms:.0f}" for stage, ms in summary.stages_ms.items()))


def _write(
    results: Sequence[PairResult], limits: Limits, summaries: Sequence[Summary], folder: Path, name: str
) -> None:
    from vigg_ros.bench.curves import draw_curves

    write_csv(results, folder / f"{name}.csv")
    content = {"limits": asdict(limits), "summaries": [summary.as_dict() for summary in summaries]}
    _write_json({**_conditions(), **content}, folder / f"{name}.json")
    drawn = list(dict.fromkeys(result.method for result in results))[:MAX_CURVES]
    draw_curves([result for result in results if result.method in drawn], limits, folder / f"{name}.png")


def _conditions() -> dict[str, Any]:
    """With what, and on what, figures were measured."""
    return {"command": shlex.join(["vigg", *sys.argv[1:]]), **describe_machine()}


def _write_json(content: dict[str, Any], path: Path) -> None:
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
