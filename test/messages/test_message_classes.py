# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The same reader for the messages of rosbags (ROS 2 and ROS 1) and of rclpy.

Each message of the samples is copied, field by field, into the real classes and sent through their
serialisation; what is decoded must not differ from what the sample gives.
"""

from __future__ import annotations

import array
import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from vigg_ros_testing.decoder_samples import SAMPLES

ROS_2 = get_typestore(Stores.ROS2_JAZZY)
ROS_1 = get_typestore(Stores.ROS1_NOETIC)

NESTED = {
    "header": "std_msgs/msg/Header",
    "stamp": "builtin_interfaces/msg/Time",
    "roi": "sensor_msgs/msg/RegionOfInterest",
    "fields": "sensor_msgs/msg/PointField",
}


def rosbags_value(store: Any, name: str, value: Any) -> Any:
    if isinstance(value, SimpleNamespace):
        return rosbags_object(store, value, NESTED[name])
    if name == "fields":
        return [rosbags_object(store, item, NESTED[name]) for item in value]
    if isinstance(value, bytes):
        return np.frombuffer(value, np.uint8)
    return np.array(value, np.float64) if isinstance(value, list) else value


def rosbags_object(store: Any, sample: SimpleNamespace, msgtype: str) -> Any:
    """ROS 1 has a further number in its headers, and capital letters for the matrices."""
    cls = store.types[msgtype]
    given = {name: rosbags_value(store, name, value) for name, value in vars(sample).items()}
    given |= {"seq": 7, **{name.upper(): given[name] for name in given if name in "dkrp"}}
    return cls(**{field.name: given[field.name] for field in dataclasses.fields(cls) if field.name in given})


def through_ros_2_bag(sample: SimpleNamespace, short: str) -> Any:
    msgtype = f"sensor_msgs/msg/{short}"
    made = rosbags_object(ROS_2, sample, msgtype)
    return ROS_2.deserialize_cdr(ROS_2.serialize_cdr(made, msgtype), msgtype)


def through_ros_1_bag(sample: SimpleNamespace, short: str) -> Any:
    msgtype = f"sensor_msgs/msg/{short}"
    made = rosbags_object(ROS_1, sample, msgtype)
    return ROS_1.deserialize_ros1(ROS_1.serialize_ros1(made, msgtype), msgtype)


def rclpy_value(name: str, value: Any) -> Any:
    if isinstance(value, SimpleNamespace):
        return rclpy_object(value, NESTED[name])
    if name == "fields":
        return [rclpy_object(item, NESTED[name]) for item in value]
    return array.array("B", value) if isinstance(value, bytes) else value


def rclpy_object(sample: SimpleNamespace, msgtype: str) -> Any:
    package, _, short = msgtype.split("/")
    cls = getattr(pytest.importorskip(f"{package}.msg", reason=f"{package} is not installed"), short)
    return cls(**{name: rclpy_value(name, value) for name, value in vars(sample).items()})


def through_rclpy(sample: SimpleNamespace, short: str) -> Any:
    serialization = pytest.importorskip("rclpy.serialization", reason="rclpy is not installed")
    made = rclpy_object(sample, f"sensor_msgs/msg/{short}")
    return serialization.deserialize_message(serialization.serialize_message(made), type(made))


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
    assert_same(sample.decode(through(sample.message, sample.type)), sample.decode(sample.message))
