# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How to start the registrar node for what a bag holds: remappings and parameters."""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import TopicChoice, TopicRequest, choose_topics
from vigg_ros.cli.bag_input import find_extrinsics
from vigg_ros.cli.console import UsageError
from vigg_ros.registration.errors import DataError
from vigg_ros.registration.options import InputConfig
from vigg_ros.registration.rigid import inverse, quaternions_from_rotations
from vigg_ros.report.bag_messages import Sample, suggest_preset, take_samples


@contextmanager
def needs_ros() -> Iterator[None]:
    """Around the imports that need ROS 2: says what to do where it is missing. Raises UsageError."""
    try:
        yield
    except ImportError as error:
        if (error.name or "").startswith("vigg_ros"):
            raise
        raise UsageError(
            f"needs ROS 2 Jazzy, which cannot be imported ({error}); run `source /opt/ros/jazzy/setup.bash`, "
            "or where there is no ROS: pip install '.[ros]'"
        ) from error


@dataclass(frozen=True, slots=True)
class NodeArguments:
    """What follows ``--ros-args``."""

    remappings: dict[str, str]
    """The node's topic to the bag's."""
    parameters: dict[str, str]

    def words(self) -> list[str]:
        """For the command line."""
        words = ["--ros-args"]
        words += [word for own, name in self.remappings.items() for word in ("-r", f"{own}:={name}")]
        words += [word for name, value in self.parameters.items() for word in ("-p", f"{name}:={value}")]
        return words

    def shell_line(self, domain_id: int | None = None) -> str:
        """The line that a user can paste into a shell."""
        start = ["ros2", "run", "vigg_ros", "registrar"] if shutil.which("ros2") else ["registrar"]
        return ("" if domain_id is None else f"ROS_DOMAIN_ID={domain_id} ") + shlex.join([*start, *self.words()])


def arguments_for_bag(reader: BagReader) -> NodeArguments:
    """What fits an open bag by itself: its topics, its extrinsics, and the preset for its sensors.

    Raises TopicError or UsageError where that is not clear.
    """
    return node_arguments(reader, choose_topics(reader.topics, TopicRequest(), encodings=reader.encodings()))


def node_arguments(
    reader: BagReader,
    choice: TopicChoice,
    *,
    extrinsics: list[float] | None = None,
    config: str | None = None,
    options: Sequence[str] = (),
) -> NodeArguments:
    """Remappings and parameters for the chosen topics of an open bag. Raises UsageError.

    ``extrinsics`` and ``options`` are what --extrinsics and --set give; without ``config`` the preset is that for the
    bag. Extrinsics become a parameter, since the transforms of the bag reach the node only where tf2 is installed.
    """
    remappings = {"rgb/image": choice.image.name, "rgb/camera_info": choice.camera_info.name}
    transport = "compressed" if choice.image.type.endswith("CompressedImage") else "raw"
    samples = take_samples(reader, choice, InputConfig())
    parameters = {"config": config or suggest_preset(samples)}
    parameters |= {"geometry": "depth" if choice.points is None else "points", "image_transport": transport}
    if choice.depth is not None:
        remappings["depth/image"] = choice.depth.name
    if choice.points is not None:
        remappings["points"] = choice.points.name
        lookup = find_extrinsics(extrinsics, reader, choice)
        points_frame, camera_frame = _frame_of(samples["points"]), _frame_of(samples["image"])
        # In this order: what --extrinsics gives answers to it whatever the names.
        try:
            T_camera_points = lookup(camera_frame, points_frame)
        except DataError as error:  # frames without a name
            raise UsageError(f"{error}, with --extrinsics") from error
        if T_camera_points is None:
            raise UsageError(
                f"/tf_static does not connect {points_frame!r} (the points) with {camera_frame!r} (the camera); "
                "give --extrinsics"
            )
        parameters["extrinsics"] = _seven_numbers(inverse(T_camera_points))
    return NodeArguments(remappings, parameters | dict(option.partition("=")[::2] for option in options))


def _frame_of(sample: Sample) -> str:
    """The frame that the first messages of a topic name; empty if none does."""
    return next((one.frame_id for one in sample.observations if one.frame_id), "")


def _seven_numbers(T_points_camera: NDArray[np.float64]) -> str:
    """[x, y, z, qx, qy, qz, qw], all with a point: ROS would take "0" for an integer, and refuse a mixed list."""
    numbers = [*T_points_camera[:3, 3], *quaternions_from_rotations(T_points_camera[None, :3, :3])[0]]
    return f"[{', '.join(f'{number:.9f}' for number in numbers)}]"
