# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The frames of a bag whose true poses are known, for ``vigg evaluate``."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import TopicChoice, choose_topics
from vigg_ros.bench.commands.benchmark import read_frames
from vigg_ros.bench.frame_cache import LoadedFrame
from vigg_ros.bench.pairs import PosedFrame
from vigg_ros.cli.bag_input import find_extrinsics, read_truth, requested_topics
from vigg_ros.cli.console import UsageError
from vigg_ros.pipeline import Pipeline
from vigg_ros.registration import Config, DataError
from vigg_ros.report.bag_messages import read_messages
from vigg_ros.report.ground_truth import true_trajectory
from vigg_ros.report.trajectory import Trajectory, interpolate
from vigg_ros.sensors.stamped_pose import decode_pose


def posed_frames_of_bag(arguments: Namespace, config: Config, is_wanted: Callable[[int], bool]) -> list[PosedFrame]:
    """Those frames, by their place in the bag, that are wanted; they are held in memory.

    Scans are taken as recorded: what their sensor's motion distorts stays so. Raises UsageError without a truth.
    """
    with BagReader(Path(arguments.folder)) as reader:
        choice = choose_topics(reader.topics, requested_topics(arguments), encodings=reader.encodings())
        extrinsics = None if choice.points is None else find_extrinsics(arguments.extrinsics, reader, choice)
        truth = _truth(arguments, reader, choice)
        pipeline = Pipeline(config, extrinsics, topics={"image": choice.image.name})
        frames = read_frames(pipeline, read_messages(reader, choice))
        held = [(number, frame) for number, frame in enumerate(frames) if is_wanted(number)]
    found, known = interpolate(truth, np.array([frame.stamp_ns for _, frame in held], np.int64))
    poses = iter(found.T_world_sensor)
    return [
        PosedFrame(number, LoadedFrame(str(number), frame), next(poses) if is_known else None)
        for (number, frame), is_known in zip(held, known, strict=True)
    ]


def _truth(arguments: Namespace, reader: BagReader, choice: TopicChoice) -> Trajectory:
    if arguments.ground_truth:
        return true_trajectory(read_truth(Path(arguments.ground_truth)))
    if choice.ground_truth is None:
        raise UsageError(f"{arguments.folder} has no topic with the true poses; give them with --ground-truth FILE")
    return poses_of_topic(reader, choice.ground_truth.name)


def poses_of_topic(reader: BagReader, name: str) -> Trajectory:
    """The poses on a topic of a bag. A broken one leaves a gap, which is not bridged if it is long."""
    poses = []
    for item in reader.messages([name]):
        with suppress(DataError):
            poses.append(decode_pose(item.message))
    return true_trajectory(poses)
