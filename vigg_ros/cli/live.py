# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg live``: the registrar node on a bag that is played to it, and what it answers."""

from __future__ import annotations

import os
from argparse import ArgumentParser, Namespace
from pathlib import Path
from random import SystemRandom
from tempfile import TemporaryDirectory

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import choose_topics
from vigg_ros.cli.bag_input import find_truth, requested_topics
from vigg_ros.cli.config_arguments import add_config_arguments, load_config
from vigg_ros.cli.console import ExitCode, interruptible, say
from vigg_ros.cli.node_command import needs_ros, node_arguments
from vigg_ros.cli.play import add_playing_arguments
from vigg_ros.report.wording import table_text

DOMAINS = range(1, 102)
"""Those whose ports the operating system does not give to others, without 0, which everybody uses."""


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of ``vigg live``: how to play, and those of a replay."""
    add_playing_arguments(parser)
    add_config_arguments(parser, default=None)
    parser.add_argument("--ground-truth", metavar="FILE", help="poses in TUM format, instead of a topic")


def run(arguments: Namespace) -> ExitCode:
    """Start the node, play, watch, stop the node, and print what it did."""
    with needs_ros():
        from vigg_ros.node.player.live_run import LiveRun
        from vigg_ros.node.player.live_table import advice_on_drops
        from vigg_ros.node.player.node_process import NodeFailed
    domain_id = _free_domain() if arguments.domain_id is None else arguments.domain_id
    with BagReader(arguments.bag) as reader, TemporaryDirectory(prefix="vigg_live_") as folder, interruptible():
        choice = choose_topics(reader.topics, requested_topics(arguments), encodings=reader.encodings())
        node = node_arguments(
            reader, choice, extrinsics=arguments.extrinsics, config=arguments.config, options=arguments.set
        )
        # A mistake in it is told here, not by the node.
        load_config(Namespace(config=node.parameters["config"], set=arguments.set))
        live = LiveRun(reader, choice, find_truth(reader, choice, arguments.ground_truth), domain_id=domain_id)
        say(node.shell_line(domain_id), "rviz2 and `ros2 topic` can watch on that domain; --domain-id chooses another")
        try:
            interrupted = live.run(
                node.words(), Path(folder) / "node.log", rate=arguments.rate, best_effort=arguments.best_effort
            )
        except NodeFailed as error:
            say(f"vigg live: {error}")
            return ExitCode.FAILED
        if interrupted:
            say("\nvigg live: interrupted")  # on a line of its own, as the terminal shows ^C
        say(*(f"note: {note}" for note in [*reader.notes, *choice.notes, *live.notes, *reader.losses]))
        table = table_text({"recording": reader.path.name, **live.rows()})
        print(*filter(None, (table, advice_on_drops(live.frames, arguments.rate))), sep="\n")
        if interrupted:
            return ExitCode.INTERRUPTED
        return _verdict(len(live.frames.answered), live.exit_code)


def _verdict(answered: int, exit_code: int) -> ExitCode:
    if exit_code != 0:
        say(f"vigg live: the node ended with exit code {exit_code}, expected 0")
        return ExitCode.FAILED
    if not answered:
        say("vigg live: no frame got a pose; the notes above and `vigg doctor` say what is missing")
        return ExitCode.NOTHING_PAIRED
    return ExitCode.OK


def _free_domain() -> int:
    """Any that is not this shell's."""
    own = os.environ.get("ROS_DOMAIN_ID", "")
    return SystemRandom().choice([domain for domain in DOMAINS if str(domain) != own])
