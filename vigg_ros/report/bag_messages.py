# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The chosen topics of an open bag: messages with roles, static transforms, and the first few messages described."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.reader import BagReader, Topic
from vigg_ros.bags.topics import TopicChoice
from vigg_ros.registration.errors import DataError
from vigg_ros.registration.options import GeometricConfig, InputConfig
from vigg_ros.sensors.input_decoder import InputDecoder, Role
from vigg_ros.sensors.observation import ColourImage, DepthImage, Observation, PointCloud, StampedPose
from vigg_ros.sensors.stamped_pose import decode_pose, decode_transform
from vigg_ros.tracking.extrinsics import StaticTree

TOPIC_ROLES: tuple[Role, ...] = ("image", "camera_info", "depth", "points", "ground_truth")

SAMPLED_MESSAGES = 5
"""So many of each topic are decoded: enough to know the format, and quick in the largest bag."""


def chosen_topics(choice: TopicChoice) -> dict[Role, Topic]:
    """The topic that serves each role."""
    chosen = {role: getattr(choice, role) for role in TOPIC_ROLES}
    return {role: topic for role, topic in chosen.items() if topic is not None}


def read_messages(reader: BagReader, choice: TopicChoice) -> Iterator[tuple[Role, Any]]:
    """Role and message, in the order of the header stamps."""
    roles = {topic.name: role for role, topic in chosen_topics(choice).items()}
    for item in reader.messages(roles):
        yield roles[item.topic], item.message


def read_poses(reader: BagReader, topic: str) -> list[StampedPose]:
    """The poses on a topic; a broken one is left out, as one that is missing."""
    poses = []
    for item in reader.messages([topic]):
        with suppress(DataError):
            poses.append(decode_pose(item.message))
    return poses


def read_extrinsics(reader: BagReader, choice: TopicChoice) -> StaticTree | None:
    """The bag's static transforms; None if it has none. Those that are broken are left out."""
    if choice.tf_static is None:
        return None
    tree = StaticTree()
    for item in reader.messages([choice.tf_static.name]):
        for transform in getattr(item.message, "transforms", ()):
            with suppress(DataError):
                link = decode_transform(transform)
                tree.add(link.frame_id, link.child_frame_id, link.T_frame_child)
    return tree


@dataclass(frozen=True, slots=True)
class Sample:
    """The first few messages of one topic."""

    role: Role
    topic: Topic
    observations: tuple[Observation, ...]
    refusals: tuple[DataError, ...]


Samples = Mapping[Role, Sample]


def take_samples(reader: BagReader, choice: TopicChoice, config: InputConfig) -> dict[Role, Sample]:
    """Samples of the chosen topics, in the order: image, calibration, depth or points, truth."""
    decoder = InputDecoder(config, choice.image.name)
    return {role: _take(reader, decoder, role, topic) for role, topic in chosen_topics(choice).items()}


def _take(reader: BagReader, decoder: InputDecoder, role: Role, topic: Topic) -> Sample:
    observations: list[Observation] = []
    refusals: list[DataError] = []
    for item in islice(reader.messages([topic.name], order="log"), SAMPLED_MESSAGES):
        try:
            observations.append(decoder.decode(role, item.message))
        except DataError as error:
            refusals.append(error)
    return Sample(role, topic, tuple(observations), tuple(refusals))


def suggest_preset(samples: Samples) -> str:
    """``lidar`` for clouds that reach farther than an RGB-D camera sees, else ``rgbd``."""
    clouds = [cloud for cloud in observations_of(samples, "points") if isinstance(cloud, PointCloud)]
    if not clouds:
        return "lidar" if "points" in samples else "rgbd"
    return preset_for_points(clouds[0].points)


def preset_for_points(points: NDArray[np.float32]) -> str:
    """``lidar`` for points (N, 3), metres, that reach farther than an RGB-D camera sees, else ``rgbd``."""
    ranges_m = np.linalg.norm(points, axis=1)
    return "lidar" if np.percentile(ranges_m, 95) > GeometricConfig().max_range_m else "rgbd"


def find_preset(reader: BagReader, choice: TopicChoice) -> str:
    """The preset for the chosen topics of an open bag, by its first messages."""
    return suggest_preset(take_samples(reader, choice, InputConfig()))


def observations_of(samples: Samples, role: Role) -> tuple[Observation, ...]:
    """What was decoded of one sensor; nothing where no topic was chosen for it."""
    return samples[role].observations if role in samples else ()


def describe(observation: Observation) -> str:
    """One line about an image, calibration, depth image, cloud or pose."""
    frame = f"in {observation.frame_id}" if observation.frame_id else "in a frame without a name"
    if isinstance(observation, ColourImage):
        kind = "colour" if observation.image.ndim == 3 else "grey"
        return f"{_size(observation.image.shape)} {kind}, {frame}"
    if isinstance(observation, DepthImage):
        known = observation.depth_m > 0
        median_m = np.median(observation.depth_m[known])
        return f"{_size(observation.depth_m.shape)}, median {median_m:.2f} m, {known.mean():.0%} of the pixels, {frame}"
    if isinstance(observation, PointCloud):
        ranges_m = np.linalg.norm(observation.points, axis=1)
        times = "without times" if observation.times_s is None else f"measured over {np.ptp(observation.times_s):.3f} s"
        span = f"{ranges_m.min():.1f} to {ranges_m.max():.1f} m"
        return f"{len(observation.points)} points, {span} away, {times}, {frame}"
    if isinstance(observation, StampedPose):
        return f"of {observation.child_frame_id or 'a frame it does not name'}, {frame}"
    camera, rectifier = observation.camera, observation.rectifier
    lens = "nothing to undistort"
    if rectifier is not None:
        lens = f"undistorted by {rectifier.model} with {len(rectifier.coefficients)} coefficients"
    focal = f"fx {camera.fx_px:.1f} fy {camera.fy_px:.1f}"
    centre = f"cx {camera.cx_px:.1f} cy {camera.cy_px:.1f}"
    return f"{camera.width_px}x{camera.height_px}, {focal} {centre} px, {lens}, {frame}"


def _size(shape: tuple[int, ...]) -> str:
    return f"{shape[1]}x{shape[0]}"
