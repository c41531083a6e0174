# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Publishers: what a result becomes on the ROS graph."""

from __future__ import annotations

from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry, Path
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image, PointCloud2

from vigg_ros.messages.diagnostic_messages import encode_diagnostic_array
from vigg_ros.messages.fields import Message
from vigg_ros.messages.result_messages import PathPoses, PoseMessages
from vigg_ros.messages.sensor_messages import encode_image, encode_points
from vigg_ros.node.ros_classes import ros
from vigg_ros.pictures import Picture, draw_matches
from vigg_ros.registration.result import Registration
from vigg_ros.registration.rigid import transform
from vigg_ros.tracking.frame_result import Comparison, FrameResult
from vigg_ros.tracking.sensor_mount import BaseResult

_RELIABLE = QoSProfile(depth=10)
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_PICTURE = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


class Publishers:
    """All publishers of the node but /tf. Stamps are those of the inputs."""

    def __init__(self, node: Node, *, odom_frame: str, base_frame: str) -> None:
        self._odom_frame = odom_frame
        self._messages = PoseMessages(odom_frame=odom_frame, base_frame=base_frame)
        types = {"pose": PoseStamped, "relative_pose": PoseWithCovarianceStamped, "odom": Odometry}
        self._by_topic = {name: node.create_publisher(kind, f"~/{name}", _RELIABLE) for name, kind in types.items()}
        self._path = node.create_publisher(Path, "~/path", _LATCHED)
        self._keyframe_points = node.create_publisher(PointCloud2, "~/keyframe_points", _LATCHED)
        self._matches = node.create_publisher(Image, "~/matches", _PICTURE)
        self._status = node.create_publisher(DiagnosticStatus, "~/status", _RELIABLE)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", _RELIABLE)
        self._path_poses: PathPoses[Any] = PathPoses()
        self._reference: tuple[int, int] | None = None

    def publish_pose(self, base: BaseResult) -> None:
        """Pose of the base, the registration itself, and odometry."""
        for topic, message in self._messages.of(base):
            stamped = ros(message)
            self._by_topic[topic].publish(stamped)
            if topic == "pose":
                self._path_poses.add(stamped, base.result.session)

    def publish_views(self, base: BaseResult) -> None:
        """The cloud of a new reference, and a picture of the matches where somebody looks at it."""
        result, compared = base.result, base.result.compared
        if compared is None:
            return
        self._publish_reference(base, compared)
        if self._matches.get_subscription_count():
            picture = matches_picture(result, compared)
            message = encode_image(picture, stamp_ns=result.stamp_ns, frame_id=result.frame_id)
            self._matches.publish(ros(message))

    def publish_status(self, status: Message) -> None:
        """A line of ~/status."""
        self._status.publish(ros(status))

    def publish_diagnostics(self, statuses: list[Message], *, stamp_ns: int) -> None:
        """A message on /diagnostics."""
        self._diagnostics.publish(ros(encode_diagnostic_array(statuses, stamp_ns=stamp_ns)))

    def publish_path(self) -> None:
        """The path so far, if it has grown."""
        poses = self._path_poses.take()
        if poses:
            self._path.publish(Path(header=poses[-1].header, poses=poses))

    def forget(self) -> None:
        """Begin a new path, and show that the old one and its keyframe hold no more; a reset asks for it."""
        if self._reference is not None:
            nothing = encode_points(np.empty((0, 3)), stamp_ns=self._reference[1], frame_id=self._odom_frame)
            self._keyframe_points.publish(ros(nothing))
        self._reference = None
        self._messages.restart()
        newest = self._path_poses.clear()
        if newest is not None:
            self._path.publish(Path(header=newest.header))

    def child_frame(self, base: BaseResult) -> str:
        """The frame whose pose is published."""
        return self._messages.child_frame(base)

    def _publish_reference(self, base: BaseResult, compared: Comparison) -> None:
        """The cloud of the keyframe in the odometry frame, once for each reference."""
        result, keyframe = base.result, compared.keyframe
        if result.new_keyframe and result.T_odom_frame is not None:
            stamp_ns, features, T_odom_sensor = result.stamp_ns, compared.features, result.T_odom_frame
        elif keyframe is not None:
            stamp_ns, features = keyframe.frame.stamp_ns, keyframe.features
            T_odom_sensor = keyframe.pose.T_parent_child
        else:
            return
        if (result.session, stamp_ns) == self._reference:
            return
        self._reference = (result.session, stamp_ns)
        points = transform(base.mount.T_base_sensor @ T_odom_sensor, features.surface.points)
        self._keyframe_points.publish(
            ros(encode_points(points, stamp_ns=stamp_ns, frame_id=self._odom_frame))
        )


def matches_picture(result: FrameResult, compared: Comparison) -> Picture:
    """Both images side by side, the keyframe left; a blank one where there is none, no lines while lost."""
    image, outcome = compared.frame.image, result.outcome
    if compared.keyframe is None or not isinstance(outcome, Registration):
        left = np.full_like(image, 255) if compared.keyframe is None else compared.keyframe.frame.image
        return draw_matches(left, image, np.empty((0, 2)), np.empty((0, 2)))
    pixels = outcome.visual_inliers_px
    return draw_matches(compared.keyframe.frame.image, image, pixels[:, :2], pixels[:, 2:])
