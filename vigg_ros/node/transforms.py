# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""TF, through tf2_ros: imported only where a parameter asks for it, as the wheels on PyPI do not have it."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node
from rclpy.time import Time

from vigg_ros.messages.pose_messages import encode_transform
from vigg_ros.node.ros_classes import ros
from vigg_ros.node.tf_parents import ParentWatch
from vigg_ros.registration.errors import ConfigError
from vigg_ros.sensors.stamped_pose import decode_transform
from vigg_ros.tracking.extrinsics import require_frame_names


class Transforms:
    """What /tf and /tf_static say, and a place to publish. Raises ConfigError where tf2_ros is missing."""

    def __init__(self, node: Node, wanted_by: str) -> None:
        try:
            import tf2_ros
        except ImportError as error:
            raise ConfigError(
                f"{wanted_by} needs tf2_ros, which is missing ({error}); it comes with a ROS 2 installation "
                "(. /opt/ros/jazzy/setup.bash), not with the wheels on PyPI. Without it, give the parameter extrinsics "
                "as x y z qx qy qz qw, leave publish_tf off, and base_frame empty"
            ) from error
        self._unknown: type[Exception] = tf2_ros.TransformException
        self._buffer: Any = tf2_ros.Buffer(node=node)
        self._listener = tf2_ros.TransformListener(self._buffer, node)
        self._broadcaster = tf2_ros.TransformBroadcaster(node)
        self._parents = ParentWatch(self._buffer.all_frames_as_yaml)

    def lookup(self, target: str, source: str) -> NDArray[np.float64] | None:
        """The latest T_target_source, None while TF does not know it; does not wait. Raises DataError."""
        require_frame_names(target, source)
        try:
            transform = self._buffer.lookup_transform(target, source, Time())
        except self._unknown:
            return None
        return decode_transform(transform).T_frame_child

    def publish(self, T_odom_base: NDArray[np.float64], *, stamp_ns: int, odom: str, base: str) -> str | None:
        """Publish a transform on /tf, unless the base has another parent there: then its name is returned."""
        parent = self._parents.other_parent(base, odom, time.monotonic())
        if parent is None:
            message = encode_transform(T_odom_base, stamp_ns=stamp_ns, frame_id=odom, child_frame_id=base)
            self._broadcaster.sendTransform(ros(message))
        return parent
