# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Results as the messages of the node's topics: live and in a result bag alike."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Generic, TypeVar

from vigg_ros.messages.fields import Message
from vigg_ros.messages.pose_messages import encode_odometry, encode_pose, encode_pose_with_covariance
from vigg_ros.registration.result import Registration
from vigg_ros.tracking.chain import KeyframePose, UncertainPose, twist_between
from vigg_ros.tracking.sensor_mount import BaseResult

MAX_PATH_POSES = 1000
"""On a path: viewers draw no finer line, and paths of all poses would grow with the square of their length."""

_Pose = TypeVar("_Pose")


class PoseMessages:
    """The poses of results; remembers the one before, from which a velocity follows."""

    def __init__(self, *, odom_frame: str, base_frame: str) -> None:
        self._odom_frame = odom_frame
        self._base_frame = base_frame
        self._last: KeyframePose | None = None

    def of(self, base: BaseResult) -> Iterator[tuple[str, Message]]:
        """Topic (below the node's name) and message; nothing without a pose."""
        pose, result = base.pose, base.result
        if pose is None:
            return
        yield "pose", encode_pose(pose.T_parent_child, stamp_ns=result.stamp_ns, frame_id=self._odom_frame)
        if isinstance(result.outcome, Registration):
            yield "relative_pose", encode_pose_with_covariance(
                result.outcome.T_target_source,
                result.outcome.covariance,
                stamp_ns=result.stamp_ns, frame_id=f"keyframe_{result.keyframe_id}",
            )
        odometry = self._odometry(base, pose)
        if odometry is not None:
            yield "odom", odometry

    def child_frame(self, base: BaseResult) -> str:
        """The frame whose pose it is."""
        return self._base_frame or base.result.frame_id

    def restart(self) -> None:
        """Forget the pose before."""
        self._last = None

    def _odometry(self, base: BaseResult, pose: UncertainPose) -> Message | None:
        """None where no velocity is known: one of 0 would be made up."""
        before, self._last = self._last, base.pose_in_keyframe
        twist = twist_between(before, self._last)
        if twist is None:
            return None
        return encode_odometry(
            pose.T_parent_child, pose.covariance, twist.velocity, twist.covariance,
            stamp_ns=base.result.stamp_ns, frame_id=self._odom_frame, child_frame_id=self.child_frame(base),
        )


class PathPoses(Generic[_Pose]):
    """The poses of a session, thinned evenly: every second one goes when there are too many."""

    def __init__(self) -> None:
        self._session: int | None = None
        self._kept: deque[_Pose] = deque()
        self._newest: _Pose | None = None
        self._every = 1
        self._seen = 0
        self._changed = False

    def add(self, pose: _Pose, session: int) -> None:
        """The next pose; one of another session begins anew."""
        if session != self._session:
            self.clear()
            self._session = session
        if self._seen % self._every == 0:
            self._kept.append(pose)
            if len(self._kept) >= MAX_PATH_POSES:
                self._kept = deque(list(self._kept)[::2])
                self._every *= 2
        self._seen += 1
        self._newest = pose
        self._changed = True

    def take(self) -> list[_Pose]:
        """All poses, if there are new ones since the last time."""
        if not self._changed or self._newest is None:
            return []
        self._changed = False
        poses = list(self._kept)
        return poses if poses and poses[-1] is self._newest else [*poses, self._newest]

    def clear(self) -> _Pose | None:
        """Forget all; the newest pose is returned, None without poses."""
        newest, self._newest = self._newest, None
        self._kept.clear()
        self._every, self._seen, self._changed = 1, 0, False
        return newest
