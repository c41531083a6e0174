# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""decode(encode(x)) == x, through the real classes of rosbags and rclpy; and one reader for the messages of both."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vigg_ros.messages import diagnostic_messages
from vigg_ros.messages.diagnostic_messages import encode_diagnostic_array, encode_diagnostic_status
from vigg_ros.messages.fields import Message
from vigg_ros.messages.pose_messages import (
    encode_odometry,
    encode_path,
    encode_pose,
    encode_pose_with_covariance,
    encode_tf,
    encode_transform,
)
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image, encode_points
from vigg_ros.registration.camera import Camera
from vigg_ros.sensors.camera_info import decode_camera_info
from vigg_ros.sensors.colour_image import decode_image
from vigg_ros.sensors.depth_image import decode_depth
from vigg_ros.sensors.point_cloud import decode_points
from vigg_ros.sensors.rectification import Rectifier
from vigg_ros.sensors.stamped_pose import decode_pose, decode_transform
from vigg_ros_testing.decoder_samples import SAMPLES
from vigg_ros_testing.real_messages import through_rclpy, through_ros_1_bag, through_ros_2_bag
from vigg_ros_testing.registration_samples import motion

NS = 1_700_000_000_123_456_789
LIBRARIES = pytest.mark.parametrize("received", [through_ros_2_bag, through_rclpy])

T = motion((20.0, -70.0, 110.0), (1.0, -2.0, 3.5))
COVARIANCE = np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]) + 0.125
TWIST = np.arange(6.0)
ODOM: dict[str, Any] = {"stamp_ns": NS, "frame_id": "odom"}
CAMERA: dict[str, Any] = {"stamp_ns": NS, "frame_id": "camera"}


@LIBRARIES
@pytest.mark.parametrize(
    ("message", "decode", "child"),
    [
        (encode_pose(T, **ODOM), decode_pose, ""),
        (encode_pose_with_covariance(T, COVARIANCE, **ODOM), decode_pose, ""),
        (encode_odometry(T, COVARIANCE, TWIST, 2 * COVARIANCE, **ODOM, child_frame_id="base"), decode_pose, "base"),
        (encode_transform(T, **ODOM, child_frame_id="base"), decode_transform, "base"),
    ],
    ids=lambda value: getattr(value, "type", ""),
)
def test_poses_survive(received, message, decode, child):
    decoded = decode(received(message))
    np.testing.assert_allclose(decoded.T_frame_child, T, atol=1e-15)
    assert (decoded.stamp_ns, decoded.frame_id, decoded.child_frame_id) == (NS, "odom", child)


@LIBRARIES
def test_covariances_and_velocities_survive(received):
    msg = received(encode_odometry(T, COVARIANCE, TWIST, 2 * COVARIANCE, **ODOM, child_frame_id="base"))
    np.testing.assert_array_equal(np.reshape(msg.pose.covariance, (6, 6)), COVARIANCE)
    np.testing.assert_array_equal(np.reshape(msg.twist.covariance, (6, 6)), 2 * COVARIANCE)
    linear, angular = msg.twist.twist.linear, msg.twist.twist.angular
    assert [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z] == TWIST.tolist()
    msg = received(encode_pose_with_covariance(T, COVARIANCE, **ODOM))
    np.testing.assert_array_equal(np.reshape(msg.pose.covariance, (6, 6)), COVARIANCE)


@LIBRARIES
def test_a_path_keeps_the_stamp_of_each_pose(received):
    poses = [(NS + i, motion((0, 0, 0), (i, 0, 0))) for i in range(3)]
    msg = received(encode_path(poses, stamp_ns=NS + 2, frame_id="odom"))
    decoded = [decode_pose(pose) for pose in msg.poses]
    assert [pose.stamp_ns for pose in decoded] == [NS, NS + 1, NS + 2]
    assert [pose.T_frame_child[0, 3] for pose in decoded] == [0, 1, 2]
    assert {pose.frame_id for pose in decoded} == {"odom"}


def test_transforms_are_bundled_for_tf():
    msg = through_ros_2_bag(encode_tf([encode_transform(T, **ODOM, child_frame_id=name) for name in "ab"]))
    assert [decode_transform(one).child_frame_id for one in msg.transforms] == ["a", "b"]


@LIBRARIES
def test_diagnostics_survive(received):
    values = {"inliers": 120, "rmse_m": 0.01, "reason": "NO_DEPTH"}
    lost = encode_diagnostic_status(
        diagnostic_messages.ERROR, "registrar", "lost: no depth", values=values, hardware_id="lidar"
    )
    well = encode_diagnostic_status(diagnostic_messages.OK, "n", "m", values={})
    msg = received(encode_diagnostic_array([well, lost], stamp_ns=NS))
    assert (msg.header.stamp.sec, msg.header.stamp.nanosec) == (1_700_000_000, 123_456_789)
    (first, found) = msg.status
    assert first.level in (0, b"\0")
    assert found.level in (2, b"\2")
    assert (found.name, found.message, found.hardware_id) == ("registrar", "lost: no depth", "lidar")
    assert {pair.key: pair.value for pair in found.values} == {name: str(value) for name, value in values.items()}
    assert received(well).level in (0, b"\x00")


GREY = np.arange(12, dtype=np.uint8).reshape(3, 4)


@LIBRARIES
@pytest.mark.parametrize("pixels", [GREY, np.stack((GREY, GREY + 50, GREY + 100), axis=-1), GREY[:, ::2]])
def test_an_image_survives(received, pixels):
    decoded = decode_image(received(encode_image(pixels, **CAMERA)))
    np.testing.assert_array_equal(decoded.image, pixels)
    assert (decoded.stamp_ns, decoded.frame_id, decoded.notes) == (NS, "camera", ())


