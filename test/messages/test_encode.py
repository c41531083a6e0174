# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""decode(encode(x)) == x, through the real classes of rosbags and rclpy where a message needs them."""

from __future__ import annotations

import importlib

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from vigg_ros.messages.diagnostic_messages import ERROR, OK, encode_diagnostic_array, encode_diagnostic_status
from vigg_ros.messages.fields import RCLPY, ROSBAGS, Message, build
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

NS = 1_700_000_000_123_456_789
STORE = get_typestore(Stores.ROS2_JAZZY)


def rosbags_message(message: Message):
    """Through CDR, as it would come out of a bag."""
    made = build(message, STORE.types.__getitem__, ROSBAGS)
    return STORE.deserialize_cdr(STORE.serialize_cdr(made, message.type), message.type)


def rclpy_message(message: Message):
    """Through the middleware's serialisation, with every field's type checked."""
    serialization = pytest.importorskip("rclpy.serialization", reason="rclpy is not installed")

    def class_of(name: str):
        package, _, short = name.split("/")
        found = getattr(pytest.importorskip(f"{package}.msg", reason=f"{package} is not installed"), short)
        return lambda **fields: found(check_fields=True, **fields)

    made = build(message, class_of, RCLPY)
    package, _, short = message.type.split("/")
    cls = getattr(importlib.import_module(f"{package}.msg"), short)
    return serialization.deserialize_message(serialization.serialize_message(made), cls)


LIBRARIES = pytest.mark.parametrize("received", [rosbags_message, rclpy_message])


def rigid(rotation_vector=(0.3, -1.2, 2.0), translation=(1.0, -2.0, 3.5)) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(rotation_vector).as_matrix()
    T[:3, 3] = translation
    return T


COVARIANCE = np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]) + 0.125


@LIBRARIES
def test_a_pose_survives(received):
    msg = received(encode_pose(rigid(), stamp_ns=NS, frame_id="odom"))
    decoded = decode_pose(msg)
    np.testing.assert_allclose(decoded.T_frame_child, rigid(), atol=1e-15)
    assert (decoded.stamp_ns, decoded.frame_id, decoded.child_frame_id) == (NS, "odom", "")
    assert msg.pose.orientation.w >= 0


@LIBRARIES
def test_a_pose_with_covariance_survives(received):
    msg = received(encode_pose_with_covariance(rigid(), COVARIANCE, stamp_ns=NS, frame_id="key_3"))
    np.testing.assert_allclose(decode_pose(msg).T_frame_child, rigid(), atol=1e-15)
    np.testing.assert_array_equal(np.reshape(msg.pose.covariance, (6, 6)), COVARIANCE)


@LIBRARIES
def test_odometry_survives(received):
    twist = np.arange(6.0)
    msg = received(
        encode_odometry(
            rigid(), COVARIANCE, twist, 2 * COVARIANCE, stamp_ns=NS, frame_id="odom", child_frame_id="base_link"
        )
    )
    decoded = decode_pose(msg)
    np.testing.assert_allclose(decoded.T_frame_child, rigid(), atol=1e-15)
    assert (decoded.stamp_ns, decoded.frame_id, decoded.child_frame_id) == (NS, "odom", "base_link")
    np.testing.assert_array_equal(np.reshape(msg.twist.covariance, (6, 6)), 2 * COVARIANCE)
    linear, angular = msg.twist.twist.linear, msg.twist.twist.angular
    assert [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z] == twist.tolist()


@LIBRARIES
def test_a_path_keeps_the_stamp_of_each_pose(received):
    poses = [(NS + i, rigid(translation=(i, 0, 0))) for i in range(3)]
    msg = received(encode_path(poses, stamp_ns=NS + 2, frame_id="odom"))
    decoded = [decode_pose(pose) for pose in msg.poses]
    assert [pose.stamp_ns for pose in decoded] == [NS, NS + 1, NS + 2]
    assert [pose.T_frame_child[0, 3] for pose in decoded] == [0, 1, 2]
    assert {pose.frame_id for pose in decoded} == {"odom"}


