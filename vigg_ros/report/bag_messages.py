# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The chosen topics of an open bag as messages with roles, and its static transforms."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from vigg_ros.bags.reader import BagReader, Topic
from vigg_ros.bags.topics import TopicChoice
from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.input_decoder import Role
from vigg_ros.sensors.observation import StampedPose
from vigg_ros.sensors.stamped_pose import decode_pose, decode_transform
from vigg_ros.tracking.extrinsics import StaticTree

TOPIC_ROLES: tuple[Role, ...] = ("image", "camera_info", "depth", "points", "ground_truth")


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
