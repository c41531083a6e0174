#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measures everything that docs/results.md and the README show, and writes their tables anew; what is measured already
is kept.

usage: python tools/results.py [--data FOLDER] [--jobs N] [--only NAME ...] [--every N]
"""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import docs_tables
import failures
import results_page

from vigg_ros.bench.rendered_pairs import DISTURBANCES, PLACES

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "results.md"
WORK = ROOT / "vigg_results"
"""Where the runs leave their results, to go on from there."""

KITCHEN = ("pairs", "7scenes", "redkitchen")
KITTI = ("pairs", "kitti", "kitti_04", "--config", "lidar", "--gaps", "8", "12", "16",
         "--truth-pairs", "kitti_04/refined_pairs.txt")  # fmt: skip


@dataclass(frozen=True, slots=True)
class Run:
    """One command, whose tables stand between the markers of its name."""

    name: str
    arguments: tuple[str, ...]
    """Of ``vigg evaluate``; words that begin with the data folder's name are looked up among the data."""
    data: str = ""
    """The folder it needs; empty where everything is rendered."""
    pictures: int = 0
    """So many of the worst failures of the first method are drawn."""

    @property
    def command(self) -> str:
        """As a reader would type it."""
        return shlex.join(("vigg", "evaluate", *self.arguments))


RUNS = (
    Run(
        "kitchen", (*KITCHEN, "--methods", "default", "whole", "paper", "floor", "baselines"), "redkitchen", pictures=3,
    ),
    Run("kitchen paper", (*KITCHEN, "--methods", "paper-ablations"), "redkitchen"),
    Run("kitchen ablations", (*KITCHEN, "--methods", "ablations"), "redkitchen"),
    Run("kitchen orb", (*KITCHEN, "--set", "visual.detector=orb"), "redkitchen"),
    Run("kitchen other gaps", (*KITCHEN, "--gaps", "40", "90", "150", "--every", "7"), "redkitchen"),
    Run(
        "kitchen wide", (*KITCHEN, "--gaps", "100", "140", "180", "220", "260", "--every", "4"), "redkitchen",
        pictures=2,
    ),
    Run("kitti", (*KITTI, "--methods", "default", "whole", "paper", "floor", "baselines"), "kitti_04", pictures=2),
    Run("kitti paper", (*KITTI, "--methods", "paper-ablations"), "kitti_04"),
    Run("kitti ablations", (*KITTI, "--methods", "ablations"), "kitti_04"),
    Run(
        "rendered", ("rendered", "--pairs", "200", "--seed", "0", "--kinds", ",".join(PLACES), "--methods", "default",
                     "whole", "paper", "floor", "fpfh-ransac", "kiss-matcher"),
        pictures=4,
    ),
    Run("rendered disturbances", ("rendered", "--pairs", "160", "--seed", "0", "--kinds", ",".join(DISTURBANCES))),
)  # fmt: skip


def main() -> int:
    """Run what is asked for, and write the page."""
    arguments = _parse()
    page = PAGE.read_text(encoding="utf-8")
    # A try is not what the commands on the page say, so it does not get there.
    written = WORK / "try" / PAGE.name if arguments.every else PAGE
    (written.parent / "images").mkdir(parents=True, exist_ok=True)
    for run in RUNS:
        if not arguments.only or run.name in arguments.only:
            for name, content in blocks(run, arguments, written.parent / "images").items():
                page = results_page.with_block(page, name, content)
            written.write_text(page, encoding="utf-8")  # after each run: a stopped one loses nothing
    page = results_page.with_block(page, "machine", results_page.machine(WORK, ROOT))
    written.write_text(page, encoding="utf-8")
    if written == PAGE:
        docs_tables.write("README.md")  # which shows some of it
    print(f"written: {written}", file=sys.stderr)
    return 0


def blocks(run: Run, arguments: argparse.Namespace, images: Path) -> dict[str, str]:
    """What stands between the markers of a run, by their names; measured if it is not yet."""
    data, folder = Path(arguments.data), WORK / run.name.replace(" ", "_")
    names = [run.name, f"{run.name} failures"] if run.pictures else [run.name]
    if run.data and not (data / run.data).is_dir():
        print(f"{run.name}: skipped, {run.data} is not in {data}", file=sys.stderr)
        return dict.fromkeys(names, results_page.absent(run.data, run.command))
    print(f"{run.name}: {run.command}", file=sys.stderr)
    measure(run, data, folder, jobs=arguments.jobs, every=arguments.every)
    found = {run.name: results_page.block(run.command, folder)}
    if run.pictures:
        found[run.name] += results_page.curves(folder, images)
        pictures = failures.draw(run.arguments, data, folder, images, run.pictures)
        found[names[1]] = f"{failures.listing(folder)}\n\n{failures.block(pictures)}"
    return found


def measure(run: Run, data: Path, folder: Path, *, jobs: int, every: int | None) -> None:
    """Run the command; its progress goes to the terminal, its tables to a file. Raises CalledProcessError."""
    words = [located(word, run.data, data) for word in run.arguments]
    more = ["--every", str(every)] if every and run.data else ["--pairs", "16"] if every else []
    command = [sys.executable, "-m", "vigg_ros.cli.main", "evaluate", *words, *more, "--jobs", str(jobs)]
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "output.txt").open("w", encoding="utf-8") as output:
        subprocess.run([*command, "--output", str(folder)], check=True, stdout=output, cwd=ROOT)


def located(word: str, name: str, data: Path) -> str:
    """A word of a command, with the data folder's place in front where it is meant."""
    return str(data / word) if name and (word == name or word.startswith(f"{name}/")) else word


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--data", default=str(ROOT.parent / "shared" / "data"), help="where the data sets are")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default: %(default)s)")
    parser.add_argument("--only", nargs="+", metavar="NAME", help=f"of: {', '.join(run.name for run in RUNS)}")
    parser.add_argument("--every", type=int, help="a try: fewer pairs, every N-th source frame; written beside")
    arguments = parser.parse_args()
    unknown = set(arguments.only or ()) - {run.name for run in RUNS}
    if unknown:
        parser.error(f"unknown runs: {', '.join(sorted(unknown))}")
    return arguments


if __name__ == "__main__":
    sys.exit(main())
