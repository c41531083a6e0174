# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Velocity and mounts, against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from vigg_ros.registration.errors import DataError
from vigg_ros.registration.rigid import inverse
from vigg_ros.tracking.chain import KeyframePose, UncertainPose, se3_log, twist_between
from vigg_ros.tracking.sensor_mount import MAX_MOUNTS, MountFinder, SensorMount, waiting_lookup

small = st.floats(-1.5, 1.5)
vectors = st.tuples(small, small, small).map(np.array)


def motion(linear, angular):
    """What a constant twist does in one second, by the matrix exponential."""
    generator = np.zeros((4, 4))
    generator[:3, :3] = [[0, -angular[2], angular[1]], [angular[2], 0, -angular[0]], [-angular[1], angular[0], 0]]
    generator[:3, 3] = linear
    return np.asarray(expm(generator))


def pose(T, sigma=0.01):
    return UncertainPose(T, sigma**2 * np.eye(6))


@given(vectors, vectors)
def test_the_logarithm_undoes_the_exponential(linear, angular):
    np.testing.assert_allclose(se3_log(motion(linear, angular)), np.concatenate((linear, angular)), atol=1e-9)


@given(vectors, vectors)
def test_a_constant_velocity_is_found_from_two_poses(linear, angular):
    start = motion(np.array([1.0, 2, 3]), np.array([0.3, -0.2, 0.5]))
    before = KeyframePose(10**9, 0, 5, pose(start))
    now = KeyframePose(10**9 + 10**8, 0, 5, pose(start @ motion(0.1 * linear, 0.1 * angular)))
    twist = twist_between(before, now)
    np.testing.assert_allclose(twist.velocity, np.concatenate((linear, angular)), atol=1e-8)
    # Two independent errors of 1 cm (0.01 rad) over 0.1 s: a variance of 2 * 0.01^2 / 0.1^2 in every direction.
    np.testing.assert_allclose(twist.covariance, 0.02 * np.eye(6), atol=1e-12)


def test_after_a_new_keyframe_the_velocity_is_that_from_the_keyframe():
    before = KeyframePose(10**9, 0, 5, pose(motion(np.ones(3), np.zeros(3))))
    now = KeyframePose(2 * 10**9, 0, 10**9, pose(motion(np.array([0.5, 0, 0]), np.zeros(3))))
    twist = twist_between(before, now)
    np.testing.assert_allclose(twist.velocity, [0.5, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(twist.covariance, 1e-4 * np.eye(6))


@pytest.mark.parametrize(
    ("before", "why"),
    [
        (None, "nothing before"),
        (KeyframePose(10**9, 1, 5, UncertainPose.identity()), "another session"),
        (KeyframePose(10**9 - 10**9, 0, 5, UncertainPose.identity()), "two seconds ago"),
        (KeyframePose(2 * 10**9, 0, 5, UncertainPose.identity()), "the same stamp"),
        (KeyframePose(19 * 10**8, 0, 7, UncertainPose.identity()), "another keyframe, as after a relocalisation"),
    ],
)
def test_a_velocity_is_not_made_up(before, why):
    assert twist_between(before, KeyframePose(2 * 10**9, 0, 5, UncertainPose.identity())) is None, why


@given(vectors, vectors, vectors, vectors)
def test_the_pose_of_the_base_is_that_of_a_rigid_body(place, turn, linear, angular):
    T_base_sensor, T_world_start = motion(place, turn), motion(linear[::-1], angular[::-1])
    T_world_base = T_world_start @ motion(linear, angular)
    T_start_sensor = inverse(T_world_start @ T_base_sensor) @ T_world_base @ T_base_sensor
    carried = SensorMount(T_base_sensor).to_base(pose(T_start_sensor))
    np.testing.assert_allclose(carried.T_parent_child, inverse(T_world_start) @ T_world_base, atol=1e-9)


def test_an_uncertain_angle_of_the_sensor_moves_a_base_that_is_far_from_it():
    T_base_sensor = np.eye(4)
    T_base_sensor[0, 3] = 2.0  # the sensor stands 2 m ahead of the base
    covariance = np.zeros((6, 6))
    covariance[5, 5] = 0.01**2  # yaw alone
    carried = SensorMount(T_base_sensor).to_base(UncertainPose(np.eye(4), covariance))
    # Turning by dr about the sensor moves the base sideways by 2 m * dr.
    assert carried.covariance[1, 1] == pytest.approx((2 * 0.01) ** 2)
    assert carried.covariance[5, 5] == pytest.approx(0.01**2)


def test_the_mount_is_looked_up_once_for_each_sensor():
    asked = []
    T_base_sensor = motion(np.array([1.0, 0, 0]), np.zeros(3))

    def lookup(target, source):
        asked.append((target, source))
        return T_base_sensor if source.startswith("camera") else None

    finder = MountFinder("base_link", lookup)
    assert finder("camera").T_base_sensor is T_base_sensor
    finder("camera")
    assert asked == [("base_link", "camera")]
    for number in range(10 * MAX_MOUNTS):
        finder(f"camera {number}")
    finder("camera")
    assert [source for _, source in asked].count("camera") == 2, "the latest are remembered, and no more"
    np.testing.assert_array_equal(finder("base_link").T_base_sensor, np.eye(4))
    with pytest.raises(DataError, match="no transform from 'lidar' to base_frame 'base_link'") as refusal:
        finder("lidar")
    assert refusal.value.code == "NO_TF"
    np.testing.assert_array_equal(MountFinder("", lookup)("lidar").T_base_sensor, np.eye(4))


def test_a_lookup_waits_for_a_link_that_comes_late():
    answers = iter([None, None, np.eye(4)])
    waits = []
    found = waiting_lookup(lambda target, source: next(answers), 10.0, waits.append)("a", "b")
    assert found is not None
    assert len(waits) == 2
    assert waiting_lookup(lambda target, source: None, 0.0)("a", "b") is None


def test_rotations_of_half_a_turn_have_a_logarithm():
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec([np.pi, 0, 0]).as_matrix()
    np.testing.assert_allclose(np.abs(se3_log(T)), [0, 0, 0, np.pi, 0, 0], atol=1e-9)