@LIBRARIES
def test_a_transform_survives(received):
    msg = received(encode_transform(rigid(), stamp_ns=NS, frame_id="odom", child_frame_id="base"))
    decoded = decode_transform(msg)
    np.testing.assert_allclose(decoded.T_frame_child, rigid(), atol=1e-15)
    assert (decoded.stamp_ns, decoded.frame_id, decoded.child_frame_id) == (NS, "odom", "base")


def test_transforms_are_bundled_for_tf():
    one = encode_transform(rigid(), stamp_ns=NS, frame_id="odom", child_frame_id="base")
    msg = rosbags_message(encode_tf([one, one]))
    assert [decode_transform(t).child_frame_id for t in msg.transforms] == ["base", "base"]


@LIBRARIES
def test_diagnostics_survive(received):
    values = {"inliers": 120, "rmse_m": 0.01, "reason": "NO_DEPTH"}
    status = encode_diagnostic_status(
        ERROR, "registrar", "lost: no depth", values=values, hardware_id="lidar"
    )
    msg = received(encode_diagnostic_array([status, status], stamp_ns=NS))
    assert (msg.header.stamp.sec, msg.header.stamp.nanosec) == (1_700_000_000, 123_456_789)
    assert len(msg.status) == 2
    found = msg.status[1]
    assert found.level in (2, b"\x02")
    assert (found.name, found.message, found.hardware_id) == ("registrar", "lost: no depth", "lidar")
    assert {pair.key: pair.value for pair in found.values} == {"inliers": "120", "rmse_m": "0.01", "reason": "NO_DEPTH"}


@LIBRARIES
def test_a_single_status_is_a_message_too(received):
    msg = received(encode_diagnostic_status(OK, "n", "m", values={}))
    assert msg.level in (0, b"\x00")


GREY = np.arange(12, dtype=np.uint8).reshape(3, 4)


@LIBRARIES
@pytest.mark.parametrize("pixels", [GREY, np.stack((GREY, GREY + 50, GREY + 100), axis=-1), GREY[:, ::2]])
def test_an_image_survives(received, pixels):
    decoded = decode_image(received(encode_image(pixels, stamp_ns=NS, frame_id="camera")))
    np.testing.assert_array_equal(decoded.image, pixels)
    assert (decoded.stamp_ns, decoded.frame_id, decoded.notes) == (NS, "camera", ())


@LIBRARIES
@pytest.mark.parametrize("dtype", ["<u2", ">u2"])
def test_depth_in_millimetres_survives(received, dtype):
    depth_mm = ((GREY.astype("u2") + 1) * 500).astype(dtype)
    decoded = decode_depth(received(encode_image(depth_mm, stamp_ns=NS, frame_id="camera")))
    np.testing.assert_allclose(decoded.depth_m, depth_mm / 1000, rtol=2e-7)


@LIBRARIES
def test_depth_in_metres_survives(received):
    depth_m = GREY.astype(np.float32) / 7
    decoded = decode_depth(received(encode_image(depth_m, stamp_ns=NS, frame_id="camera")))
    np.testing.assert_array_equal(decoded.depth_m, depth_m)


@LIBRARIES
@pytest.mark.parametrize("coloured", [False, True])
def test_points_survive(received, coloured):
    points = np.random.default_rng(3).normal(size=(50, 3)).astype(np.float32)
    colours = np.arange(150, dtype=np.uint8).reshape(50, 3) if coloured else None
    msg = received(encode_points(points, stamp_ns=NS, frame_id="odom", colours=colours))
    decoded = decode_points(msg)
    np.testing.assert_array_equal(decoded.points, points)
    assert (decoded.stamp_ns, decoded.frame_id, decoded.notes) == (NS, "odom", ())
    if colours is not None:
        # PCL's rgb: one float whose bytes are, from the lowest, blue, green and red.
        packed = np.frombuffer(bytes(msg.data), "u1").reshape(50, 16)
        assert msg.fields[3].name == "rgb"
        np.testing.assert_array_equal(packed[:, 12:15], colours)


