# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A stand-in for tf2_ros in tests: links stand in the JSON file that FAKE_TF names, as T_base_link (4, 4) by frame."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node

from vigg_ros.messages.pose_messages import encode_transform
from vigg_ros.node.ros_classes import ros

BASE = "base_link"


class TransformException(Exception):
    """No link."""


class Buffer:
    """Answers from the file, which is read at each question."""

    def __init__(self, *, node: Node) -> None:
        self._path = Path(os.environ["FAKE_TF"])

    def lookup_transform(self, target: str, source: str, time: Any) -> TransformStamped:
        """The transform between two frames below the base, or the base itself."""
        links = {name: np.array(rows) for name, rows in json.loads(self._path.read_text()).items()}
        if links:
            links[BASE] = np.eye(4)
        if not {target, source} <= set(links):
            raise TransformException(f"{target} and {source} are not connected")
        T_target_source = np.linalg.inv(links[target]) @ links[source]
        return ros(encode_transform(T_target_source, stamp_ns=1, frame_id=target, child_frame_id=source))

    def all_frames_as_yaml(self) -> str:
        """As tf2 says it without any frames."""
        return "[]"


class TransformListener:
    """Nothing to listen to."""

    def __init__(self, buffer: Buffer, node: Node) -> None:
        pass


class TransformBroadcaster:
    """Publishes one by one on /fake_tf: there is no tf2_msgs either."""

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(TransformStamped, "/fake_tf", 100)

    def sendTransform(self, transform: TransformStamped) -> None:  # noqa: N802  (the name in tf2_ros)
        """Publish."""
        self._publisher.publish(transform)
