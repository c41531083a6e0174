# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg evaluate pairs``: methods on pairs of frames of a recording, by the protocols of the paper."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path

from vigg_ros.bench.commands.bag_frames import posed_frames_of_bag
from vigg_ros.bench.commands.comparison import MethodComparison, add_comparison_arguments, method_names, run_comparisons
from vigg_ros.bench.datasets.convert import LAYOUTS, open_dataset
from vigg_ros.bench.pair_results import INDOOR_LIMITS, OUTDOOR_LIMITS
from vigg_ros.bench.pairs import PAIR_PROTOCOLS, FramePair, PairProtocol, PosedFrame, choose, pairs_listed, posed_frames
from vigg_ros.bench.runner import EvaluationPlan
from vigg_ros.cli.bag_input import add_extrinsics_argument, add_topic_arguments
from vigg_ros.cli.config_arguments import ChosenConfig, choose_suited
from vigg_ros.cli.console import ExitCode, UsageError, add_examples, positive_float, positive_int
from vigg_ros.registration.geometry import ProjectedScan

BAG = "bag"


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("layout", choices=[*LAYOUTS, BAG], help="how the folder is arranged")
    parser.add_argument("folder", help="the data set, or the bag")
    parser.add_argument("--protocol", choices=list(PAIR_PROTOCOLS), help="the paper's choice of pairs for a data set")
    parser.add_argument("--gaps", type=positive_int, nargs="+", help="in frames (default: 20 60 120)")
    parser.add_argument("--every", type=positive_int, help="only every N-th source (default: 10; 1 of listed)")
    parser.add_argument("--apart", type=positive_float, metavar="METRES", help="pairs so far apart instead of gaps")
    parser.add_argument("--truth-pairs", metavar="FILE", help="pairs with refined poses: target source and 16 numbers")
    parser.add_argument("--refine-truth", action="store_true", help="refine the poses by GICP, as is usual for KITTI")
    parser.add_argument("--ground-truth", metavar="FILE", help="of a bag: poses in TUM format, instead of a topic")
    parser.add_argument("--within-view", action="store_true", help="only the points that the camera sees")
    add_comparison_arguments(parser)
    add_topic_arguments(parser)
    add_extrinsics_argument(parser, "of a bag, instead of /tf_static")
    add_examples(
        parser,
        "vigg evaluate pairs 7scenes redkitchen --gaps 20 60",
        "vigg evaluate pairs bag bags/street_lidar --gaps 2 4 --every 4",
    )


def run(arguments: Namespace) -> ExitCode:
    """Register all pairs with all methods; one table."""
    protocol = _protocol(arguments)
    frames, outdoor, chosen = _frames(arguments, protocol)
    for note in chosen.notes:
        print(f"note: {note}", file=sys.stderr)
    pairs = _pairs(arguments, frames, protocol)
    methods = method_names(arguments, outdoor=outdoor)
    subject, refine = str(Path(arguments.folder).resolve()), protocol.refine_truth
    plan = EvaluationPlan(
        subject, pairs, methods, chosen.config, within_view=arguments.within_view, refine_truth=refine
    )
    return run_comparisons([MethodComparison("pairs", plan, OUTDOOR_LIMITS if outdoor else INDOOR_LIMITS)], arguments)


def _protocol(arguments: Namespace) -> PairProtocol:
    """The one named, with what the command line says otherwise."""
    protocol = PAIR_PROTOCOLS[arguments.protocol] if arguments.protocol else PairProtocol()
    if arguments.gaps:
        protocol = replace(protocol, gaps=tuple(arguments.gaps), apart_m=0.0)
    if arguments.every:
        protocol = replace(protocol, every=arguments.every)
    if arguments.apart:
        protocol = replace(protocol, apart_m=arguments.apart)
    if arguments.truth_pairs:  # refined already
        return replace(protocol, refine_truth=False, apart_m=0.0)
    return replace(protocol, refine_truth=True) if arguments.refine_truth else protocol


def _frames(arguments: Namespace, protocol: PairProtocol) -> tuple[list[PosedFrame], bool, ChosenConfig]:
    """The frames, whether they are scans, and the configuration for them."""
    if arguments.layout != BAG:
        dataset = open_dataset(arguments.layout, arguments.folder)
        suited = "lidar" if dataset.scans else "rgbd"
        return posed_frames(dataset), bool(dataset.scans), choose_suited(arguments, lambda: suited, "data set")
    if protocol.apart_m > 0:
        raise UsageError("pairs of a bag are chosen by --gaps in frames; --apart is for data set folders")
    rests = {offset % protocol.every for offset in (0, *protocol.gaps)}
    frames, chosen = posed_frames_of_bag(arguments, lambda number: number % protocol.every in rests)
    return frames, any(isinstance(frame.frame.load().geometry, ProjectedScan) for frame in frames[:1]), chosen


def _pairs(arguments: Namespace, frames: list[PosedFrame], protocol: PairProtocol) -> list[FramePair]:
    if arguments.truth_pairs:
        pairs = list(pairs_listed(frames, Path(arguments.truth_pairs), protocol.gaps, arguments.every or 1))
    else:
        pairs = list(choose(frames, protocol))
    if not pairs:
        asked = f"{protocol.apart_m:g} m apart" if protocol.apart_m else f"at the gaps {list(protocol.gaps)}"
        raise UsageError(f"{arguments.folder} has no pairs of frames with poses {asked}")
    return pairs
