# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Known motions in closed form: what every estimate of a rendered sequence is compared with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.worlds.poses import Pose, flat, look_at
from vigg_ros.registration import ConfigError


def stamps_ns(count: int, rate_hz: float, start_ns: int) -> NDArray[np.int64]:
    """Stamps (count,) of a steady sensor, integer nanoseconds, without the drift of summed floats."""
    since_start_ns: NDArray[np.int64] = np.rint(np.arange(count) * (1e9 / rate_hz)).astype(np.int64)
    return start_ns + since_start_ns


@dataclass(frozen=True, slots=True)
class HandheldLoop:
    """A hand carries a camera around a loop, looking at a target that wanders, and ends where it began.

    Both eye and target go once around an ellipse in period_s; a tremor of a few millimetres, with
    periods that divide period_s, rides on the eye.
    """

    eye: tuple[float, float, float] = (-0.75, -0.3, 1.35)
    eye_swing_m: tuple[float, float, float] = (0.3, 0.38, 0.1)
    target: tuple[float, float, float] = (1.5, 0.1, 0.8)
    target_swing_m: tuple[float, float, float] = (0.0, 0.6, 0.2)
    roll_swing_deg: float = 4.0
    tremor_m: float = 0.002
    period_s: float = 5.0

    def T_world_camera(self, time_s: float) -> Pose:
        """The camera's optical frame in the world at a time; periodic in period_s."""
        phase = 2 * math.pi * time_s / self.period_s
        swing = (math.cos(phase), math.sin(phase), math.sin(2 * phase))
        look = (math.cos(phase), math.sin(phase + 2.6), math.cos(phase + 1))
        tremor = (math.sin(13 * phase), math.sin(17 * phase + 1), math.sin(11 * phase + 2))
        eye = np.asarray(self.eye) + np.multiply(self.eye_swing_m, swing) + self.tremor_m * np.asarray(tremor)
        target = np.asarray(self.target) + np.multiply(self.target_swing_m, look)
        return look_at(eye, target, self.roll_swing_deg * math.sin(phase + 2))


@dataclass(frozen=True, slots=True)
class Leg:
    """A piece of a drive: length_m along the road, turning evenly by turn_deg, left positive."""

    length_m: float
    turn_deg: float = 0.0

    def T_start_here(self, along_m: float) -> Pose:
        """The pose after along_m of this leg, in the frame where the leg starts (x forward, z up)."""
        turn = math.radians(self.turn_deg) * along_m / self.length_m
        if abs(turn) < 1e-9:
            return flat((along_m, 0, 0))
        radius_m = along_m / turn
        return flat((radius_m * math.sin(turn), radius_m * (1 - math.cos(turn)), 0), math.degrees(turn))


@dataclass(frozen=True, slots=True)
class Drive:
    """A vehicle at a steady speed along straight and circular legs, and straight on beyond the last one."""

    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    start_yaw_deg: float = 0.0
    speed_mps: float = 4.0
    legs: Sequence[Leg] = (Leg(4), Leg(9, 80), Leg(20))

    def __post_init__(self) -> None:
        if self.speed_mps <= 0 or not self.legs or min(leg.length_m for leg in self.legs) <= 0:
            raise ConfigError(f"found {self}; expected speed and lengths above 0; correct it")

    def T_world_vehicle(self, time_s: float) -> Pose:
        """The vehicle (x forward, y left, z up) on the ground at a time; before 0 it comes straight."""
        left_m = self.speed_mps * time_s
        T_world_leg = flat(self.start, self.start_yaw_deg)
        for leg in self.legs:
            if left_m <= leg.length_m:
                return T_world_leg @ (leg.T_start_here(left_m) if left_m > 0 else flat((left_m, 0, 0)))
            T_world_leg = T_world_leg @ leg.T_start_here(leg.length_m)
            left_m -= leg.length_m
        return T_world_leg @ flat((left_m, 0, 0))
