# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg live``: the registrar node on a bag that is played to it, and what it answers."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from random import SystemRandom
from tempfile import TemporaryDirectory

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import TopicChoice, choose_topics
from vigg_ros.cli.bag_input import (
    add_extrinsics_argument,
    add_topic_arguments,
    find_extrinsics,
    read_truth,
    requested_topics,
)
from vigg_ros.cli.config_arguments import add_config_arguments, load_config
from vigg_ros.cli.console import ExitCode, interruptible
from vigg_ros.cli.node_command import NodeArguments, needs_ros, node_arguments, shown
from vigg_ros.cli.play import MAX_LATE_S, add_playing_arguments, make_plan
from vigg_ros.registration.errors import DataError
from vigg_ros.report.ground_truth import true_trajectory
from vigg_ros.report.samples import find_preset
from vigg_ros.report.trajectory import Trajectory
from vigg_ros.sensors.stamped_pose import decode_pose

DOMAINS = range(1, 102)
"""Those whose ports the operating system does not give to others, without 0, which everybody uses."""


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of ``vigg live``: those of a replay, and how to play."""
    parser.add_argument("bag", help="a rosbag2 folder, a lone .mcap or .db3 file, or a ROS 1 .bag")
    add_config_arguments(parser, default=None)
    add_playing_arguments(parser)
    parser.add_argument("--ground-truth", metavar="FILE", help="poses in TUM format, instead of a topic")
    parser.add_argument(
        "--domain-id",
        type=int,
        choices=range(233),
        metavar="ID",
        help="ROS domain (default: any that is not this shell's)",
    )
    add_extrinsics_argument(parser)
    add_topic_arguments(parser)


def run(arguments: Namespace) -> ExitCode:
    """Start the node, play, watch, stop the node, and print what it did."""
    with needs_ros():
        from vigg_ros.node.player.live_run import LiveRun
        from vigg_ros.node.player.live_summary import advice_on_drops, summary_table
        from vigg_ros.node.player.node_process import NodeFailed
    domain_id = _choose_domain() if arguments.domain_id is None else arguments.domain_id
    with BagReader(arguments.bag) as reader, TemporaryDirectory(prefix="vigg_live_") as folder, interruptible():
        choice = choose_topics(reader.topics, requested_topics(arguments), encodings=reader.encodings())
        node = _node_arguments(reader, choice, arguments)
        _say(shown(node))
        _say(f"on ROS_DOMAIN_ID={domain_id} (--domain-id chooses), where rviz2 and `ros2 topic` can watch too")
        live = LiveRun(
            reader,
            choice,
            truth=_read_truth(reader, choice, arguments.ground_truth),
            node_words=node.words(),
            domain_id=domain_id,
            log=Path(folder) / "node.log",
        )
        try:
            interrupted = live.run(make_plan(arguments), best_effort=arguments.best_effort)
        except NodeFailed as error:
            _say(f"vigg live: {error}")
            return ExitCode.FAILED
        if interrupted:
            _say("\nvigg live: interrupted")  # on a line of its own, as the terminal shows ^C
        for note in [*reader.notes, *choice.notes, *live.notes, *map(str, reader.losses)]:
            _say(f"note: {note}")
        print(summary_table(live.summary))
        if live.late_s > MAX_LATE_S:
            _say(f"note: the rhythm was not kept: messages came up to {live.late_s:.1f} s late")
        advice = advice_on_drops(live.summary, arguments.rate)
        if advice:
            print(advice)
        if interrupted:
            return ExitCode.INTERRUPTED
        return _verdict(live.summary.score.answered, live.summary.exit_code)


def _verdict(answered: int, exit_code: int) -> ExitCode:
    if exit_code != 0:
        _say(f"vigg live: the node ended with exit code {exit_code}, expected 0")
        return ExitCode.FAILED
    if not answered:
        _say("vigg live: no frame got a pose; the notes above and `vigg doctor` say what is missing")
        return ExitCode.NOTHING_PAIRED
    return ExitCode.OK


def _node_arguments(reader: BagReader, choice: TopicChoice, arguments: Namespace) -> NodeArguments:
    extrinsics = None if choice.points is None else find_extrinsics(arguments.extrinsics, reader, choice)
    node = node_arguments(reader, choice, extrinsics)
    config = arguments.config or find_preset(reader, choice)
    load_config(Namespace(config=config, set=arguments.set))  # a mistake in it is told here, not by the node
    options = dict(assignment.partition("=")[::2] for assignment in arguments.set)
    return NodeArguments(node.remappings, {"config": config, **node.parameters, **options})


def _read_truth(reader: BagReader, choice: TopicChoice, file: str | None) -> Trajectory | None:
    """The true poses by the recording's stamps; None if nobody knows them."""
    if file is not None:
        return true_trajectory(read_truth(Path(file)))
    if choice.ground_truth is None:
        return None
    poses = []
    for item in reader.messages([choice.ground_truth.name]):
        try:
            poses.append(decode_pose(item.message))
        except DataError:
            continue  # what is left of the truth counts, as in a replay
    return true_trajectory(poses) if poses else None


def _choose_domain() -> int:
    own = os.environ.get("ROS_DOMAIN_ID", "")
    return SystemRandom().choice([domain for domain in DOMAINS if str(domain) != own])


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
