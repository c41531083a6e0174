# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A few frames of a bag as raw messages, bags made of them, and replays of those bags that can be looked into."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from rosbags import rosbag2

from vigg_ros.cli import replay
from vigg_ros.cli.main import main
from vigg_ros.tracking.frame_result import FrameResult
from vigg_ros_testing.bag_samples import Entry, write_bag

ROOM, STREET = (Path(__file__).parents[2] / "bags" / name for name in ("room_rgbd", "street_lidar"))
SECOND_NS = 1_000_000_000

CHEAP = {"visual.detector": "orb", "geometric.voxel_size_m": 0.06, "geometric.sample_k": 800}
"""Coarse and quick: what is tested here is what happens to messages, not how precise poses are."""


def short_entries(bag: Path, *, frames: int, every: int) -> list[Entry]:
    """Of each topic every n-th message, so many of them, as recorded."""
    found, seen = [], Counter[str]()
    with rosbag2.Reader(bag) as reader:
        for connection, log_ns, data in reader.messages():
            number = seen[connection.topic]
            seen[connection.topic] += 1
            if number % every == 0 and number // every < frames:
                found.append(Entry(connection.topic, connection.msgtype, log_ns, bytes(data)))
    return found


def write_entries(path: Path, entries: Iterable[Entry], storage: str = "mcap") -> Path:
    """A rosbag2 folder of raw messages, in this order."""
    return write_bag(path, list(entries), storage=storage)


def looped(entries: Sequence[Entry], times: int) -> list[Entry]:
    """The same messages played several times, one after the other: log times go on, stamps do not."""
    length_ns = entries[-1].log_ns - entries[0].log_ns + SECOND_NS
    return [replace(one, log_ns=one.log_ns + loop * length_ns) for loop in range(times) for one in entries]


@dataclass(slots=True)
class Watched:
    """A replay that has ended."""

    exit_code: int = -1
    output: Path = Path()
    records: list[FrameResult] = field(default_factory=list)
    """As they are kept."""
    steps: list[FrameResult] = field(default_factory=list)
    """Those that were registered, with what was compared."""


def watch_replay(bag: Path, output: Path, monkeypatch: pytest.MonkeyPatch) -> Watched:
    """`vigg replay` as a user calls it, with CHEAP options and without its report."""
    watched = Watched(output=output)
    write_frames = replay.write_frames

    def keep(records: Sequence[FrameResult], path: Path) -> None:
        watched.records.extend(records)
        write_frames(records, path)

    def offer(result: FrameResult) -> None:
        if result.state.was_registered:
            watched.steps.append(result)

    options = [word for name, value in CHEAP.items() for word in ("--set", f"{name}={value}")]
    with monkeypatch.context() as patch:
        patch.setattr(replay, "Gallery", lambda config: SimpleNamespace(offer=offer))
        patch.setattr(replay, "write_report", lambda *_: None)
        patch.setattr(replay, "write_frames", keep)
        watched.exit_code = main(["replay", str(bag), "--output", str(output), *options])
    return watched
