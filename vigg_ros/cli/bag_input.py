# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Opening a bag with the options that all commands on bags have: topics, extrinsics, truth, configuration."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import TopicChoice, TopicRequest, choose_topics
from vigg_ros.bags.trajectories import read_stamped_poses
from vigg_ros.cli.config_arguments import ChosenConfig, choose_config
from vigg_ros.cli.console import UsageError
from vigg_ros.pipeline import Pipeline
from vigg_ros.registration.errors import BagError, DataError
from vigg_ros.registration.rigid import inverse, rigid_from_quaternion
from vigg_ros.report.bag_messages import TOPIC_ROLES, chosen_topics, read_extrinsics, read_messages, read_poses
from vigg_ros.report.recording import true_trajectory
from vigg_ros.report.trajectory import Trajectory
from vigg_ros.sensors.input_decoder import Role
from vigg_ros.sensors.observation import StampedPose
from vigg_ros.tracking.extrinsics import Lookup, fixed


def add_bag_arguments(parser: ArgumentParser) -> None:
    """The bag, --extrinsics, --image-topic and its siblings."""
    parser.add_argument("bag", help="a rosbag2 folder, a lone .mcap or .db3 file, or a ROS 1 .bag")
    add_extrinsics_argument(parser)
    add_topic_arguments(parser)


def add_extrinsics_argument(parser: ArgumentParser, use: str = "instead of /tf_static") -> None:
    """--extrinsics, with what it is good for."""
    parser.add_argument(
        "--extrinsics",
        type=float,
        nargs=7,
        metavar=("X", "Y", "Z", "QX", "QY", "QZ", "QW"),
        help=f"where the camera (optical frame) stands in the frame of the points, {use}",
    )


def add_topic_arguments(parser: ArgumentParser) -> None:
    """--image-topic and its siblings."""
    for role in TOPIC_ROLES:
        option = f"--{role.replace('_', '-')}-topic"
        parser.add_argument(option, metavar="TOPIC", help="where several could be meant")


def requested_topics(arguments: Namespace) -> TopicRequest:
    """What --image-topic and its siblings ask for."""
    return TopicRequest(**{role: getattr(arguments, f"{role}_topic") for role in TOPIC_ROLES})


@dataclass(frozen=True, slots=True)
class BagInput:
    """An open bag, and what the options make of it."""

    reader: BagReader
    choice: TopicChoice
    chosen: ChosenConfig
    extrinsics: Lookup | None
    """Where the scan's points are in the camera's frame; None with depth images."""

    def pipeline(self) -> Pipeline:
        """A new one for these topics."""
        names: dict[Role, str] = {role: topic.name for role, topic in chosen_topics(self.choice).items()}
        return Pipeline(self.chosen.config, self.extrinsics, topics=names)

    def messages(self) -> Iterator[tuple[Role, Any]]:
        """Role and message, in the order of the header stamps."""
        return read_messages(self.reader, self.choice)

    def notes(self, pipeline: Pipeline) -> list[str]:
        """What a user should know once the bag was read through this pipeline."""
        topics = chosen_topics(self.choice)
        odd = (f"{topics[role].name}: {note}" for (role, _), note in pipeline.notes.items())
        losses = map(str, self.reader.losses)
        return [*self.chosen.notes, *self.reader.notes, *self.choice.notes, *odd, *losses]


@contextmanager
def open_bag(path: str, arguments: Namespace) -> Iterator[BagInput]:
    """Open a bag with the options of these functions and ``add_config_arguments``.

    Raises the package's errors for what cannot be read, found or used.
    """
    with BagReader(Path(path)) as reader:
        choice = choose_topics(reader.topics, requested_topics(arguments), encodings=reader.encodings())
        chosen = choose_config(arguments, reader, choice)
        extrinsics = None if choice.points is None else find_extrinsics(arguments.extrinsics, reader, choice)
        yield BagInput(reader, choice, chosen, extrinsics)


def find_extrinsics(given: list[float] | None, reader: BagReader, choice: TopicChoice) -> Lookup:
    """Where the scan's points are in the camera's frame: as given, or by the bag. Raises UsageError."""
    if given is not None:
        return fixed(given_extrinsics(given))
    tree = read_extrinsics(reader, choice)
    if tree is None:
        raise UsageError(
            "the bag has no /tf_static that says where the camera stands; give it with --extrinsics X Y Z QX QY QZ QW"
        )
    return tree.lookup


def given_extrinsics(given: list[float]) -> NDArray[np.float64]:
    """T_camera_points (4, 4) of the seven numbers of --extrinsics. Raises UsageError."""
    if not np.isfinite(given).all():
        raise UsageError(f"--extrinsics: found {given}, expected finite numbers")
    try:
        return inverse(rigid_from_quaternion(given[:3], given[3:]))
    except DataError as error:
        raise UsageError(f"--extrinsics: {error}") from error


def find_truth(reader: BagReader, choice: TopicChoice, file: str | None) -> Trajectory | None:
    """The true poses of a TUM file, else of the chosen topic; None if nobody knows them. Raises UsageError."""
    if file:
        return true_trajectory(read_truth(Path(file)))
    return None if choice.ground_truth is None else true_trajectory(read_poses(reader, choice.ground_truth.name))


def read_truth(path: Path) -> list[StampedPose]:
    """The poses of a TUM file. Raises UsageError."""
    try:
        return [StampedPose(pose.stamp_ns, "", "", pose.T_world_sensor) for pose in read_stamped_poses(path)]
    except (OSError, BagError) as error:
        raise UsageError(
            f"--ground-truth: {error}; expected a file in TUM format: stamp tx ty tz qx qy qz qw"
        ) from error
