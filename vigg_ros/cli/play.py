# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg play``: a bag's messages over ROS 2, for a node that somebody else starts."""

from __future__ import annotations

import time
from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from vigg_ros.bags.reader import BagReader, SerialisedMessage
from vigg_ros.bags.topics import choose_topics
from vigg_ros.cli.bag_input import add_bag_arguments, requested_topics
from vigg_ros.cli.console import ExitCode, Progress, UsageError, interruptible, positive_float, say
from vigg_ros.cli.node_command import needs_ros, node_arguments

if TYPE_CHECKING:
    from vigg_ros.node.player.bag_player import BagPlayer

BETWEEN_LOOPS_S = 0.1


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of ``vigg play``."""
    add_playing_arguments(parser)
    parser.add_argument("--loop", action="store_true", help="play again and again, with the same stamps")
    parser.add_argument("--no-wait", action="store_true", help="start before the node has subscribed")


def add_playing_arguments(parser: ArgumentParser) -> None:
    """What to play and how: common to ``vigg play`` and ``vigg live``."""
    add_bag_arguments(parser)
    parser.add_argument("--rate", type=positive_float, default=1.0, help="speed: 2 is twice as fast (default: 1)")
    parser.add_argument(
        "--best-effort", action="store_true", help="publish as sensor drivers do: what is lost is not sent again"
    )
    parser.add_argument("--domain-id", type=int, choices=range(233), metavar="ID", help="ROS domain")


def run(arguments: Namespace) -> ExitCode:
    """Play until the end, Ctrl-C or SIGTERM. Raises BagError for a bag that cannot be read at all."""
    with needs_ros():
        from vigg_ros.node.player.bag_player import BagPlayer, ros_node
        from vigg_ros.node.player.dds_profile import set_profile
    with interruptible(), BagReader(arguments.bag) as reader:
        choice = choose_topics(reader.topics, requested_topics(arguments), encodings=reader.encodings())
        node = node_arguments(reader, choice, extrinsics=arguments.extrinsics)
        print(node.shell_line(arguments.domain_id), flush=True)
        profile_notes = set_profile()
        with ros_node("vigg_player", arguments.domain_id) as ros:
            player = BagPlayer(ros, reader, None, best_effort=arguments.best_effort)
            say(*(f"note: {note}" for note in [*reader.notes, *choice.notes, *profile_notes, *player.notes]))
            if not arguments.no_wait:
                say("waiting until the node has subscribed (--no-wait does not) ...")
                player.wait_for_subscribers(node.remappings.values(), time.sleep)
            while True:
                _play_once(player, sum(topic.count for topic in reader.topics), arguments.rate)
                if not arguments.loop:
                    break
                time.sleep(BETWEEN_LOOPS_S)
            player.flush()
        say(*(f"note: {note}" for note in [*player.lateness_notes(), *reader.losses]))
        return ExitCode.PARTLY_READABLE if reader.damaged else ExitCode.OK


def _play_once(player: BagPlayer, expected: int, rate: float) -> None:
    count = size_bytes = 0

    def publishing(message: SerialisedMessage) -> None:
        nonlocal count, size_bytes
        count, size_bytes = count + 1, size_bytes + len(message.data)
        progress.step()

    with Progress("messages", expected) as progress:
        player.play(rate, publishing, time.sleep)
    if not count:
        raise UsageError("there is nothing to play; `vigg doctor` says what the bag holds")
    print(f"played {count} messages, {size_bytes / 1e6:.1f} MB", flush=True)
