# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One run of the node on a bag: started, ready, played to, listened to, stopped."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile

from vigg_ros.bags.reader import BagReader, SerialisedMessage
from vigg_ros.bags.topics import TopicChoice
from vigg_ros.node.player.bag_player import POLL_S, BagPlayer, Wait, ros_node
from vigg_ros.node.player.dds_profile import set_profile
from vigg_ros.node.player.live_frames import LiveFrames
from vigg_ros.node.player.live_table import LiveDisplay, live_rows
from vigg_ros.node.player.node_process import NodeFailed, NodeProcess, Usage
from vigg_ros.report.trajectory import Trajectory
from vigg_ros.sensors.stamped_pose import decode_pose

NODE = [sys.executable, "-m", "vigg_ros.node"]
"""The node of this installation."""

READY_S = 180.0
"""So long the node may take to subscribe: before, it compiles its kernels, up to a minute where they are not cached."""

QUIET_S = 3.0
"""After the last message the node is stopped when everything is answered, or nothing was heard for so long."""

POSE, STATUS = "/registrar/pose", "/registrar/status"


class LiveRun:
    """Plays the chosen topics of an open bag to a node of its own, in a ROS domain of its own, and measures it."""

    def __init__(self, reader: BagReader, choice: TopicChoice, truth: Trajectory | None, *, domain_id: int) -> None:
        self.frames = LiveFrames(truth)
        self.notes = set_profile()
        """What went wrong on the way, and what the node warned of."""
        self.exit_code = 0
        """Of the node."""
        self._reader = reader
        self._domain_id = domain_id
        # What the node subscribes to; the truth is nothing that it should see.
        inputs = (choice.image, choice.camera_info, choice.depth, choice.points)
        self._topics = [topic.name for topic in inputs if topic is not None]
        self._leading_topic = (choice.points or choice.image).name
        self._usage: list[Usage | None] = [None, None]
        self._display = LiveDisplay(self.rows)

    def run(self, node_words: Sequence[str], log: Path, *, rate: float, best_effort: bool) -> bool:
        """Do it all; True if the user interrupted. Raises NodeFailed if the node never got ready, or died."""
        environment = {**os.environ, "ROS_DOMAIN_ID": str(self._domain_id), "PYTHONUNBUFFERED": "1"}
        command = [*NODE, *node_words]
        with ros_node("vigg_live", self._domain_id) as ros, NodeProcess(command, log, environment) as process:
            player = BagPlayer(ros, self._reader, self._topics, best_effort=best_effort)
            interrupted = False
            try:
                with self._receiving(ros, process) as wait:
                    self._wait_until_ready(ros, player, wait)
                    self._usage = [process.usage()] * 2
                    player.play(rate, self._note_frame, wait)
                    self.frames.heard_s = time.monotonic()
                    while self.frames.pending and time.monotonic() - self.frames.heard_s < QUIET_S:
                        wait(POLL_S)
            except KeyboardInterrupt:
                interrupted = True
            self.exit_code = process.stop()
            # Drops are counted in the table; what the node said of them on the way is out of date.
            warnings = (f"the node says: {line}" for line in process.warnings() if "(DROPPED)" not in line)
            self.notes += [*player.notes, *player.lateness_notes(), *warnings]
        self._display.clear()
        return interrupted

    def rows(self) -> dict[str, str]:
        """The figures so far."""
        return live_rows(self.frames, *self._usage)

    @contextmanager
    def _receiving(self, ros: Node, process: NodeProcess) -> Iterator[Wait]:
        """A way to wait in which the node's answers are taken, and the figures shown."""
        ros.create_subscription(PoseStamped, POSE, self._take_pose, QoSProfile(depth=1000))
        ros.create_subscription(DiagnosticStatus, STATUS, self._take_status, QoSProfile(depth=1000))
        executor = SingleThreadedExecutor(context=ros.context)
        executor.add_node(ros)

        def wait(seconds: float) -> None:
            executor.spin_once(timeout_sec=seconds)
            process.check()
            self._usage[1] = process.usage()
            if self.frames.all:
                self._display.update()

        try:
            yield wait
        finally:
            executor.shutdown()

    def _wait_until_ready(self, ros: Node, player: BagPlayer, wait: Wait) -> None:
        print("waiting for the node (the first run compiles its kernels) ...", file=sys.stderr, flush=True)
        missing = player.wait_for_subscribers(self._topics, wait, timeout_s=READY_S)
        if missing:
            raise NodeFailed(f"the node did not subscribe to {', '.join(missing)} within {READY_S:g} s")
        if ros.count_publishers(STATUS) > 1:
            raise NodeFailed(
                f"another registrar runs on ROS_DOMAIN_ID={self._domain_id}; stop it, or choose another --domain-id"
            )

    def _note_frame(self, message: SerialisedMessage) -> None:
        if message.topic == self._leading_topic and message.stamp_ns:
            self.frames.send(message.stamp_ns)

    def _take_pose(self, message: Any) -> None:
        pose = decode_pose(message)
        self.frames.take_pose(pose.stamp_ns, pose.T_frame_child)

    def _take_status(self, message: Any) -> None:
        values = {entry.key: entry.value for entry in message.values}
        if "stamp_ns" in values:  # else it is of no frame: WAITING
            self.frames.take_status(int(values["stamp_ns"]), values["state"], values.get("reason", ""))
