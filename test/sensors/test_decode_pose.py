# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses that are none. Good ones are read back in test_encode.py."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from vigg_ros.sensors.stamped_pose import decode_pose, decode_transform
from vigg_ros_testing.message_samples import header, reject


def vector(x=1.0, y=2.0, z=3.0):
    return SimpleNamespace(x=x, y=y, z=z)


def quaternion(x=0.0, y=0.0, z=0.0, w=1.0):
    return SimpleNamespace(x=x, y=y, z=z, w=w)


def stamped(position, orientation, **changes):
    pose = SimpleNamespace(position=position, orientation=orientation)
    return SimpleNamespace(**{"header": header(frame_id="odom"), "pose": pose, **changes})


def transform(translation, rotation, **changes):
    inner = SimpleNamespace(translation=translation, rotation=rotation)
    fields = {"header": header(frame_id="odom"), "child_frame_id": "base", "transform": inner}
    return SimpleNamespace(**{**fields, **changes})


BOTH = pytest.mark.parametrize(("decode", "message"), [(decode_pose, stamped), (decode_transform, transform)])


@BOTH
def test_a_quaternion_of_another_length_is_the_same_rotation(decode, message):
    # A quarter turn about z takes x to y.
    decoded = decode(message(vector(), quaternion(z=3.0, w=3.0)))
    expected = [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]
    np.testing.assert_allclose(decoded.T_frame_child, expected, atol=1e-15)


@pytest.mark.hostile("Frames and TF: quaternion of norm 0 or NaN R")
@BOTH
@pytest.mark.parametrize(
    "rotation",
    [quaternion(w=0.0), quaternion(w=1e-9), quaternion(x=np.nan), quaternion(y=np.inf), quaternion(w=-np.inf)],
)
def test_a_quaternion_that_is_no_rotation_is_refused(decode, message, rotation):
    assert reject(decode, message(vector(), rotation)).code == "BAD_QUATERNION"


@BOTH
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("axis", "xyz")
def test_a_position_that_is_not_finite_is_refused(decode, message, axis, value):
    assert reject(decode, message(vector(**{axis: value}), quaternion())).code == "BAD_POSITION"


@pytest.mark.parametrize("changes", [{"child_frame_id": ""}, {"child_frame_id": "/"}, {"header": header(frame_id="")}])
def test_a_transform_names_both_frames(changes):
    assert reject(decode_transform, transform(vector(), quaternion(), **changes)).code == "FRAME_ID_EMPTY"


def test_a_static_transform_may_have_no_stamp_but_a_pose_needs_one():
    assert decode_transform(transform(vector(), quaternion(), header=header(0, 0, "map"))).stamp_ns == 0
    assert reject(decode_pose, stamped(vector(), quaternion(), header=header(0, 0))).code == "STAMP_ZERO"


def test_slashes_of_both_frames_are_stripped_and_noted():
    msg = transform(vector(), quaternion(), header=header(frame_id="/odom"), child_frame_id="/base")
    decoded = decode_transform(msg)
    assert (decoded.frame_id, decoded.child_frame_id) == ("odom", "base")
    assert [note.code for note in decoded.notes] == ["FRAME_ID_SLASH", "FRAME_ID_SLASH"]
