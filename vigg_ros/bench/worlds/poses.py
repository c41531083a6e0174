# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses of things in a world: x east, y north, z up; metres, and degrees about the vertical.

A pose ``T_world_thing`` is (4, 4) float64 with p_world = T_world_thing @ p_thing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Pose = NDArray[np.float64]
Position = Sequence[float] | NDArray[np.float64]

T_BODY_OPTICAL: Pose = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)
"""REP-103: an optical frame (x right, y down, z forward) in its body (x forward, y left, z up)."""


def flat(position: Position, yaw_deg: float = 0.0) -> Pose:
    """A thing lying level: its z axis up, its x axis turned by yaw_deg from east to north."""
    cosine, sine = math.cos(math.radians(yaw_deg)), math.sin(math.radians(yaw_deg))
    return _pose((cosine, sine, 0), (-sine, cosine, 0), (0, 0, 1), position)


def upside_down(position: Position, yaw_deg: float = 0.0) -> Pose:
    """A thing lying face down, as a ceiling does: its z axis down."""
    cosine, sine = math.cos(math.radians(yaw_deg)), math.sin(math.radians(yaw_deg))
    return _pose((cosine, sine, 0), (sine, -cosine, 0), (0, 0, -1), position)


def upright(position: Position, facing_deg: float) -> Pose:
    """A picture on a wall: its y axis up, its z axis level towards facing_deg, x to its viewer's right."""
    cosine, sine = math.cos(math.radians(facing_deg)), math.sin(math.radians(facing_deg))
    return _pose((-sine, cosine, 0), (0, 0, 1), (cosine, sine, 0), position)


def look_at(eye: Position, target: Position, roll_deg: float = 0.0) -> Pose:
    """T_world_camera of an optical frame at eye that sees target in the middle of its image.

    roll_deg turns the camera clockwise about its view. The view must not be vertical.
    """
    forward = np.subtract(target, eye).astype(np.float64)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    cosine, sine = math.cos(math.radians(roll_deg)), math.sin(math.radians(roll_deg))
    return _pose(cosine * right + sine * down, cosine * down - sine * right, forward, eye)


def _pose(x_axis: Position, y_axis: Position, z_axis: Position, position: Position) -> Pose:
    T_world_thing = np.eye(4)
    T_world_thing[:3] = np.column_stack((x_axis, y_axis, z_axis, position))
    return T_world_thing
