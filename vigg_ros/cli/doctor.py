# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg doctor``: a page about a bag, ending with the command that replays it."""

from __future__ import annotations

import shlex
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime, timezone
from pathlib import Path

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.rhythm import Rhythm
from vigg_ros.bags.topics import TopicChoice, TopicRequest
from vigg_ros.cli.bag_input import add_bag_arguments, find_extrinsics, requested_topics
from vigg_ros.cli.config_arguments import add_config_arguments, load_config, notes_on
from vigg_ros.cli.console import ExitCode, say, table
from vigg_ros.registration.config import Config
from vigg_ros.report.bag_messages import SAMPLED_MESSAGES, TOPIC_ROLES, Sample, describe
from vigg_ros.report.diagnosis import Diagnosis, diagnose
from vigg_ros.report.findings import DoctorFinding
from vigg_ros.sensors.header import NS_PER_S
from vigg_ros.tracking.extrinsics import Lookup

TOPIC_COLUMNS = ("topic", "type", "messages", "rate", "from", "to", "largest gap", "jitter")
ROLE_NAMES = {
    "image": "colour images",
    "camera_info": "calibration",
    "depth": "depth images",
    "points": "scans",
    "ground_truth": "ground truth",
}


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of ``vigg doctor``: those of a replay that change what it reads."""
    add_bag_arguments(parser)
    add_config_arguments(parser, default=None)


def run(arguments: Namespace) -> ExitCode:
    """Print the page. Raises BagError for a bag that cannot be read at all."""
    with BagReader(arguments.bag) as reader:
        diagnosis = _diagnose(reader, arguments)
        print("\n".join(page(reader, diagnosis, arguments)))
        damaged = reader.damaged
    if arguments.config is not None and diagnosis.samples:
        say(*(f"note: {note}" for note in notes_on(load_config(arguments), diagnosis.preset)))
    if not diagnosis.replays:
        return ExitCode.NOTHING_PAIRED
    return ExitCode.PARTLY_READABLE if damaged else ExitCode.OK


def _diagnose(reader: BagReader, arguments: Namespace) -> Diagnosis:
    def find_config(preset: str) -> Config:
        return load_config(Namespace(config=arguments.config or preset, set=arguments.set))

    def extrinsics_of(choice: TopicChoice) -> Lookup | None:
        if arguments.extrinsics is None and choice.tf_static is None:
            return None
        return find_extrinsics(arguments.extrinsics, reader, choice)

    return diagnose(reader, requested_topics(arguments), find_config=find_config, find_extrinsics=extrinsics_of)


def page(reader: BagReader, diagnosis: Diagnosis, arguments: Namespace) -> Iterator[str]:
    """The lines of the page."""
    yield f"{reader.path}: {_verdict(diagnosis, damaged=reader.damaged)}"
    yield from _section("What the bag holds", _contents(reader, diagnosis.rhythms))
    yield from _section("What a replay reads", _inputs(diagnosis.samples))
    preset = [f"the preset for it is {diagnosis.preset}, which a replay chooses"]
    is_chosen = diagnosis.samples and not arguments.config
    yield from _section("How it fits together", [*diagnosis.fit, *(preset if is_chosen else [])])
    yield from _section("What is lost", map(str, reader.losses))
    yield from _section("What is missing", _finding_lines([one for one in diagnosis.findings if one.blocks]))
    odd = _finding_lines([one for one in diagnosis.findings if not one.blocks])
    yield from _section("What is odd", [*odd, *reader.notes])
    commands = [replay_command(arguments, request) for request in diagnosis.replays]
    yield from _section("Replay it with" if len(commands) < 2 else "Replay it with one of", commands)


def _verdict(diagnosis: Diagnosis, *, damaged: bool) -> str:
    if not diagnosis.replays:
        return "cannot be replayed as it is"
    return "can be replayed, but a part of it is lost" if damaged else "can be replayed"


def _section(title: str, lines: Sequence[str] | Iterator[str]) -> Iterator[str]:
    """A title and its lines, or nothing."""
    lines = list(lines)
    if lines:
        yield from ("", title, *(f"  {line}" for line in lines))


def _inputs(samples: Sequence[Sample]) -> Iterator[str]:
    """One row for each topic that a replay reads."""
    first = [describe(one.observations[0]) if one.observations else "unusable" for one in samples]
    rows = [(ROLE_NAMES[one.role], one.topic.name, said) for one, said in zip(samples, first, strict=True)]
    if rows:
        yield from table([("for", "topic", "first message"), *rows]).split("\n")
        yield f"Of each, {SAMPLED_MESSAGES} messages were decoded; of the others only the stamps were read."


def _finding_lines(findings: Sequence[DoctorFinding]) -> list[str]:
    return [line for finding in findings for line in (f"- {finding.text}", f"  -> {finding.remedy}")]


def _contents(reader: BagReader, rhythms: Mapping[str, Rhythm]) -> Iterator[str]:
    """One row for each topic; times count from the first stamp of the bag."""
    stamped = [one.stamps_ns for one in rhythms.values() if one.stamps_ns.size and one.has_stamps]
    start_ns = min((int(stamps_ns.min()) for stamps_ns in stamped), default=None)
    rows = [_row(topic.name, topic.type, topic.count, rhythms.get(topic.name), start_ns) for topic in reader.topics]
    yield from table([TOPIC_COLUMNS, *rows]).split("\n")
    if start_ns is not None:
        day = datetime.fromtimestamp(max(0, start_ns) // NS_PER_S, timezone.utc)
        yield f"Times are header stamps, counted from {start_ns} ns ({day:%Y-%m-%d %H:%M:%S} UTC);"
        yield "those with * are times of recording, as the type has no header."


def _row(name: str, kind: str, count: int, rhythm: Rhythm | None, start_ns: int | None) -> tuple[str, ...]:
    shown = kind.replace("/msg/", "/")
    if rhythm is None or not rhythm.stamps_ns.size or start_ns is None:
        return name, shown, str(count), *["-"] * 5
    first_s, last_s = ((int(stamp) - start_ns) / NS_PER_S for stamp in (rhythm.stamps_ns[0], rhythm.stamps_ns[-1]))
    mark = "" if rhythm.has_stamps else "*"
    times = (f"{first_s:.3f} s{mark}", f"{last_s:.3f} s{mark}")
    if not rhythm.period_ns > 0:
        return name, shown, str(count), "-", *times, "-", "-"
    gap, jitter = f"{rhythm.largest_gap_ns / 1e6:.1f} ms", f"{rhythm.jitter_ns / 1e6:.1f} ms"
    return name, shown, str(count), f"{NS_PER_S / rhythm.period_ns:.1f} Hz", *times, gap, jitter


def replay_command(arguments: Namespace, request: TopicRequest) -> str:
    """The command line that replays the bag with these topics, and with what the user gave here."""
    words = ["vigg", "replay", str(Path(arguments.bag))]
    words += [] if arguments.config is None else ["--config", arguments.config]
    words += [word for assignment in arguments.set for word in ("--set", assignment)]
    words += [] if arguments.extrinsics is None else ["--extrinsics", *map(str, arguments.extrinsics)]
    for name in TOPIC_ROLES:
        topic = getattr(request, name)
        words += [] if topic is None else [f"--{name.replace('_', '-')}-topic", topic]
    return shlex.join(words)
