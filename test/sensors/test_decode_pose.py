# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Odd poses that are taken. Plain ones are read back in test_messages.py, bad ones are in test_message_refusals.py."""

from __future__ import annotations

import numpy as np
import pytest

from vigg_ros.sensors.stamped_pose import decode_pose, decode_transform
from vigg_ros_testing.message_samples import header, pose_stamped, transform_stamped


@pytest.mark.parametrize(("decode", "message"), [(decode_pose, pose_stamped), (decode_transform, transform_stamped)])
def test_a_quaternion_of_another_length_is_the_same_rotation(decode, message):
    # A quarter turn about z takes x to y.
    decoded = decode(message(orientation={"z": 3.0, "w": 3.0}))
    expected = [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]
    np.testing.assert_allclose(decoded.T_frame_child, expected, atol=1e-15)


def test_a_static_transform_may_have_no_stamp():
    assert decode_transform(transform_stamped(header=header(0, 0, "map"))).stamp_ns == 0


def test_slashes_of_both_frames_are_stripped_and_noted():
    decoded = decode_transform(transform_stamped(header=header(frame_id="/odom"), child_frame_id="/base"))
    assert (decoded.frame_id, decoded.child_frame_id) == ("odom", "base")
    assert [note.code for note in decoded.notes] == ["FRAME_ID_SLASH", "FRAME_ID_SLASH"]
