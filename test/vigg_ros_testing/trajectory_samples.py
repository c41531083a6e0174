# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses and paths whose errors can be worked out by hand."""

import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vigg_ros.report.trajectory import Trajectory

SECOND = 1_000_000_000


def pose(x=0.0, y=0.0, z=0.0, *, yaw_deg=0.0):
    """A pose (4, 4) at x, y, z, turned about z."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("z", yaw_deg, degrees=True).as_matrix()
    T[:3, 3] = x, y, z
    return T


def path(poses, *, rate_hz=10, start_ns=SECOND):
    """Poses as a trajectory at a constant rate."""
    stamps_ns = [start_ns + i * SECOND // rate_hz for i in range(len(poses))]
    return Trajectory.of(stamps_ns, poses)


def winding(count, seed=0):
    """A path that bends and turns in all directions, a few centimetres and degrees a step."""
    rng = np.random.default_rng(seed)
    poses = [np.eye(4)]
    for _ in range(count - 1):
        step = np.eye(4)
        step[:3, :3] = Rotation.from_rotvec(rng.normal(0, 0.05, 3)).as_matrix()
        step[:3, 3] = rng.normal(0, 0.05, 3)
        poses.append(poses[-1] @ step)
    return poses


@st.composite
def motions(draw):
    """Rigid motions (4, 4): any rotation, up to 100 m."""
    number = st.floats(-1, 1, allow_subnormal=False)
    quaternion = draw(st.tuples(number, number, number, number).filter(lambda q: np.linalg.norm(q) > 0.1))
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
    T[:3, 3] = [100 * draw(number) for _ in range(3)]
    return T
