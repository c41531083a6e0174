#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Feeds the messages of a bag to a Pipeline, as the node and `vigg replay` do, and plots where the camera went.

    python examples/replay_and_plot.py bags/room_rgbd --output path.png

Messages are taken as rosbags or rclpy give them. For camera-LiDAR bags, pass the extrinsics to Pipeline as well.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np

from vigg_ros import Pipeline
from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import TopicRequest, choose_topics
from vigg_ros.registration import Config
from vigg_ros.report.bag_messages import chosen_topics, read_messages
from vigg_ros.tracking import FrameResult

mpl.use("Agg")
from matplotlib import pyplot


def replayed(bag: Path) -> list[FrameResult]:
    """A result for each colour image of the bag: a pose, or the reason why there is none."""
    with BagReader(bag) as reader:
        choice = choose_topics(reader.topics, TopicRequest(), encodings=reader.encodings())
        topics = {role: topic.name for role, topic in chosen_topics(choice).items()}
        pipeline = Pipeline(Config.preset("rgbd"), topics=topics)
        results: list[FrameResult] = []
        for role, message in read_messages(reader, choice):
            results += (result.kept() for result in pipeline.feed(role, message))  # without its images
        return [*results, *(result.kept() for result in pipeline.flush())]


def main() -> None:
    """Replay and plot."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("bag", type=Path)
    parser.add_argument("--output", default="path.png")
    arguments = parser.parse_args()
    results = replayed(arguments.bag)
    if all(one.T_odom_frame is None for one in results):
        raise SystemExit(f"no frame got a pose; the first one: {results[0].reason}: {results[0].message}")
    positions = np.array([one.T_odom_frame[:3, 3] for one in results if one.T_odom_frame is not None]).reshape(-1, 3)
    figure, axes = pyplot.subplots()
    axes.plot(positions[:, 0], positions[:, 2], ".-")  # an optical frame: x to the right, z ahead
    axes.set(xlabel="x (m)", ylabel="z (m)", title=f"{len(positions)} of {len(results)} frames", aspect="equal")
    figure.savefig(arguments.output)
    print(f"{len(positions)} of {len(results)} frames got a pose: {arguments.output}")


if __name__ == "__main__":
    main()
