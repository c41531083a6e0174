# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The frames of a bag whose true poses are known, for ``vigg evaluate``."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable

import numpy as np

from vigg_ros.bench.commands.benchmark import read_frames
from vigg_ros.bench.frame_cache import LoadedFrame
from vigg_ros.bench.pairs import PosedFrame
from vigg_ros.cli.bag_input import find_truth, open_bag
from vigg_ros.cli.config_arguments import ChosenConfig
from vigg_ros.cli.console import UsageError
from vigg_ros.pipeline import Pipeline
from vigg_ros.report.bag_messages import read_messages
from vigg_ros.report.trajectory import interpolate


def posed_frames_of_bag(
    arguments: Namespace, is_wanted: Callable[[int], bool]
) -> tuple[list[PosedFrame], ChosenConfig]:
    """Those frames, by their place in the bag, that are wanted, held in memory; and the configuration for them.

    Scans are taken as recorded: what their sensor's motion distorts stays so. Raises UsageError without a truth.
    """
    with open_bag(arguments.folder, arguments) as source:
        truth = find_truth(source.reader, source.choice, arguments.ground_truth)
        if truth is None:
            raise UsageError(f"{arguments.folder} has no topic with the true poses; give them with --ground-truth FILE")
        pipeline = Pipeline(source.chosen.config, source.extrinsics, topics={"image": source.choice.image.name})
        frames = read_frames(pipeline, read_messages(source.reader, source.choice))
        held = [(number, frame) for number, frame in enumerate(frames) if is_wanted(number)]
    found, known = interpolate(truth, np.array([frame.stamp_ns for _, frame in held], np.int64))
    poses = iter(found.T_world_sensor)
    posed = [
        PosedFrame(number, LoadedFrame(str(number), frame), next(poses) if is_known else None)
        for (number, frame), is_known in zip(held, known, strict=True)
    ]
    return posed, source.chosen
