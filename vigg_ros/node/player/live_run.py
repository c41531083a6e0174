# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One run of the node on a bag: started, ready, played to, listened to, stopped."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from vigg_ros.bags.reader import BagReader, Topic
from vigg_ros.bags.topics import TopicChoice
from vigg_ros.node.player.bag_publishers import Publishers
from vigg_ros.node.player.dds_profile import set_profile
from vigg_ros.node.player.live_display import LiveDisplay
from vigg_ros.node.player.live_summary import Run
from vigg_ros.node.player.node_process import NodeFailed, NodeProcess, Usage, node_command
from vigg_ros.node.player.observer import Observer
from vigg_ros.node.player.participant import participant
from vigg_ros.node.player.playback import Plan, Playback, Sending
from vigg_ros.node.player.scoreboard import Errors, Score, Scoreboard
from vigg_ros.report.trajectory import Trajectory

READY_S = 180.0
"""So long the node may take to subscribe: before, it compiles its kernels, up to a minute where they are not cached."""

QUIET_S = 3.0
"""After the last message the node is stopped when everything is answered, or nothing was heard for so long."""

MAX_REST_S = 60.0


class LiveRun:
    """Plays the chosen topics of an open bag to a node of its own, in a domain of its own."""

    def __init__(
        self,
        reader: BagReader,
        choice: TopicChoice,
        *,
        truth: Trajectory | None,
        node_words: Sequence[str],
        domain_id: int,
        log: Path,
    ) -> None:
        self._reader = reader
        self._choice = choice
        self._truth = truth
        self._domain_id = domain_id
        self._board = Scoreboard(Errors(truth))
        self.notes = set_profile()
        """What went wrong on the way, and what the node warned of."""
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain_id), "PYTHONUNBUFFERED": "1"}
        self._process = NodeProcess(node_command(node_words), log, environment)
        self._leader = choice.image if choice.points is None else choice.points
        self._usage: list[Usage | None] = [None, None]
        self._played_s = 0.0
        self._exit_code = 0
        self.late_s = 0.0
        """By how much a message was published later than its place in the rhythm, at most."""

    def run(self, plan: Plan, *, best_effort: bool) -> bool:
        """Do it all; True if the user interrupted. Raises NodeFailed if the node never got ready."""
        interrupted = False
        with participant("vigg_live", domain_id=self._domain_id) as node, self._process:
            publishers = Publishers(node, self._topics, self._reader.latched(), best_effort=best_effort)
            observer = Observer(node, self._board)
            try:
                with observer.listening():
                    self._wait_until_ready(publishers, observer)
                    self._play(publishers, plan)
            except KeyboardInterrupt:
                interrupted = True
            self._exit_code = self._process.stop()
            self.notes += [*publishers.notes, *observer.faults]
            # Drops are counted in the table; what the node said of them on the way is out of date.
            problems = [line for line in self._process.problems() if "(DROPPED)" not in line]
            self.notes += [f"the node says: {line}" for line in problems]
        return interrupted

    @property
    def summary(self) -> Run:
        """What happened."""
        return Run(
            recording=self._reader.path.name,
            leader="colour image" if self._choice.points is None else "scan",
            score=self._board.score(time.monotonic()),
            played_s=self._played_s,
            has_truth=self._truth is not None,
            at_start=self._usage[0],
            at_end=self._usage[1],
            exit_code=self._exit_code,
        )

    @property
    def _topics(self) -> list[Topic]:
        """What the node subscribes to; the truth is nothing that a node should see."""
        choice = self._choice
        return [topic for topic in (choice.image, choice.camera_info, choice.depth, choice.points) if topic]

    def _wait_until_ready(self, publishers: Publishers, observer: Observer) -> None:
        print("waiting for the node (the first run compiles its kernels) ...", file=sys.stderr, flush=True)
        names = [topic.name for topic in self._topics]
        if not publishers.wait_for_subscribers(READY_S, names, check=self._process.check):
            missing = ", ".join(publishers.unheard(names))
            raise NodeFailed(f"the node did not subscribe to {missing or 'its topics'} within {READY_S:.0f} s")
        if observer.publishers > 1:
            raise NodeFailed(
                f"another registrar runs on ROS_DOMAIN_ID={self._domain_id}; stop it, or choose another --domain-id"
            )

    def _play(self, publishers: Publishers, plan: Plan) -> None:
        self._usage = [self._process.usage()] * 2
        start_s = time.monotonic()
        display = LiveDisplay(self._look, start_s=start_s)
        playback = Playback(self._reader, publishers, plan, ticks=[lambda _: display.update()])

        def announce(sending: Sending) -> None:
            if sending.topic == self._leader.name and sending.recorded_ns and sending.stamp_ns:
                self._board.sent(sending.recorded_ns, sending.stamp_ns, sending.at_s)
                self._played_s = sending.at_s - start_s
            self._process.check()

        try:
            playback.run(announce)
            self._await_the_rest(display)
        finally:
            self.late_s = playback.late_s
            self._usage[1] = self._process.usage()

    def _await_the_rest(self, display: LiveDisplay) -> None:
        """Until every frame is answered, or the node has fallen silent."""
        ended_s = time.monotonic()
        while (now_s := time.monotonic()) < ended_s + MAX_REST_S:
            if not self._board.score(now_s).silent or now_s - max(ended_s, self._board.heard_s) > QUIET_S:
                return
            self._process.check()
            display.update()
            time.sleep(0.05)

    def _look(self) -> tuple[Score, Usage | None]:
        return self._board.score(time.monotonic()), self._process.usage()
