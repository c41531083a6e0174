# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Listens to a registrar node, in a thread of its own."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile

from vigg_ros.node.player.scoreboard import Scoreboard
from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.stamped_pose import decode_pose

POSE, STATUS = "/registrar/pose", "/registrar/status"

WITH_POSE = frozenset({"STARTED", "TRACKING", "RELOCALISED"})
"""The states of frames that have a pose; see ``tracking.State``."""

_DEPTH = 1000


class Observer:
    """Enters what the node publishes into a scoreboard."""

    def __init__(self, node: Node, board: Scoreboard) -> None:
        self._board = board
        quality = QoSProfile(depth=_DEPTH)
        self._pose = node.create_subscription(PoseStamped, POSE, self._take_pose, quality)
        self._status = node.create_subscription(DiagnosticStatus, STATUS, self._take_status, quality)
        self._node = node
        self.faults: list[str] = []
        """What a node should never publish."""

    @property
    def publishers(self) -> int:
        """How many nodes publish a status."""
        return int(self._node.count_publishers(STATUS))

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Take messages as long as the block lasts."""
        executor = SingleThreadedExecutor(context=self._node.context)
        executor.add_node(self._node)
        thread = threading.Thread(target=_spin, args=(executor,), name="observer", daemon=True)
        thread.start()
        try:
            yield
        finally:
            executor.shutdown()
            thread.join()

    def _take_pose(self, message: Any) -> None:
        at_s = time.monotonic()
        try:
            pose = decode_pose(message)
        except DataError as error:
            self.faults.append(f"{POSE}: {error}")
        else:
            self._board.posed(pose.stamp_ns, pose.T_frame_child, at_s)

    def _take_status(self, message: Any) -> None:
        at_s = time.monotonic()
        values = {entry.key: entry.value for entry in message.values}
        state, reason = split_status(message.message, values)
        stamp = values.get("stamp_ns", "")
        stamp_ns = int(stamp) if stamp.isdecimal() else 0
        self._board.stated(stamp_ns, state, reason, at_s, has_pose=state in WITH_POSE)


def split_status(text: str, values: dict[str, str]) -> tuple[str, str]:
    """State and reason: by the values of these names, else the first words of the text."""
    words = text.replace("/", " ").replace(":", " ").split()
    state = values.get("state") or (words[0] if words else "")
    return state, values.get("reason", "")


def _spin(executor: SingleThreadedExecutor) -> None:
    try:
        executor.spin()
    except ExternalShutdownException:
        return
