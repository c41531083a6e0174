# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages as plain fields, and how to make real ones of them without importing any.

``build(message, class_of, RCLPY)`` gives what rclpy publishes, ``build(message, store.types.__getitem__,
ROSBAGS)`` what rosbags serialises.
"""

from __future__ import annotations

import array
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Message:
    """A message of ROS 2: its type ("geometry_msgs/msg/Pose") and all of its fields, in order.

    A value is a number, text, an Octet, an array (N,), a Message or a tuple of Messages.
    """

    type: str
    fields: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Octet:
    """A field of type ``byte``."""

    value: int


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a library wants arrays and bytes."""

    sequence: Callable[[NDArray[Any]], Any]
    octet: Callable[[int], Any]


def _array(values: NDArray[Any]) -> array.array[Any]:
    # rclpy takes an array.array as it is (0.35 ms for 640x480 BGR) and anything else value by value (47 ms).
    copied = array.array(values.dtype.char)
    copied.frombytes(np.ascontiguousarray(values).data.cast("B"))
    return copied


RCLPY = Dialect(sequence=_array, octet=lambda value: bytes((value,)))
ROSBAGS = Dialect(sequence=lambda values: values, octet=int)


def build(message: Message, class_of: Callable[[str], Callable[..., Any]], dialect: Dialect) -> Any:
    """The message as an object of the class that ``class_of`` names for its type."""
    return class_of(message.type)(**{name: _built(value, class_of, dialect) for name, value in message.fields.items()})


def _built(value: Any, class_of: Callable[[str], Callable[..., Any]], dialect: Dialect) -> Any:
    if isinstance(value, Message):
        return build(value, class_of, dialect)
    if isinstance(value, tuple):
        return [_built(item, class_of, dialect) for item in value]
    if isinstance(value, np.ndarray):
        return dialect.sequence(value)
    return dialect.octet(value.value) if isinstance(value, Octet) else value
