# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The scheduler: one result for each leading message, whatever comes in between."""

import threading
import time

import numpy as np
import pytest

from vigg_ros.bench.worlds import HandheldLoop, render_rgbd, room
from vigg_ros.messages.sensor_messages import encode_image
from vigg_ros.node.scheduler import Scheduler
from vigg_ros.pipeline import Pipeline
from vigg_ros.registration.camera import Camera
from vigg_ros.registration.config import Config
from vigg_ros.sensors.observation import Calibration
from vigg_ros.tracking.sensor_mount import MountFinder, SensorMount
from vigg_ros_testing.real_messages import through_ros_2_bag
from vigg_ros_testing.short_recordings import CHEAP

CAMERA = Camera(160, 120, 131.0, 131.0, 79.5, 59.5)
START_NS, STEP_NS = 10**18, 66_666_667
CONFIG = Config().replace(CHEAP)


@pytest.fixture(scope="module")
def views():
    world, path = room(seed=2), HandheldLoop()
    return [render_rgbd(world, CAMERA, path.T_world_camera(number / 15)) for number in range(6)]


class Harness:
    """A scheduler, and the results that it publishes."""

    def __init__(self):
        self.results = []
        self.failures = []
        self.unpublishable = 0
        """So many results more cannot be published."""
        self.hold = threading.Event()
        self.hold.set()
        self.find_mount = MountFinder("", lambda target, source: None)
        self.pipeline = Pipeline(CONFIG)
        self.pipeline.pair(Calibration(0, "cam", CAMERA))
        self.scheduler = Scheduler(
            self.pipeline, CONFIG, find_mount=self._mount, publish=self._publish, failed=self.failures.append
        )
        self.scheduler.worker.start()

    def _mount(self, frame_id):
        """Where the worker is stopped by the tests: after it has built a frame, before it registers it."""
        assert self.hold.wait(30.0)
        return self.find_mount(frame_id)

    def _publish(self, result, base):
        if self.unpublishable:
            self.unpublishable -= 1
            raise OSError("cannot be published")
        self.results.append(result)

    def receive(self, role, pixels, stamp_ns):
        message = through_ros_2_bag(encode_image(pixels, stamp_ns=stamp_ns, frame_id="cam"))
        return self.scheduler.receive(role, message, arrived_s=time.monotonic())

    def send(self, view, number):
        stamp_ns = START_NS + number * STEP_NS
        self.receive("image", view[0], stamp_ns)
        self.receive("depth", view[1], stamp_ns)
        return stamp_ns

    def wait(self, count):
        self.wait_until(lambda: len(self.results) >= count)
        return [result.state.value for result in self.results]

    def wait_until_busy(self):
        worker = self.scheduler.worker
        self.wait_until(lambda: worker.ready.is_set() and worker.is_busy)

    def wait_until(self, is_true):
        end_s = time.monotonic() + 60.0
        while not is_true():
            assert time.monotonic() < end_s, f"only {self.results}"
            time.sleep(0.005)


@pytest.fixture
def harness():
    one = Harness()
    yield one
    one.hold.set()
    assert one.scheduler.stop(30.0)


def test_the_newest_frame_wins_and_each_has_one_answer(harness, views):
    harness.hold.clear()
    stamps = [harness.send(views[number], number) for number in range(4)]
    harness.hold.set()
    assert sorted(harness.wait(4)) == ["DROPPED", "DROPPED", "STARTED", "TRACKING"]
    by_stamp = {result.stamp_ns: result.state.value for result in harness.results}
    assert [by_stamp[stamp] for stamp in stamps] == ["STARTED", "DROPPED", "DROPPED", "TRACKING"]


def test_a_reset_discards_what_runs_and_what_waits(harness, views):
    harness.hold.clear()
    harness.send(views[0], 0)
    harness.wait_until_busy()
    harness.send(views[1], 1)
    harness.scheduler.reset()
    harness.send(views[2], 0)
    harness.hold.set()
    assert harness.wait(3) == ["DISCARDED", "DISCARDED", "STARTED"]
    assert harness.results[-1].session > 0
    assert not any(result.has_pose for result in harness.results[:2])


def test_pauses_and_keyframes_on_request(harness, views):
    harness.send(views[0], 0)
    harness.wait(1)
    harness.scheduler.pause(True)
    harness.send(views[1], 1)
    assert harness.wait(2)[-1] == "PAUSED"
    harness.scheduler.pause(False)
    harness.scheduler.request_keyframe()
    harness.send(views[2], 2)
    assert harness.wait(3)[-1] == "TRACKING"
    assert harness.results[-1].new_keyframe


