# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""ATE and RPE of trajectories by evo, with what they cover. evo is imported only here."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from typing import Any

import numpy as np

from vigg_ros.registration.errors import ConfigError, DataError
from vigg_ros.report.trajectory import Trajectory
from vigg_ros.report.trajectory_errors import SECOND_NS, Spread

BY_POSITIONS = "SE(3) alignment of the positions (Umeyama, without scale)"
BY_FIRST_POSE = "alignment of the first poses (the positions lie on a line, which leaves a rotation free)"

STEADY_GAPS = 3.0
"""A pause longer than this many median steps of the estimate counts as not covered."""


@dataclass(frozen=True, slots=True)
class TrajectoryErrors:
    """What evo finds, and how much of the reference it is about."""

    poses: int
    """Of the estimate."""
    compared: int
    """Poses with a partner in the reference, by stamp."""
    covered: float
    """Share of the reference's time during which there were estimates, in [0, 1]."""
    alignment: str
    ate_m: Spread
    """Absolute errors of the positions, after the alignment."""
    rpe_m: Spread
    """Errors of the motion over ``rpe_over``."""
    rpe_deg: Spread
    rpe_over: str

    def as_dict(self) -> dict[str, Any]:
        """For a JSON file."""
        spreads = {name: getattr(self, name).as_dict() for name in ("ate_m", "rpe_m", "rpe_deg")}
        plain = ("poses", "compared", "covered", "alignment", "rpe_over")
        return {**{name: getattr(self, name) for name in plain}, **spreads}


def require_evo() -> None:
    """Raise ConfigError when evo is not installed."""
    if importlib.util.find_spec("evo") is None:
        raise ConfigError("this needs the library evo; install it with: pip install 'vigg_ros[evaluation]'")


def compare(estimate: Trajectory, reference: Trajectory, *, slop_s: float, delta_frames: int) -> TrajectoryErrors:
    """ATE after alignment, and RPE over so many frames, of poses whose stamps lie within the slop.

    Raises DataError when too few poses can be compared: three are needed to align, one more than RPE spans.
    """
    require_evo()
    from evo.core import metrics

    reference_part, estimate_part = _associated(estimate, reference, slop_s, at_least=max(3, delta_frames + 1))
    rpe_pair = (reference_part, estimate_part)
    unit = metrics.Unit.frames
    rpe_m = metrics.RPE(metrics.PoseRelation.translation_part, delta=delta_frames, delta_unit=unit, all_pairs=True)
    rpe_deg = metrics.RPE(metrics.PoseRelation.rotation_angle_deg, delta=delta_frames, delta_unit=unit, all_pairs=True)
    rpe_m.process_data(rpe_pair)
    rpe_deg.process_data(rpe_pair)
    alignment = _align(estimate_part, reference_part)
    ate = metrics.APE(metrics.PoseRelation.translation_part)
    ate.process_data((reference_part, estimate_part))
    return TrajectoryErrors(
        poses=len(estimate),
        compared=estimate_part.num_poses,
        covered=covered_share(estimate, reference),
        alignment=alignment,
        ate_m=Spread.of(np.asarray(ate.error)),
        rpe_m=Spread.of(np.asarray(rpe_m.error)),
        rpe_deg=Spread.of(np.asarray(rpe_deg.error)),
        rpe_over=f"{delta_frames} frame" + ("s" if delta_frames > 1 else ""),
    )


def covered_share(estimate: Trajectory, reference: Trajectory) -> float:
    """The share of the reference's time span in which the estimate's poses follow each other steadily."""
    if len(estimate) < 2 or len(reference) < 2:
        return 0.0
    begin, end = int(reference.stamps_ns[0]), int(reference.stamps_ns[-1])
    steps = np.diff(estimate.stamps_ns)
    steady = steps <= STEADY_GAPS * np.median(steps)
    inside = np.minimum(estimate.stamps_ns[1:], end) - np.maximum(estimate.stamps_ns[:-1], begin)
    return float(np.maximum(inside, 0)[steady].sum() / (end - begin))


def _as_evo(trajectory: Trajectory, start_ns: int) -> Any:
    """evo takes stamps as float seconds: counted from the start they keep their nanoseconds."""
    from evo.core.trajectory import PoseTrajectory3D

    stamps_s = (trajectory.stamps_ns - start_ns) / SECOND_NS
    return PoseTrajectory3D(poses_se3=list(trajectory.T_world_sensor.copy()), timestamps=stamps_s)


def _associated(estimate: Trajectory, reference: Trajectory, slop_s: float, *, at_least: int) -> tuple[Any, Any]:
    """Reference and estimate as evo's, with a pose for each pose of the other. Raises DataError."""
    from evo.core import sync

    if not len(estimate) or not len(reference):
        raise _too_few(0, slop_s, at_least)
    start_ns = int(min(estimate.stamps_ns[0], reference.stamps_ns[0]))
    theirs = [_as_evo(trajectory, start_ns) for trajectory in (reference, estimate)]
    try:
        parts = sync.associate_trajectories(*theirs, max_diff=slop_s)
    except sync.SyncException as error:
        raise _too_few(0, slop_s, at_least) from error
    if parts[0].num_poses < at_least:
        raise _too_few(parts[0].num_poses, slop_s, at_least)
    return parts[0], parts[1]


def _align(estimate: Any, reference: Any) -> str:
    """Move the estimate onto the reference; in words, how."""
    from evo.core.geometry import GeometryException

    try:
        estimate.align(reference, correct_scale=False)
    except GeometryException:
        estimate.align_origin(reference)
        return BY_FIRST_POSE
    return BY_POSITIONS


def _too_few(found: int, slop_s: float, at_least: int) -> DataError:
    return DataError(
        "TRAJECTORY_OVERLAP",
        found=f"{found} poses whose stamps are within {slop_s:g} s of the reference's",
        expected=f"at least {at_least}",
        remedy="give trajectories of the same recording, a larger --slop or a smaller --delta",
    )
