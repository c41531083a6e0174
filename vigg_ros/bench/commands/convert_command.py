# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg convert``: data set folders to bags."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace

from vigg_ros.bench.datasets.convert import LAYOUTS, convert
from vigg_ros.cli.console import ExitCode, Progress, add_examples, positive_float, table


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("layout", choices=list(LAYOUTS), help="how the folder is arranged")
    parser.add_argument("folder", help="the data set")
    parser.add_argument("-o", "--output", required=True, metavar="BAG", help="the bag to write; it must not exist")
    parser.add_argument("--storage", choices=("mcap", "sqlite3"), default="mcap")
    parser.add_argument("--compression", choices=("none", "chunk", "message", "file"), default="none")
    names = ("FX", "FY", "CX", "CY")
    parser.add_argument("--intrinsics", type=float, nargs=4, metavar=names, help="pixels, where no file tells")
    parser.add_argument("--depth-scale", type=positive_float, metavar="UNITS", help="of the depth images per metre")
    parser.add_argument("--rate", type=positive_float, metavar="HZ", help="of numbered images without stamps")
    add_examples(
        parser,
        "vigg convert 7scenes redkitchen -o kitchen_bag",
        "vigg convert kitti sequences/04 -o kitti_bag --compression chunk",
    )


def run(arguments: Namespace) -> ExitCode:
    """Write the bag and say what is in it."""
    with Progress("messages", 0) as progress:
        summary = convert(
            arguments.layout,
            arguments.folder,
            arguments.output,
            storage=arguments.storage,
            compression=arguments.compression,
            progress=progress.show,
            intrinsics=None if arguments.intrinsics is None else tuple(arguments.intrinsics),
            depth_scale=arguments.depth_scale,
            rate_hz=arguments.rate,
        )
    for note in summary.notes:
        print(f"note: {note}", file=sys.stderr)
    print(table([("topic", "messages"), *summary.counts.items()]))
    print(f"{summary.output}: {summary.duration_s:.1f} s; replay it with: vigg replay {summary.output}")
    return ExitCode.OK