def test_other_options_hold_from_the_next_frame_on(harness, views):
    harness.send(views[0], 0)
    harness.wait(1)
    harness.scheduler.configure(CONFIG.replace({"acceptance.min_overlap": 1.0}), max_rate_hz=0.0)
    harness.send(views[1], 1)
    assert harness.wait(2)[-1] == "LOST"
    assert harness.results[-1].reason == "LOW_OVERLAP"


def test_a_mount_that_is_not_known_refuses_the_frame(harness, views):
    harness.find_mount = MountFinder("base_link", lambda target, source: None)
    harness.send(views[0], 0)
    assert harness.wait(1) == ["REFUSED"]
    assert harness.results[0].reason == "NO_TF"


def test_an_internal_error_costs_one_frame(harness, views):
    def broken_once(frame_id):
        if not harness.failures:
            raise RuntimeError("unforeseen")
        return SensorMount(np.eye(4))

    harness.find_mount = broken_once
    harness.send(views[0], 0)
    assert harness.wait(1) == ["REFUSED"]
    assert harness.results[0].reason == "INTERNAL_ERROR"
    harness.send(views[1], 1)
    assert harness.wait(2)[-1] == "STARTED"


def test_nothing_is_published_after_the_end(harness, views):
    harness.hold.clear()
    harness.send(views[0], 0)
    harness.wait_until_busy()
    assert not harness.scheduler.stop(0.05), "a registration still runs"
    harness.hold.set()
    assert harness.scheduler.stop(30.0)
    assert harness.results == []


def test_stamps_that_do_not_ascend_are_refused_until_a_reset(harness, views):
    harness.send(views[0], 5)
    harness.wait(1)
    harness.send(views[1], 4)
    harness.send(views[1], 5)
    assert harness.wait(3)[1:] == ["REFUSED", "REFUSED"]
    assert [result.reason for result in harness.results[1:]] == ["STAMP_LATE", "STAMP_DUPLICATE"]
    harness.scheduler.reset()
    harness.send(views[1], 4)
    assert harness.wait(4)[-1] == "STARTED"


def test_a_reset_lets_the_next_frame_pass_the_limit_of_the_rate(harness, views):
    harness.scheduler.configure(CONFIG, max_rate_hz=5.0)
    harness.send(views[0], 1500)
    harness.send(views[1], 1501)
    assert sorted(harness.wait(2)) == ["SKIPPED", "STARTED"]
    harness.scheduler.reset()
    harness.send(views[2], 0)  # 100 s earlier, as when a recording is played again
    assert harness.wait(3)[-1] == "STARTED"


def test_an_answer_that_cannot_be_published_costs_one_frame(harness, views):
    harness.unpublishable = 1
    harness.send(views[0], 0)
    assert harness.wait(1) == ["REFUSED"]
    assert harness.results[0].reason == "INTERNAL_ERROR"
    harness.unpublishable = 2  # the answer, and the one that tells of the failure
    harness.send(views[1], 1)
    harness.wait_until(lambda: not harness.scheduler.worker.is_busy)
    harness.send(views[2], 2)
    assert harness.wait(2)[1:] == ["TRACKING"]
    assert [str(failure) for failure in harness.failures] == ["cannot be published"] * 3


def test_a_refusal_that_cannot_be_published_is_reported_and_the_next_frame_comes(harness: Harness, views) -> None:
    harness.send(views[0], 5)
    harness.wait(1)
    harness.unpublishable = 1
    harness.send(views[1], 4)  # late
    harness.send(views[1], 6)
    assert harness.wait(2) == ["STARTED", "TRACKING"]
    assert [str(failure) for failure in harness.failures] == ["cannot be published"]


def test_what_is_returned_is_why_this_message_could_not_be_used(harness, views):
    image, depth_m = views[0]
    stamp_ns = harness.send(views[0], 5)
    late = harness.receive("image", image, stamp_ns - STEP_NS), harness.receive("depth", depth_m, stamp_ns)
    assert [[(one.code, one.leads) for one in received.refusals] for received in late] == [
        [("STAMP_LATE", True)], [("STAMP_DUPLICATE", False)],
    ]  # fmt: skip
    for role, pixels, periods in (("image", image, 1), ("depth", depth_m, 3)):
        assert harness.receive(role, pixels, stamp_ns + periods * STEP_NS).refusals == ()
    assert harness.wait(3).count("REFUSED") == 2, "the late image and the one without depth"
    assert harness.pipeline.refused == {"STAMP_LATE": 1, "STAMP_DUPLICATE": 1, "UNPAIRED": 1}
