# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stamps, frame names and odd poses that are taken. What is refused is in test_message_refusals.py."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vigg_ros.sensors.header import stamp_ns
from vigg_ros.sensors.stamped_pose import decode_pose, decode_transform
from vigg_ros_testing.decoder_samples import EACH_SENSOR
from vigg_ros_testing.message_samples import header, pose_stamped, transform_stamped

EVERY_SENSOR = pytest.mark.parametrize("sensor", EACH_SENSOR, ids=lambda sensor: sensor.decode.__name__)


@pytest.mark.hostile("Stamps: 19-digit nanoseconds kept exactly from message to file")
@EVERY_SENSOR
@pytest.mark.parametrize(
    ("sec", "nanosec", "expected"),
    [
        (1_700_000_000, 123_456_789, 1_700_000_000_123_456_789),
        (2**31 - 1, 999_999_999, 2_147_483_647_999_999_999),
        (0, 1, 1),
    ],
)
def test_nanoseconds_are_kept_exactly(sensor, sec, nanosec, expected):
    found = sensor.decode(sensor.changed(header=header(sec, nanosec))).stamp_ns
    assert found == expected
    assert type(found) is int


@given(st.integers(1, 2**32 - 1), st.integers(0, 10**9 - 1))
def test_any_time_is_read_without_rounding(sec, nanosec):
    assert stamp_ns(SimpleNamespace(sec=np.uint32(sec), nanosec=np.uint32(nanosec))) == sec * 10**9 + nanosec


@pytest.mark.hostile("Frames and TF: Empty frame_id N with extrinsics by parameter, else R")
@pytest.mark.hostile("Frames and TF: leading slash stripped N")
@EVERY_SENSOR
@pytest.mark.parametrize("slashes", ["", "/", "//"])
def test_an_empty_frame_is_noted_and_a_leading_slash_stripped_with_a_note(sensor, slashes):
    """Who asks TF for the place of an empty one refuses it, see test_extrinsics.py."""
    for name, code in (("", "FRAME_ID_EMPTY"), ("robot/lidar", "FRAME_ID_SLASH")):
        observation = sensor.decode(sensor.changed(header=header(frame_id=slashes + name)))
        assert observation.frame_id == name
        notes = [note for note in observation.notes if note.code == code]
        assert [name in str(note) for note in notes] == [True] * (slashes != "" or name == "")


@pytest.mark.parametrize(("decode", "message"), [(decode_pose, pose_stamped), (decode_transform, transform_stamped)])
def test_a_quaternion_of_another_length_is_the_same_rotation(decode, message):
    # A quarter turn about z takes x to y.
    decoded = decode(message(orientation={"z": 3.0, "w": 3.0}))
    expected = [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]
    np.testing.assert_allclose(decoded.T_frame_child, expected, atol=1e-15)


def test_a_static_transform_may_have_no_stamp_and_slashes_before_both_frames():
    decoded = decode_transform(transform_stamped(header=header(0, 0, "/odom"), child_frame_id="/base"))
    assert decoded.stamp_ns == 0
    assert (decoded.frame_id, decoded.child_frame_id) == ("odom", "base")
    assert [note.code for note in decoded.notes] == ["FRAME_ID_SLASH", "FRAME_ID_SLASH"]
