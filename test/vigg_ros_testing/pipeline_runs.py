# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Observations and bags through the pipeline."""

from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import choose_topics
from vigg_ros.pipeline import Pipeline
from vigg_ros.registration.config import Config
from vigg_ros.report.bag_messages import chosen_topics, read_extrinsics, read_messages
from vigg_ros.report.recording import LEADING_MESSAGES, Recording, Replay
from vigg_ros.sensors.input_decoder import Role
from vigg_ros.sensors.observation import Observation
from vigg_ros.tracking.assembly import FrameAssembler, Refusal, SyncedFrame, SyncedMessages
from vigg_ros.tracking.extrinsics import Lookup
from vigg_ros.tracking.frame_result import FrameResult


def run_observations(pipeline: Pipeline, observations: Iterable[Observation]) -> list[FrameResult]:
    """The results of a whole recording that is decoded already."""
    found = [result for one in observations for result in pipeline.finish(pipeline.pair(one).found)]
    return [*found, *pipeline.flush()]


def assemble(assembler: FrameAssembler, *observations: Observation, end: bool = False) -> list[SyncedFrame | Refusal]:
    """Frames and refusals that are certain after these observations, or at the end of the recording."""
    found = [one for observation in observations for one in assembler.synchronize(observation)]
    found += assembler.remaining() if end else []
    return [assembler.build(one) if isinstance(one, SyncedMessages) else one for one in found]


def messages_of(bag: Path) -> Iterator[tuple[Role, Any]]:
    """The messages of a bag's topics with their roles."""
    with BagReader(bag) as reader:
        yield from read_messages(reader, choose_topics(reader.topics, encodings=reader.encodings()))


def replay_bag(bag: Path, config: Config, *, frames: int | None = None, lookup: Lookup | None = None) -> Recording:
    """A bag or its first frames, with its own static transforms or with others."""
    with BagReader(bag) as reader:
        choice = choose_topics(reader.topics, encodings=reader.encodings())
        topics = {role: topic.name for role, topic in chosen_topics(choice).items()}
        tree = read_extrinsics(reader, choice)
        lookup = lookup or (None if choice.points is None or tree is None else tree.lookup)
        pipeline = Pipeline(config, lookup, topics=topics)
        replay = Replay(pipeline)
        results = [result.kept() for result in islice(replay.run(read_messages(reader, choice)), frames)]
    notes = [str(note) for note in pipeline.notes.values()]
    leaders = LEADING_MESSAGES[pipeline.leader]
    return Recording(bag.name, results, replay.truth, pipeline.refused, notes, leaders)
