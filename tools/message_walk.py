#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which modules a message passes on its way to a pose: python tools/message_walk.py BAG [--config lidar]

Replays the beginning of a bag and prints each module of the package the first time that code of it runs, while the
third frame goes from the bag to a FrameResult and from there into files. docs/architecture.md tells the same in words.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import vigg_ros
from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import TopicRequest, choose_topics
from vigg_ros.pipeline import Pipeline
from vigg_ros.registration import Config
from vigg_ros.report.bag_messages import chosen_topics, read_extrinsics, read_messages
from vigg_ros.report.recording import Replay
from vigg_ros.report.replay_files import write_frames, write_result_bag, write_trajectory
from vigg_ros.tracking import FrameResult

PACKAGE = Path(vigg_ros.__file__).parent
FRAME = 3
"""The first is a keyframe, and at the second one everything that is made once is made."""


@contextmanager
def walked(modules: dict[str, str]) -> Iterator[None]:
    """Note each module of the package that runs meanwhile, and the function by which it was entered."""

    def note(frame: FrameType, event: str, _: Any) -> None:
        path = Path(frame.f_code.co_filename)
        if event == "call" and path.is_relative_to(PACKAGE):
            modules.setdefault(path.relative_to(PACKAGE).as_posix(), frame.f_code.co_name)

    threading.setprofile(note)
    sys.setprofile(note)
    try:
        yield
    finally:
        sys.setprofile(None)
        threading.setprofile(None)  # type: ignore[arg-type]


def walk(bag: Path, config: Config) -> dict[str, str]:
    """The modules in the order of the walk, each with the function by which it was entered."""
    modules: dict[str, str] = {}
    with BagReader(bag) as reader, tempfile.TemporaryDirectory() as folder:
        choice = choose_topics(reader.topics, TopicRequest(), encodings=reader.encodings())
        tree = None if choice.points is None else read_extrinsics(reader, choice)
        names = {role: topic.name for role, topic in chosen_topics(choice).items()}
        replay = Replay(Pipeline(config, None if tree is None else tree.lookup, topics=names))
        messages = ((role, one) for role, one in read_messages(reader, choice) if role != "ground_truth")
        results: Iterator[FrameResult] = replay.run(messages)
        kept = [next(results).kept() for _ in range(FRAME - 1)]
        with walked(modules):
            kept.append(next(results).kept())
            write_trajectory(kept, Path(folder) / "trajectory.tum")
            write_frames(kept, Path(folder) / "frames.csv")
            write_result_bag(kept, Path(folder) / "bag")
    return modules


def main() -> None:
    """Walk and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("bag", type=Path)
    parser.add_argument("--config", default="rgbd")
    arguments = parser.parse_args()
    modules = walk(arguments.bag, Config.preset(arguments.config))
    for module, function in modules.items():
        print(f"{module:40}{function}")
    method = sum(module.startswith(("registration/", "acceptance/")) for module in modules)
    print(f"{len(modules)} modules, {method} of them of the method and of what judges its answers")


if __name__ == "__main__":
    main()
