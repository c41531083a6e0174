# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An image and a depth of different moments make an answer less sure, along the velocity."""

from dataclasses import replace

import numpy as np
import pytest

from vigg_ros.bench.worlds import HandheldLoop
from vigg_ros.bench.worlds.poses import Pose
from vigg_ros.registration import Config, Frame
from vigg_ros.tracking import FrameResult, Registrar, State
from vigg_ros.tracking.stamp_error import displacement, stamp_covariance
from vigg_ros_testing.registration_samples import Studio, error_vector, looking, motion

T_TARGET_SOURCE = motion((10, -25, 40), (0.3, -0.2, 0.5))
VELOCITY = np.array((0.4, -0.1, 0.2, 0.3, 1.2, -0.5))
NONE = np.zeros(6)


def after(seconds: float) -> Pose:
    """How a frame at that velocity has moved, in its own axes."""
    return motion(np.rad2deg(VELOCITY[3:] * seconds), VELOCITY[:3] * seconds)


@pytest.fixture
def frame(studio: Studio) -> Frame:
    return studio.frame(looking())


def test_the_moment_lies_evenly_between_image_and_depth(frame: Frame) -> None:
    """The deviation of an even distribution of width w is w / sqrt(12), of its distance from one end w / sqrt(3)."""
    rng = np.random.default_rng(0)
    found = displacement(replace(frame, apart_s=0.012), VELOCITY)
    drawn = rng.uniform(0, 0.012, (100_000, 1)) * VELOCITY
    np.testing.assert_allclose(np.abs(found), np.sqrt(np.mean(drawn**2, axis=0)), rtol=0.01)


def test_what_is_of_one_moment_or_of_unknown_velocity_adds_nothing(frame: Frame) -> None:
    assert not displacement(frame, VELOCITY).any()
    assert not displacement(replace(frame, apart_s=0.012), None).any()
    assert not stamp_covariance(T_TARGET_SOURCE, NONE, NONE).any()


@pytest.mark.parametrize("moves", ["target", "source"])
def test_the_covariance_is_that_of_a_motion_along_the_velocity(moves: str) -> None:
    """Either frame moved on by a moment, and what that adds to the motion between them."""
    seconds = 1e-6
    T_moved = T_TARGET_SOURCE @ after(seconds) if moves == "source" else np.linalg.inv(after(seconds)) @ T_TARGET_SOURCE
    added = error_vector(T_moved, T_TARGET_SOURCE) / seconds
    of_target, of_source = (VELOCITY, NONE) if moves == "target" else (NONE, VELOCITY)
    found = stamp_covariance(T_TARGET_SOURCE, of_target, of_source)
    np.testing.assert_allclose(found, np.outer(added, added), atol=1e-4)


def test_two_frames_err_independently() -> None:
    both = stamp_covariance(T_TARGET_SOURCE, VELOCITY, VELOCITY)
    alone = stamp_covariance(T_TARGET_SOURCE, VELOCITY, NONE) + stamp_covariance(T_TARGET_SOURCE, NONE, VELOCITY)
    np.testing.assert_allclose(both, alone)


def walk(studio: Studio, apart_s: float) -> list[FrameResult]:
    path, registrar = HandheldLoop(), Registrar(Config())
    frames = [studio.frame(path.T_world_camera(0.2 * k), 100 + k) for k in range(4)]
    return [registrar.step(replace(f, stamp_ns=k * 200_000_000, apart_s=apart_s)) for k, f in enumerate(frames)]


def test_a_camera_whose_depth_comes_later_is_less_sure_along_its_way(studio: Studio) -> None:
    together, apart = walk(studio, 0.0), walk(studio, 0.015)
    assert [result.state for result in apart] == [State.STARTED, *[State.TRACKING] * 3]
    for k in range(1, 4):
        np.testing.assert_array_equal(apart[k].T_odom_frame, together[k].T_odom_frame)
        added = apart[k].covariance - together[k].covariance
        assert np.linalg.eigvalsh(added).min() > -1e-12
        moved = np.linalg.inv(together[k - 1].T_odom_frame) @ together[k].T_odom_frame
        # 15 of 200 ms of the step, by the width of an even distribution.
        expected_m = np.linalg.norm(moved[:3, 3]) * 0.015 / 0.2 / np.sqrt(3)
        assert np.sqrt(np.trace(added[:3, :3])) > 0.9 * expected_m
        if k == 1:  # the reference is the first frame, of whose velocity nothing is known
            assert np.sqrt(np.trace(added[:3, :3])) == pytest.approx(expected_m, rel=0.1)
