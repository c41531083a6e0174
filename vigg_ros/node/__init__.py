# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The registrar as a ROS 2 node: the only room that imports rclpy, tf2_ros and message packages."""

from __future__ import annotations


def main(arguments: list[str] | None = None) -> int:
    """The executable ``registrar``; returns its exit code."""
    from vigg_ros.node.program import run

    return run(arguments)
