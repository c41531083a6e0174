# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scans that were taken on the move, straightened."""

from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from vigg_ros.bench.worlds import Drive, Leg, LidarModel, Light, Scene, render_lidar
from vigg_ros.bench.worlds.poses import flat, upright
from vigg_ros.bench.worlds.surfaces import Rectangle
from vigg_ros.bench.worlds.texture import Texture
from vigg_ros.registration import Frame
from vigg_ros.registration.rigid import transform
from vigg_ros.tracking.deskew import deskew, mean_skew_m, velocity
from vigg_ros.tracking.registrar import Registrar, State
from vigg_ros_testing.street_samples import CAMERA, CONFIG, T_CAMERA_LIDAR, along, errors, lidar_motion, moving_frame

LIDAR = LidarModel(beams=16, columns=360, range_sigma_m=0.02)
T_WORLD_STAMP = flat((1.0, -0.5, 0.5), 20.0)
VELOCITY = np.array([8.0, -0.5, 0.2, 0.05, -0.1, 0.9])
"""A fast turn on a bumpy road: m/s and rad/s."""


def hall():
    """Walls at x = +-10 and y = +-6, 20 m high: every beam meets one."""
    plain = Texture.of(np.full((16, 16, 3), 128, dtype=np.uint8), texel_m=1.0)
    walls = (((10, 0, 0), 180, 12), ((-10, 0, 0), 0, 12), ((0, 6, 0), 270, 20), ((0, -6, 0), 90, 20))
    surfaces = [Rectangle(upright(at, facing), (wide, 20), plain) for at, facing, wide in walls]
    return Scene(tuple(surfaces), Light((0.0, 0.0, 1e9)))


def constant_velocity(time_s):
    """T_world_lidar with a velocity that is constant in the frame of the stamp."""
    T_stamp_time = np.eye(4)
    T_stamp_time[:3, :3] = Rotation.from_rotvec(VELOCITY[3:] * time_s).as_matrix()
    T_stamp_time[:3, 3] = VELOCITY[:3] * time_s
    return T_WORLD_STAMP @ T_stamp_time


def scan_along(motion, rng=None):
    points, times_s = render_lidar(hall(), motion, LIDAR, rng=rng)
    image = np.zeros((CAMERA.height_px, CAMERA.width_px), np.uint8)
    return Frame.from_points(image, points, CAMERA, T_CAMERA_LIDAR, stamp_ns=5, times_s=times_s)


def off_the_walls_m(frame):
    points = transform(T_WORLD_STAMP, frame.points())
    return np.maximum(np.abs(points[:, 0]) - 10, np.abs(points[:, 1]) - 6)


def test_a_deskewed_scan_is_the_rigid_one_at_the_stamp():
    frame = scan_along(constant_velocity)
    # The sensor moves 0.4 m and turns 2.6 deg from the stamp to the ends of the scan.
    assert np.abs(off_the_walls_m(frame)).max() > 0.4
    straight = deskew(frame, VELOCITY)
    # Float32 metres of up to 20 m, before and after.
    np.testing.assert_allclose(off_the_walls_m(straight), 0, atol=5e-6)
    assert (straight.stamp_ns, straight.image is frame.image) == (5, True)


def test_deskewing_leaves_the_range_noise_as_it_is():
    straight = deskew(scan_along(constant_velocity, np.random.default_rng(4)), VELOCITY)
    # Along the ray 2 cm; across a wall its cosine less, which is 0.83 in the mean square here.
    assert 0.75 * 0.02 < off_the_walls_m(straight).std() < 0.02


def test_a_sensor_at_rest_or_of_unknown_velocity_keeps_its_points():
    frame = scan_along(constant_velocity)
    assert deskew(frame, None) is frame
    np.testing.assert_array_equal(deskew(frame, np.zeros(6)).points(), frame.points())


def test_points_without_times_are_left_alone():
    straight = deskew(scan_along(constant_velocity), VELOCITY)
    assert deskew(straight, VELOCITY) is straight
    assert mean_skew_m(straight, VELOCITY) == 0


def test_velocity_is_what_lies_between_two_poses_not_far_apart_in_time():
    T_then, T_now = T_WORLD_STAMP, constant_velocity(0.1)
    np.testing.assert_allclose(velocity(T_then, T_now, 100_000_000), VELOCITY, atol=1e-12)
    assert {velocity(T_then, T_now, interval_ns) for interval_ns in (0, -100_000_000, 1_000_000_001)} == {None}


def test_mean_skew_bounds_what_deskewing_moves():
    frame = scan_along(constant_velocity)
    for axis in range(6):
        one = VELOCITY * (np.arange(6) == axis)
        moved_m = float(np.linalg.norm(deskew(frame, one).points() - frame.points(), axis=1).mean())
        bound_m = mean_skew_m(frame, one)
        # A translation moves all points alike. Points near the axis of a turn move less than those beside it;
        # sideways axes lie in a hall that is 20 m long and 12 m wide: at least half.
        assert (0.5 if axis >= 3 else 0.999) * bound_m <= moved_m <= 1.001 * bound_m + 1e-7


def along_arc(time_s):
    """T_world_base at 6 m/s and two degrees a metre: 12 deg/s."""
    drive = Drive(start=(-10.0, -0.6, 0.0), speed_mps=6.0, legs=(Leg(200.0, turn_deg=400.0),))
    return drive.T_world_vehicle(time_s)


@cache
def frame_at(T_world_base, stamp_s):
    return moving_frame(T_world_base, stamp_s=stamp_s, seed=round(100 * stamp_s))


def drive_errors(stamps_s, T_world_base):
    """TE (m) and RE (deg) of each pose (N, 2) relative to the first one."""
    registrar = Registrar(CONFIG)
    found = []
    for stamp_s in stamps_s:
        estimate = registrar.step(frame_at(T_world_base, stamp_s))
        assert estimate.state is (State.TRACKING if found else State.STARTED)
        true = lidar_motion(T_world_base(stamps_s[0]), T_world_base(stamp_s))
        found.append(errors(estimate.T_odom_frame, true))
    return np.array(found)


def test_the_first_scans_are_straightened_once_the_motion_is_known():
    """Where the first scan stays as it is, the third pose is off by 1.7 cm and 0.08 deg."""
    found = drive_errors((0.5, 0.6, 0.7), along_arc)
    # Half the range noise of 2 cm, at the car and at 10 m.
    assert (found[1:, 0] < 0.01).all()
    assert (found[1:, 1] < 0.06).all()


def test_a_scan_taken_at_rest_is_not_straightened_by_a_later_motion():
    """At rest for 0.15 s, then suddenly at 6 m/s: the first scan is the reference, but not the last frame."""

    def stop_and_go(time_s):
        # Scans reach 0.05 s to either side of their stamps, so the one at 0.1 s is at rest too.
        return along(-10.0 + 6.0 * max(0.0, time_s - 0.15))

    found = drive_errors((0.0, 0.1, 0.25, 0.35), stop_and_go)
    # Half the range noise. At 0.25 s the mean velocity since the last frame is not that of the scan.
    assert (found[[1, 3], 0] < 0.01).all()


def test_deskewing_can_be_switched_off():
    registrar = Registrar(CONFIG.replace({"input.deskew": False}))
    frames = [frame_at(along_arc, stamp_s) for stamp_s in (0.5, 0.6)]
    for frame in frames:
        compared = registrar.step(frame).compared
        assert compared.frame is frame
    assert registrar.reference.frame is frames[0]
