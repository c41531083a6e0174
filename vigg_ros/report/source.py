# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A bag as a stream of observations, with everything that was refused on the way."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import TopicChoice
from vigg_ros.registration.errors import DataError
from vigg_ros.registration.options import InputConfig
from vigg_ros.sensors.header import stamp_ns
from vigg_ros.sensors.input_decoder import InputDecoder, Role
from vigg_ros.sensors.observation import Observation
from vigg_ros.sensors.stamped_pose import decode_transform
from vigg_ros.tracking.extrinsics import StaticTree


@dataclass(frozen=True, slots=True)
class RefusedMessage:
    """A message that could be read but not used."""

    role: Role
    stamp_ns: int
    """0 if the message does not say."""
    code: str
    message: str


class BagSource:
    """The chosen topics of an open bag, decoded in order of their stamps."""

    def __init__(self, reader: BagReader, choice: TopicChoice, config: InputConfig) -> None:
        self._reader = reader
        self._choice = choice
        self._decoder = InputDecoder(config, choice.image.name)
        self._roles = message_roles(choice)
        self.notes: dict[tuple[str, str], str] = {}
        """One sentence for each topic and code of a note."""
        self.refused: Counter[str] = Counter()

    def __iter__(self) -> Iterator[Observation | RefusedMessage]:
        for item in self._reader.messages(self._roles):
            role = self._roles[item.topic]
            try:
                observation = self._decoder.decode(role, item.message)
            except DataError as error:
                self.refused[error.code] += 1
                yield RefusedMessage(role, _stamp_of(item.message), error.code, f"{item.topic}: {error}")
                continue
            for note in observation.notes:
                self.notes.setdefault((item.topic, note.code), f"{item.topic}: {note}")
            yield observation


def message_roles(choice: TopicChoice) -> dict[str, Role]:
    """What each chosen topic is for."""
    roles: dict[str, Role] = {choice.image.name: "image", choice.camera_info.name: "camera_info"}
    if choice.depth is not None:
        roles[choice.depth.name] = "depth"
    if choice.points is not None:
        roles[choice.points.name] = "points"
    if choice.ground_truth is not None:
        roles[choice.ground_truth.name] = "ground_truth"
    return roles


def _stamp_of(message: Any) -> int:
    try:
        return stamp_ns(message.header.stamp)
    except (AttributeError, DataError):
        return 0


def read_extrinsics(reader: BagReader, choice: TopicChoice) -> StaticTree | None:
    """The bag's static transforms; None if it has none. Those that are broken are left out."""
    if choice.tf_static is None:
        return None
    tree = StaticTree()
    for item in reader.messages([choice.tf_static.name]):
        for transform in getattr(item.message, "transforms", ()):
            try:
                link = decode_transform(transform)
            except DataError:
                continue
            tree.add(link.frame_id, link.child_frame_id, link.T_frame_child)
    return tree
