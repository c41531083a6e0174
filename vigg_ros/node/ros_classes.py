# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Message fields into messages of the installed packages."""

from __future__ import annotations

import functools
import importlib
from typing import Any

from vigg_ros.messages.fields import RCLPY, Message, build


@functools.cache
def class_of(type_name: str) -> Any:
    """The class of "geometry_msgs/msg/Pose"."""
    package, kind, name = type_name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), name)


def ros(message: Message) -> Any:
    """The message as rclpy publishes it."""
    return build(message, class_of, RCLPY)
