# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The one way in: what only the sequence of messages tells."""

from __future__ import annotations

import pytest

from vigg_ros.registration.options import InputConfig
from vigg_ros.sensors.input_decoder import InputDecoder
from vigg_ros_testing.message_samples import camera_info


@pytest.mark.hostile("CameraInfo: changes mid-run: drop keyframes, N")
def test_another_camera_than_before_is_noted_once_for_each_change() -> None:
    decoder = InputDecoder(InputConfig(), "/camera/image_raw")
    lenses = [[0.0] * 5, [0.0] * 5, [-0.3, 0.1, 0.0, 0.0, 0.0], [-0.3, 0.1, 0.0, 0.0, 0.0], [0.0] * 5]
    codes = [[note.code for note in decoder.decode("camera_info", camera_info(d=lens)).notes] for lens in lenses]
    assert codes == [[], [], ["CALIBRATION_CHANGED"], [], ["CALIBRATION_CHANGED"]]
