# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Publishers: what an answer becomes on the ROS graph."""

from __future__ import annotations

from collections import deque
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
from vigg_ros.messages.pose_messages import encode_odometry, encode_pose, encode_pose_with_covariance
from vigg_ros.messages.sensor_messages import encode_image, encode_points
from vigg_ros.node.answer import Registered
from vigg_ros.node.matches_picture import matches_picture
from vigg_ros.node.ros_classes import ros
from vigg_ros.node.twist import Placed, twist_between
from vigg_ros.registration.result import Registration
from vigg_ros.tracking.chain import UncertainPose
from vigg_ros.tracking.registrar import Attempt, Estimate

PATH_POSES = 1000
"""At most on ~/path: viewers draw no finer line."""

_RELIABLE = QoSProfile(depth=10)
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_PICTURE = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


class Outputs:
    """All publishers of the node but /tf. Stamps are those of the inputs."""

    def __init__(self, node: Node, *, odom_frame: str, base_frame: str) -> None:
        self._odom_frame = odom_frame
        self._base_frame = base_frame
        self._pose = node.create_publisher(PoseStamped, "~/pose", _RELIABLE)
        self._relative_pose = node.create_publisher(PoseWithCovarianceStamped, "~/relative_pose", _RELIABLE)
        self._odom = node.create_publisher(Odometry, "~/odom", _RELIABLE)
        self._path = node.create_publisher(Path, "~/path", _LATCHED)
        self._keyframe_points = node.create_publisher(PointCloud2, "~/keyframe_points", _LATCHED)
        self._matches = node.create_publisher(Image, "~/matches", _PICTURE)
        self._status = node.create_publisher(DiagnosticStatus, "~/status", _RELIABLE)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", _RELIABLE)
        self._poses = _Track()
        self._last: Placed | None = None
        self._reference: tuple[int, int] | None = None

    def publish_pose(self, registered: Registered, pose: UncertainPose) -> None:
        """Pose of the base, the registration itself, and odometry."""
        estimate = registered.estimate
        stamped = ros(
            encode_pose(pose.T_parent_child, stamp_ns=estimate.stamp_ns, frame_id=self._odom_frame)
        )
        self._pose.publish(stamped)
        self._poses.add(stamped, estimate.session)
        self._publish_relative(estimate)
        self._publish_odometry(registered, pose)

    def publish_views(self, registered: Registered) -> None:
        """The cloud of a new reference, and a picture of the matches where somebody looks at it."""
        estimate, attempt = registered.estimate, registered.attempt
        if attempt is None:
            return
        self._publish_reference(registered, attempt)
        if self._matches.get_subscription_count():
            picture = matches_picture(estimate, attempt)
            self._matches.publish(
                ros(encode_image(picture, stamp_ns=estimate.stamp_ns, frame_id=registered.frame_id))
            )

    def publish_status(self, status: Message) -> None:
        """A line of ~/status."""
        self._status.publish(ros(status))

    def publish_diagnostics(self, statuses: list[Message], *, stamp_ns: int) -> None:
        """A message on /diagnostics."""
        self._diagnostics.publish(ros(encode_diagnostic_array(statuses, stamp_ns=stamp_ns)))

    def publish_path(self) -> None:
        """The path so far, if it has grown."""
        poses = self._poses.take()
        if poses:
            self._path.publish(Path(header=poses[-1].header, poses=poses))

    def forget(self) -> None:
        """Begin a new path, and show that the old one and its keyframe hold no more; a reset asks for it."""
        if self._reference is not None:
            nothing = encode_points(np.empty((0, 3)), stamp_ns=self._reference[1], frame_id=self._odom_frame)
            self._keyframe_points.publish(ros(nothing))
        self._last = self._reference = None
        header = self._poses.clear()
        if header is not None:
            self._path.publish(Path(header=header))

    def child_frame(self, registered: Registered) -> str:
        """The frame whose pose is published."""
        return self._base_frame or registered.frame_id

    def _publish_relative(self, estimate: Estimate) -> None:
        outcome = estimate.outcome
        if not isinstance(outcome, Registration):
            return
        message = encode_pose_with_covariance(
            outcome.T_target_source,
            outcome.covariance,
            stamp_ns=estimate.stamp_ns,
            frame_id=f"keyframe_{estimate.keyframe_id}",
        )
        self._relative_pose.publish(ros(message))

    def _publish_odometry(self, registered: Registered, pose: UncertainPose) -> None:
        now = registered.placed
        twist = twist_between(self._last, now)
        self._last = now
        if twist is None:
            return  # a velocity of 0 would be made up
        message = encode_odometry(
            pose.T_parent_child,
            pose.covariance,
            twist.velocity,
            twist.covariance,
            stamp_ns=now.stamp_ns,
            frame_id=self._odom_frame,
            child_frame_id=self.child_frame(registered),
        )
        self._odom.publish(ros(message))

    def _publish_reference(self, registered: Registered, attempt: Attempt) -> None:
        """The cloud of the keyframe in the odometry frame, once for each reference."""
        estimate = registered.estimate
        if estimate.new_keyframe and estimate.T_odom_frame is not None:
            stamp_ns, features, T_odom_sensor = estimate.stamp_ns, attempt.features, estimate.T_odom_frame
        elif attempt.keyframe is not None:
            keyframe = attempt.keyframe
            stamp_ns, features, T_odom_sensor = (
                keyframe.frame.stamp_ns, keyframe.features, keyframe.pose.T_parent_child,
            )  # fmt: skip
        else:
            return
        if (estimate.session, stamp_ns) == self._reference:
            return
        self._reference = (estimate.session, stamp_ns)
        T_odom_points = registered.mount.T_base_sensor @ T_odom_sensor
        points = features.surface.points @ T_odom_points[:3, :3].T + T_odom_points[:3, 3]
        cloud = encode_points(points, stamp_ns=stamp_ns, frame_id=self._odom_frame)
        self._keyframe_points.publish(ros(cloud))


class _Track:
    """The poses of a session as messages, thinned evenly: every second one goes when there are too many."""

    def __init__(self) -> None:
        self._session: int | None = None
        self._kept: deque[Any] = deque()
        self._newest: Any = None
        self._every = 1
        self._seen = 0
        self._changed = False

    def add(self, stamped: Any, session: int) -> None:
        if session != self._session:
            self.clear()
            self._session = session
        if self._seen % self._every == 0:
            self._kept.append(stamped)
            if len(self._kept) >= PATH_POSES:
                self._kept = deque(list(self._kept)[::2])
                self._every *= 2
        self._seen += 1
        self._newest = stamped
        self._changed = True

    def take(self) -> list[Any]:
        """All poses, if there are new ones since the last time."""
        if not self._changed:
            return []
        self._changed = False
        poses = list(self._kept)
        return poses if poses and poses[-1] is self._newest else [*poses, self._newest]

    def clear(self) -> Any:
        """Forget all; the header of the newest pose is returned, None without poses."""
        newest, self._newest = self._newest, None
        self._kept.clear()
        self._every, self._seen, self._changed = 1, 0, False
        return None if newest is None else newest.header

