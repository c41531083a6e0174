# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg play``: a bag's messages over DDS, for nodes on this computer or others."""

from __future__ import annotations

import math
import sys
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from vigg_ros.bags.reader import BagReader, Topic
from vigg_ros.cli.console import ExitCode, Progress, UsageError, interruptible, positive_float, positive_int
from vigg_ros.cli.node_command import arguments_for_bag, needs_ros, shown
from vigg_ros.registration.errors import ViggError

if TYPE_CHECKING:
    from vigg_ros.node.player.playback import Plan, Playback, Sending

WAIT_S = 10.0
"""So long the first message waits for somebody to subscribe."""

MAX_LATE_S = 0.5
"""Above this the recorded rhythm is no longer kept, and is said not to be."""


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of ``vigg play``."""
    parser.add_argument("bag", help="a rosbag2 folder, a lone .mcap or .db3 file, or a ROS 1 .bag")
    add_playing_arguments(parser)
    parser.add_argument("--topics", nargs="+", metavar="TOPIC", help="only these (default: all)")
    parser.add_argument("--clock", action="store_true", help="publish /clock, for nodes with use_sim_time")
    parser.add_argument(
        "--wait",
        type=seconds,
        default=WAIT_S,
        metavar="S",
        help=f"start when somebody has subscribed, or after so many seconds (default: {WAIT_S:g})",
    )


def add_playing_arguments(parser: ArgumentParser) -> None:
    """How to play: common to ``vigg play`` and ``vigg live``."""
    parser.add_argument("--rate", type=positive_float, default=1.0, help="speed: 2 is twice as fast (default: 1)")
    parser.add_argument(
        "--loop", type=positive_int, nargs="?", const=0, default=1, metavar="N", help="play N times (no N: for ever)"
    )
    parser.add_argument(
        "--now",
        action="store_true",
        help="move all stamps by the same amount, so that the first one is now (default: stamps as recorded)",
    )
    parser.add_argument(
        "--best-effort", action="store_true", help="publish as sensor drivers do: what is lost is not sent again"
    )
    parser.add_argument(
        "--order",
        choices=("log", "stamp"),
        default="log",
        help="the rhythm of arrival at the recorder, or that of the header stamps (default: log)",
    )
    parser.add_argument("--start", type=seconds, default=0.0, metavar="S", help="leave out so many seconds at first")
    parser.add_argument("--duration", type=positive_float, default=math.inf, metavar="S", help="play so many seconds")


def seconds(text: str) -> float:
    """For argparse: a finite number from 0 on."""
    value = float(text)
    if not 0 <= value < math.inf:  # nor does NaN pass
        raise ArgumentTypeError(f"{text} is not a number of seconds")
    return value


def run(arguments: Namespace) -> ExitCode:
    """Play until the end, Ctrl-C or SIGTERM. Raises BagError for a bag that cannot be read at all."""
    with needs_ros():
        from vigg_ros.node.player.bag_publishers import Publishers
        from vigg_ros.node.player.dds_profile import set_profile
        from vigg_ros.node.player.participant import participant
        from vigg_ros.node.player.playback import Playback
        from vigg_ros.node.player.sim_time import clock_publisher
    if arguments.clock and arguments.now:
        raise UsageError("--clock tells the recording's time and --now moves stamps to the present; give one of them")
    with interruptible(), BagReader(arguments.bag) as reader:
        topics = _wanted_topics(reader, arguments)
        _print_node_line(reader)
        notes = set_profile()
        with participant("vigg_player") as node:
            latched = reader.latched() | {"/tf_static"}
            publishers = Publishers(node, topics, latched, best_effort=arguments.best_effort)
            ticks = [clock_publisher(node)] if arguments.clock else []
            _say([*reader.notes, *notes, *publishers.notes])
            if not publishers.wait_for_subscribers(arguments.wait) and arguments.wait:
                _say([f"nobody has subscribed within {arguments.wait:g} s; playing all the same"])
            _play(Playback(reader, publishers, make_plan(arguments), ticks=ticks), topics)
            publishers.flush()
        _say(map(str, reader.losses))
        return ExitCode.PARTLY_READABLE if reader.damaged else ExitCode.OK


def make_plan(arguments: Namespace) -> Plan:
    """How to play, of the arguments."""
    from vigg_ros.node.player.playback import Plan

    return Plan(
        rate=arguments.rate,
        loops=arguments.loop,
        order=arguments.order,
        now=arguments.now,
        start_s=arguments.start,
        duration_s=arguments.duration,
    )


def _play(playback: Playback, topics: Sequence[Topic]) -> None:
    count, size_bytes = 0, 0
    total = sum(topic.count for topic in topics)
    with Progress("messages", total) as progress:

        def show(sending: Sending) -> None:
            nonlocal count, size_bytes
            count += 1
            size_bytes += sending.size_bytes
            progress.show(count, total * (playback.loop + 1))

        playback.run(show)
    if not count:
        raise UsageError("there is nothing to play; `vigg doctor` says what the bag holds, and from when to when")
    print(f"played {count} messages, {size_bytes / 1e6:.1f} MB, {playback.position_s:.1f} s of the recording")
    if playback.late_s > MAX_LATE_S:
        _say([f"the rhythm was not kept: messages came up to {playback.late_s:.1f} s late; play with a lower --rate"])


def _wanted_topics(reader: BagReader, arguments: Namespace) -> list[Topic]:
    """The topics to play. Raises UsageError for one that the bag does not hold."""
    topics = [topic for topic in reader.topics if not (arguments.clock and topic.name == "/clock")]
    if arguments.topics is None:
        return topics
    wanted = {name.strip("/") for name in arguments.topics}
    unknown = wanted - {topic.name.strip("/") for topic in topics}
    if unknown:
        held = ", ".join(topic.name for topic in topics)
        raise UsageError(f"--topics: the bag does not hold {', '.join(sorted(unknown))}, but: {held}")
    return [topic for topic in topics if topic.name.strip("/") in wanted]


def _print_node_line(reader: BagReader) -> None:
    """How to start the registrar for this bag, bare, so that a shell can take it; else why that is not clear."""
    try:
        print(shown(arguments_for_bag(reader)), flush=True)
    except ViggError as error:
        _say([f"no command starts the node for this bag: {error}"])


def _say(notes: Iterable[str]) -> None:
    for note in notes:
        print(f"note: {note}", file=sys.stderr, flush=True)
