# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages through the real classes and the serialisation of each library, as they would be received."""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Callable
from typing import Any

import pytest
from rosbags.typesys import Stores, get_typestore

from vigg_ros.messages.fields import RCLPY, ROSBAGS, Message, build

ROS_2 = get_typestore(Stores.ROS2_JAZZY)
ROS_1 = get_typestore(Stores.ROS1_NOETIC)


def cdr(message: Message) -> bytes:
    """As ROS 2 sends it."""
    return bytes(ROS_2.serialize_cdr(build(message, ROS_2.types.__getitem__, ROSBAGS), message.type))


def through_ros_2_bag(message: Message) -> Any:
    return ROS_2.deserialize_cdr(cdr(message), message.type)


def through_ros_1_bag(message: Message) -> Any:
    made = build(message, _ros_1_class, ROSBAGS)
    return ROS_1.deserialize_ros1(ROS_1.serialize_ros1(made, message.type), message.type)


def _ros_1_class(name: str) -> Callable[..., Any]:
    """ROS 1 has a further number in its headers, and capital letters for the matrices."""
    cls = ROS_1.types[name]
    names = [field.name for field in dataclasses.fields(cls)]

    def make(**fields: Any) -> Any:
        fields |= {"seq": 7, **{name.upper(): fields[name] for name in fields if name in "dkrp"}}
        return cls(**{name: fields[name] for name in names if name in fields})

    return make


def through_rclpy(message: Message) -> Any:
    """With every field's type checked."""
    serialization = pytest.importorskip("rclpy.serialization", reason="rclpy is not installed")
    made = build(message, lambda name: lambda **fields: _rclpy_class(name)(check_fields=True, **fields), RCLPY)
    return serialization.deserialize_message(serialization.serialize_message(made), _rclpy_class(message.type))


def _rclpy_class(name: str) -> Any:
    package, _, short = name.split("/")
    pytest.importorskip(f"{package}.msg", reason=f"{package} is not installed")
    return getattr(importlib.import_module(f"{package}.msg"), short)
