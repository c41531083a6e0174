# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The same reader for the messages of rosbags (ROS 2 and ROS 1) and of rclpy.

Each message of the samples is copied, field by field, into the real classes and sent through their
serialisation; what is decoded must not differ from what the sample gives.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vigg_ros.messages.fields import Message
from vigg_ros_testing.decoder_samples import SAMPLES
from vigg_ros_testing.real_messages import through_rclpy, through_ros_1_bag, through_ros_2_bag

NESTED = {
    "header": "std_msgs/msg/Header",
    "stamp": "builtin_interfaces/msg/Time",
    "roi": "sensor_msgs/msg/RegionOfInterest",
    "fields": "sensor_msgs/msg/PointField",
}


def as_message(sample: SimpleNamespace, type_name: str) -> Message:
    return Message(type_name, {name: as_field(name, value) for name, value in vars(sample).items()})


def as_field(name: str, value: Any) -> Any:
    if isinstance(value, SimpleNamespace):
        return as_message(value, NESTED[name])
    if name == "fields":
        return tuple(as_message(item, NESTED[name]) for item in value)
    if isinstance(value, bytes):
        return np.frombuffer(value, np.uint8)
    return np.array(value, np.float64) if isinstance(value, list) else value


def assert_same(found: Any, expected: Any) -> None:
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
    sample = SAMPLES[name]
    received = through(as_message(sample.message, f"sensor_msgs/msg/{sample.type}"))
    assert_same(sample.decode(received), sample.decode(sample.message))