@LIBRARIES
def test_calibrations_survive(received):
    raw = Camera(640, 480, 500.0, 510.0, 319.5, 239.5)
    camera = Camera(640, 480, 400.0, 410.0, 300.0, 200.0)
    turn = tuple(Rotation.from_rotvec((0, 0.1, 0)).as_matrix().reshape(-1).tolist())
    rectifier = Rectifier(raw, camera, "rational_polynomial", (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8), turn)
    msg = received(encode_camera_info(camera, stamp_ns=NS, frame_id="camera", rectifier=rectifier))
    decoded = decode_camera_info(msg, images="raw")
    assert (decoded.camera, decoded.rectifier) == (camera, rectifier)
    assert (decoded.stamp_ns, decoded.frame_id, decoded.notes) == (NS, "camera", ())
    assert decode_camera_info(msg, images="rectified").camera == camera
    plain = received(encode_camera_info(camera, stamp_ns=NS, frame_id="camera"))
    assert decode_camera_info(plain, images="raw").camera == camera
    assert decode_camera_info(plain, images="raw").rectifier is None


@pytest.mark.hostile("Stamps: 19-digit nanoseconds kept exactly from message to file")
@LIBRARIES
@pytest.mark.parametrize("stamp_ns", [NS, 1, 999_999_999, 2**31 * 10**9 - 1])
def test_stamps_survive_to_the_nanosecond(received, stamp_ns):
    msg = received(encode_pose(np.eye(4), stamp_ns=stamp_ns, frame_id="odom"))
    assert decode_pose(msg).stamp_ns == stamp_ns


@pytest.mark.parametrize("stamp_ns", [0, -1, 2**31 * 10**9])
def test_no_message_leaves_with_a_stamp_that_is_none(stamp_ns):
    with pytest.raises(ValueError, match="stamp"):
        encode_pose(np.eye(4), stamp_ns=stamp_ns, frame_id="odom")


NAN_T = np.eye(4)
NAN_T[0, 3] = np.nan


@pytest.mark.parametrize(
    "T", [NAN_T, np.zeros((4, 4)), np.diag([1.0, 1, -1, 1]), np.eye(3), np.diag([2.0, 2, 2, 1]), np.eye(4) * 2]
)
def test_no_message_leaves_with_a_pose_that_is_none(T):
    with pytest.raises(ValueError, match="expected"):
        encode_pose(T, stamp_ns=NS, frame_id="odom")
    with pytest.raises(ValueError, match="expected"):
        encode_transform(T, stamp_ns=NS, frame_id="odom", child_frame_id="base")


@pytest.mark.parametrize("covariance", [np.full((6, 6), np.nan), np.eye(5), np.full((6, 6), np.inf)])
def test_no_message_leaves_with_a_covariance_that_is_none(covariance):
    with pytest.raises(ValueError, match="finite numbers of shape"):
        encode_pose_with_covariance(np.eye(4), covariance, stamp_ns=NS, frame_id="odom")


@pytest.mark.parametrize(
    "pixels", [np.zeros((2, 2, 4), "u1"), np.zeros((2, 2), "i4"), np.zeros((0, 2), "u1"), np.zeros(4, "u1")]
)
def test_arrays_that_are_no_image_are_refused(pixels):
    with pytest.raises(ValueError, match="expected"):
        encode_image(pixels, stamp_ns=NS, frame_id="camera")


def test_no_cloud_leaves_with_nan():
    with pytest.raises(ValueError, match="not finite"):
        encode_points(np.full((2, 3), np.nan), stamp_ns=NS, frame_id="odom")