@LIBRARIES
@pytest.mark.parametrize(("dtype", "unit_m"), [("<u2", 0.001), (">u2", 0.001), ("<f4", 1.0)])
def test_depth_survives(received, dtype, unit_m):
    samples = ((GREY + 1.0) * 500 * 0.001 / unit_m).astype(dtype)
    decoded = decode_depth(received(encode_image(samples, **CAMERA)))
    np.testing.assert_allclose(decoded.depth_m, samples * unit_m, rtol=2e-7)


@LIBRARIES
def test_points_survive(received):
    points = np.random.default_rng(3).normal(size=(50, 3)).astype(np.float32)
    decoded = decode_points(received(encode_points(points, **ODOM)))
    np.testing.assert_array_equal(decoded.points, points)
    assert (decoded.stamp_ns, decoded.frame_id, decoded.notes) == (NS, "odom", ())


@LIBRARIES
def test_calibrations_survive(received):
    raw = Camera(640, 480, 500.0, 510.0, 319.5, 239.5)
    camera = Camera(640, 480, 400.0, 410.0, 300.0, 200.0)
    turn = tuple(Rotation.from_rotvec((0, 0.1, 0)).as_matrix().reshape(-1).tolist())
    rectifier = Rectifier(raw, camera, "rational_polynomial", (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8), turn)
    msg = received(encode_camera_info(camera, **CAMERA, rectifier=rectifier))
    decoded = decode_camera_info(msg, images="raw")
    assert (decoded.camera, decoded.rectifier) == (camera, rectifier)
    assert (decoded.stamp_ns, decoded.frame_id, decoded.notes) == (NS, "camera", ())
    assert decode_camera_info(msg, images="rectified").camera == camera
    plain = decode_camera_info(received(encode_camera_info(camera, **CAMERA)), images="raw")
    assert (plain.camera, plain.rectifier) == (camera, None)


@pytest.mark.hostile("Stamps: 19-digit nanoseconds kept exactly from message to file")
@LIBRARIES
@pytest.mark.parametrize("stamp_ns", [NS, 1, 999_999_999, 2**31 * 10**9 - 1])
def test_stamps_survive_to_the_nanosecond(received, stamp_ns):
    assert decode_pose(received(encode_pose(T, stamp_ns=stamp_ns, frame_id="odom"))).stamp_ns == stamp_ns


NAN_T = np.eye(4)
NAN_T[0, 3] = np.nan
NO_TRANSFORMS = [NAN_T, np.zeros((4, 4)), np.diag([1.0, 1, -1, 1]), np.eye(3), np.diag([2.0, 2, 2, 1]), np.eye(4) * 2]
NO_COVARIANCES = [np.full((6, 6), np.nan), np.eye(5), np.full((6, 6), np.inf)]
NO_IMAGES = [np.zeros((2, 2, 4), "u1"), np.zeros((2, 2), "i4"), np.zeros((0, 2), "u1"), np.zeros(4, "u1")]


@pytest.mark.parametrize(
    ("encode", "values", "options"),
    [
        *((encode_pose, np.eye(4), {**ODOM, "stamp_ns": stamp_ns}) for stamp_ns in (0, -1, 2**31 * 10**9)),
        *((encode_pose, value, ODOM) for value in NO_TRANSFORMS),
        *((encode_transform, value, {**ODOM, "child_frame_id": "base"}) for value in NO_TRANSFORMS),
        *((encode_pose_with_covariance, np.eye(4), {**ODOM, "covariance": value}) for value in NO_COVARIANCES),
        *((encode_image, value, CAMERA) for value in NO_IMAGES),
        (encode_points, np.full((2, 3), np.nan), ODOM),
    ],
)
def test_nothing_leaves_that_no_subscriber_shall_see(encode, values, options):
    with pytest.raises(ValueError, match=r"^found .*, expected"):
        encode(values, **options)


NESTED = {
    "header": "std_msgs/msg/Header",
    "stamp": "builtin_interfaces/msg/Time",
    "roi": "sensor_msgs/msg/RegionOfInterest",
    "fields": "sensor_msgs/msg/PointField",
}


def as_message(sample, type_name):
    return Message(type_name, {name: as_field(name, value) for name, value in vars(sample).items()})


def as_field(name, value):
    if isinstance(value, SimpleNamespace):
        return as_message(value, NESTED[name])
    if name == "fields":
        return tuple(as_message(item, NESTED[name]) for item in value)
    if isinstance(value, bytes):
        return np.frombuffer(value, np.uint8)
    return np.array(value, np.float64) if isinstance(value, list) else value


def assert_same(found, expected):
    assert type(found) is type(expected)
    for name in expected.__dataclass_fields__:
        one, other = getattr(found, name), getattr(expected, name)
        if isinstance(other, np.ndarray):
            np.testing.assert_array_equal(one, other)
            assert one.dtype == other.dtype
        else:
            assert one == other


@pytest.mark.parametrize("through", [through_ros_2_bag, through_ros_1_bag, through_rclpy])
@pytest.mark.parametrize("name", SAMPLES)
def test_real_classes_are_decoded_like_the_sample(name, through):
    """Copied field by field; ROS 1 too."""
    sample = SAMPLES[name]
    received = through(as_message(sample.message, f"sensor_msgs/msg/{sample.type}"))
    assert_same(sample.decode(received), sample.decode(sample.message))
