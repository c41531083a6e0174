# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""ATE and RPE of two trajectories whose poses are associated by their stamps, and what the figures cover."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from vigg_ros.registration import DataError
from vigg_ros.report.trajectory import Trajectory, align
from vigg_ros.report.trajectory_errors import Spread, absolute_errors, relative_errors
from vigg_ros.sensors.header import NS_PER_S
from vigg_ros.tracking.pairing import assign

STEADY_GAPS = 3.0
"""A pause longer than this many median steps of the estimate counts as not covered."""

MIN_COMPARED = 3
"""Fewer positions can be laid onto any others."""


@dataclass(frozen=True, slots=True)
class TrajectoryComparison:
    """The errors of an estimate, and how much of the reference they are about."""

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
        return {**asdict(self), **spreads}


def compare_trajectories(
    estimate: Trajectory, reference: Trajectory, *, slop_s: float, delta_frames: int
) -> TrajectoryComparison:
    """ATE after alignment, and RPE over so many frames, of the mutually nearest poses within the slop.

    Raises DataError when too few poses can be compared: MIN_COMPARED, and one more than RPE spans.
    """
    stamps_ns = estimate.stamps_ns.tolist(), reference.stamps_ns.tolist()
    partners = assign(*stamps_ns, round(slop_s * NS_PER_S))
    paired = [(row, partner) for row, partner in enumerate(partners) if partner is not None]
    rows = np.array(paired, np.int64).reshape(-1, 2)
    at_least = max(MIN_COMPARED, delta_frames + 1)
    if len(rows) < at_least:
        raise DataError(
            "TRAJECTORY_OVERLAP",
            found=f"{len(rows)} poses whose stamps are within {slop_s:g} s of the reference's",
            expected=f"at least {at_least}",
            remedy="give trajectories of the same recording, a larger --slop or a smaller --delta",
        )
    compared = estimate.select(rows[:, 0])
    truth = Trajectory(compared.stamps_ns, reference.T_world_sensor[rows[:, 1]])
    alignment = align(truth, compared)
    first = np.arange(len(rows) - delta_frames)
    relative = relative_errors(truth, compared, np.column_stack((first, first + delta_frames)))
    return TrajectoryComparison(
        poses=len(estimate),
        compared=len(compared),
        covered=covered_share(estimate, reference),
        alignment=alignment.words,
        ate_m=Spread.of(absolute_errors(truth, compared, alignment).translation_m),
        rpe_m=Spread.of(relative.translation_m),
        rpe_deg=Spread.of(relative.rotation_deg),
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
