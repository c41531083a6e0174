# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bundled bags for the node: their messages as recorded, and what a replay says of them."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from rosbags import rosbag2

from vigg_ros.registration.config import Config
from vigg_ros.tracking.extrinsics import Lookup
from vigg_ros.tracking.frame_result import FrameResult
from vigg_ros_testing.pipeline_runs import replay_bag
from vigg_ros_testing.registrar_process import ROOT
from vigg_ros_testing.ros_peer import Peer

ROOM, STREET = ROOT / "bags" / "room_rgbd", ROOT / "bags" / "street_lidar"


@dataclass(frozen=True, slots=True)
class Recorded:
    """One message as its bytes were recorded."""

    topic: str
    type: str
    data: bytes


Moment = list[Recorded]
"""All messages of a frame, in the order in which they were recorded."""


def moments(bag: Path, topics: dict[str, str], count: int) -> list[Moment]:
    """The first frames of a bag; ``topics`` says which of them are published under which name."""
    found: defaultdict[str, list[Recorded]] = defaultdict(list)
    with rosbag2.Reader(bag) as reader:
        for connection, _, data in reader.messages():
            name = topics.get(connection.topic)
            if name is not None and len(found[name]) < count:
                found[name].append(Recorded(name, connection.msgtype, bytes(data)))
    return [list(moment) for moment in zip(*found.values(), strict=True)]


def replayed(bag: Path, count: int, config: Config, lookup: Lookup | None = None) -> list[FrameResult]:
    """What a replay says of the first frames."""
    return list(replay_bag(bag, config, frames=count, lookup=lookup).frames)


def publish(peer: Peer, moment: Moment) -> None:
    """All messages of one frame."""
    for one in moment:
        peer.connect(one.topic, one.type).publish(one.data)


def play(peer: Peer, recording: list[Moment]) -> None:
    """Publish frame after frame, each once the node has answered the one before, so that none is dropped.

    A pair whose stamps differ is certain only when the next one comes, so one frame may stay unanswered.
    """
    for one in recording[0]:
        peer.connect(one.topic, one.type)
    begun = len(peer.answers())
    for published, moment in enumerate(recording, start=begun + 1):
        publish(peer, moment)
        peer.wait(partial(_is_answered, peer, published - 1), "the answer to the frame before")
        peer.wait_briefly(partial(_is_answered, peer, published))


def _is_answered(peer: Peer, count: int) -> bool:
    return len(peer.answers()) >= count
