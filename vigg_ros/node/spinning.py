# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Around the node: the context, the executor, and an orderly end."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from vigg_ros.node.parameter_files import notes_on_files
from vigg_ros.node.registrar_node import RegistrarNode
from vigg_ros.registration.errors import ConfigError

if TYPE_CHECKING:
    from vigg_ros.node.program import StopSignals

POLL_S = 0.1
"""A signal is noticed within this time."""

PATIENCE_S = 0.5
"""How long a running registration is waited for at the end."""


def spin(words: list[str], signals: StopSignals) -> bool:
    """Run the node until a signal; False if a registration still runs after it.

    Raises ConfigError for parameters and arguments that cannot be used.
    """
    context = rclpy.Context()
    try:
        rclpy.init(args=["registrar", *words], context=context, signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # rclpy has a type of its own for each kind of bad argument, and RuntimeError
        text = " ".join(str(error).split())
        hint = "; a file of `vigg config` is given as -p config:=FILE" if "--params-file" in words else ""
        raise ConfigError(f"the arguments after --ros-args cannot be used: {text}{hint}") from error
    signals.defer()
    try:
        return _spin(context, words, signals.received)
    finally:
        context.try_shutdown()


def _spin(context: rclpy.Context, words: list[str], stop: threading.Event) -> bool:
    node = RegistrarNode(context)
    try:
        for note in notes_on_files(words, node.ros.get_fully_qualified_name()):
            node.ros.get_logger().warning(note)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node.ros)
        node.start()
        while not stop.is_set():
            executor.spin_once(timeout_sec=POLL_S)
    except ExternalShutdownException:
        pass  # somebody else ended the context; the end is the same
    finally:
        ended = node.end(PATIENCE_S)
        node.ros.destroy_node()
    return ended
