# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What became of a frame online: every leading message gets exactly one answer."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from vigg_ros.node.sensor_mount import Mount
from vigg_ros.node.twist import Placed
from vigg_ros.registration.result import Registration, Rejection
from vigg_ros.tracking.chain import UncertainPose
from vigg_ros.tracking.registrar import Attempt, Estimate


class Fate(str, Enum):
    """Why a frame has no estimate."""

    REFUSED = "REFUSED"
    """An input that could not be used."""
    DROPPED = "DROPPED"
    """A newer frame arrived while this one waited."""
    DISCARDED = "DISCARDED"
    """A reset came while it waited or was being registered."""
    SKIPPED = "SKIPPED"
    """It came sooner than ``max_rate`` allows."""
    PAUSED = "PAUSED"


@dataclass(frozen=True, slots=True)
class Registered:
    """An estimate, what it was made of, and where its sensor stands."""

    estimate: Estimate
    attempt: Attempt | None
    frame_id: str
    """The coordinate frame of the sensor."""
    mount: Mount

    @property
    def pose(self) -> UncertainPose | None:
        """The base in the odometry frame; None while lost."""
        T_odom_frame, covariance = self.estimate.T_odom_frame, self.estimate.covariance
        if T_odom_frame is None or covariance is None:
            return None
        return self.mount.carried(UncertainPose(T_odom_frame, covariance))

    @property
    def placed(self) -> Placed:
        """The base in its keyframe, or as the keyframe that it is."""
        estimate, relative = self.estimate, UncertainPose.identity()
        if isinstance(estimate.outcome, Registration):
            relative = UncertainPose(estimate.outcome.T_target_source, estimate.outcome.covariance)
        keyframe_ns = estimate.stamp_ns if estimate.keyframe_stamp_ns is None else estimate.keyframe_stamp_ns
        return Placed(estimate.stamp_ns, estimate.session, keyframe_ns, self.mount.carried(relative))


@dataclass(frozen=True, slots=True)
class Answer:
    """The answer to one leading message."""

    stamp_ns: int
    session: int
    state: str
    """A State of the tracker or a Fate."""
    reason: str = ""
    """Why there is no pose: a Reason of registration or the code of a refusal."""
    message: str = ""
    frame_id: str = ""
    """The coordinate frame of the sensor."""
    registered: Registered | None = None
    """None for a frame that was not given to the Registrar."""
    timings_ms: dict[str, float] = field(default_factory=dict)
    """Waiting, building and the stages of registration; ``total`` from arrival to answer."""

    @property
    def estimate(self) -> Estimate | None:
        """What the Registrar said, if it was asked."""
        return None if self.registered is None else self.registered.estimate

    @property
    def has_pose(self) -> bool:
        """Whether there is a pose to publish."""
        return self.registered is not None and self.registered.pose is not None


def of_estimate(registered: Registered, timings_ms: dict[str, float]) -> Answer:
    """The answer to a frame that was given to the Registrar."""
    estimate = registered.estimate
    rejected = estimate.outcome if isinstance(estimate.outcome, Rejection) else None
    return Answer(
        stamp_ns=estimate.stamp_ns,
        session=estimate.session,
        state=estimate.state.value,
        reason="" if rejected is None else rejected.reason.value,
        message="" if rejected is None else rejected.message,
        frame_id=registered.frame_id,
        registered=registered,
        timings_ms=timings_ms,
    )
