# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The frames of a bag whose true poses are known, for ``vigg evaluate``."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from pathlib import Path

import numpy as np

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import choose_topics
from vigg_ros.bench.commands.benchmark import read_frames
from vigg_ros.bench.frame_cache import LoadedFrame
from vigg_ros.bench.pairs import PosedFrame
from vigg_ros.cli.bag_input import find_extrinsics, find_truth, requested_topics
from vigg_ros.cli.console import UsageError
from vigg_ros.pipeline import Pipeline
from vigg_ros.registration import Config
from vigg_ros.report.bag_messages import read_messages
from vigg_ros.report.trajectory import interpolate


def posed_frames_of_bag(arguments: Namespace, config: Config, is_wanted: Callable[[int], bool]) -> list[PosedFrame]:
    """Those frames, by their place in the bag, that are wanted; they are held in memory.

    Scans are taken as recorded: what their sensor's motion distorts stays so. Raises UsageError without a truth.
    """
    with BagReader(Path(arguments.folder)) as reader:
        choice = choose_topics(reader.topics, requested_topics(arguments), encodings=reader.encodings())
        extrinsics = None if choice.points is None else find_extrinsics(arguments.extrinsics, reader, choice)
        truth = find_truth(reader, choice, arguments.ground_truth)
        if truth is None:
            raise UsageError(f"{arguments.folder} has no topic with the true poses; give them with --ground-truth FILE")
        pipeline = Pipeline(config, extrinsics, topics={"image": choice.image.name})
        frames = read_frames(pipeline, read_messages(reader, choice))
        held = [(number, frame) for number, frame in enumerate(frames) if is_wanted(number)]
    found, known = interpolate(truth, np.array([frame.stamp_ns for _, frame in held], np.int64))
    poses = iter(found.T_world_sensor)
    return [
        PosedFrame(number, LoadedFrame(str(number), frame), next(poses) if is_known else None)
        for (number, frame), is_known in zip(held, known, strict=True)
    ]
