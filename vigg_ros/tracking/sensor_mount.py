# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From the sensor, which is registered, to the base, whose pose is published."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import DataError
from vigg_ros.registration.result import Registration
from vigg_ros.registration.rigid import inverse
from vigg_ros.tracking.chain import KeyframePose, UncertainPose
from vigg_ros.tracking.extrinsics import Lookup
from vigg_ros.tracking.frame_result import FrameResult

POLL_PERIOD_S = 0.01

MAX_MOUNTS = 16
"""So many are remembered: a driver that counts in its frame names must not fill the memory."""


@dataclass(frozen=True, slots=True)
class SensorMount:
    """Where the sensor stands on the base: p_base = T_base_sensor @ p_sensor."""

    T_base_sensor: NDArray[np.float64]

    def to_base(self, pose: UncertainPose) -> UncertainPose:
        """A motion of the sensor as the motion of the base.

        T_odom_base = T_base_sensor T_start_sensor T_sensor_base: the odometry frame is where the base stood at
        the first frame, not where the sensor did; so its z axis points up if the base's did. The mount is taken
        as exact.
        """
        at_base = UncertainPose(self.T_base_sensor, np.zeros((6, 6))).compose(pose)
        return at_base.compose(UncertainPose(inverse(self.T_base_sensor), np.zeros((6, 6))))


@dataclass(frozen=True, slots=True)
class BaseResult:
    """A result of the sensor, and what it says of the base."""

    result: FrameResult
    mount: SensorMount

    @property
    def pose(self) -> UncertainPose | None:
        """The base in the odometry frame; None without a pose."""
        T_odom_frame, covariance = self.result.T_odom_frame, self.result.covariance
        if T_odom_frame is None or covariance is None:
            return None
        return self.mount.to_base(UncertainPose(T_odom_frame, covariance))

    @property
    def pose_in_keyframe(self) -> KeyframePose:
        """The base in its keyframe, or as the keyframe that it is."""
        result, relative = self.result, UncertainPose.identity()
        if isinstance(result.outcome, Registration):
            relative = UncertainPose(result.outcome.T_target_source, result.outcome.covariance)
        keyframe_ns = result.stamp_ns if result.keyframe_stamp_ns is None else result.keyframe_stamp_ns
        return KeyframePose(result.stamp_ns, result.session, keyframe_ns, self.mount.to_base(relative))


def waiting_lookup(lookup: Lookup, timeout_s: float, wait: Callable[[float], object] = time.sleep) -> Lookup:
    """A lookup that asks again until the timeout; for the worker's thread, which may wait, never for a callback."""

    def look(target: str, source: str) -> NDArray[np.float64] | None:
        deadline_s = time.monotonic() + timeout_s
        while (found := lookup(target, source)) is None and time.monotonic() < deadline_s:
            wait(POLL_PERIOD_S)
        return found

    return look


class MountFinder:
    """Looks up where each sensor stands on the base, once for each of the latest MAX_MOUNTS frame names."""

    def __init__(self, base_frame: str, lookup: Lookup) -> None:
        self._base_frame = base_frame
        self._lookup = lookup
        self._found: dict[str, SensorMount] = {}

    def __call__(self, frame_id: str) -> SensorMount:
        """The mount of the sensor with this frame. Raises DataError while TF does not know it."""
        if not self._base_frame or frame_id == self._base_frame:
            return SensorMount(np.eye(4))
        if frame_id not in self._found:
            self._found[frame_id] = SensorMount(self._look_up(frame_id))
            if len(self._found) > MAX_MOUNTS:
                del self._found[next(iter(self._found))]
        return self._found[frame_id]

    def _look_up(self, frame_id: str) -> NDArray[np.float64]:
        T_base_sensor = self._lookup(self._base_frame, frame_id)
        if T_base_sensor is None:
            raise DataError(
                "NO_TF", found=f"no transform from {frame_id!r} to base_frame {self._base_frame!r}",
                expected="a chain of transforms between sensor and base",
                remedy="publish it on /tf_static, or leave base_frame empty for the pose of the sensor",
            )
        return T_base_sensor
