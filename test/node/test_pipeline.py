# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The pipeline: one answer for each leading message, whatever comes in between."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from vigg_ros.bench.worlds import HandheldLoop, render_rgbd, room
from vigg_ros.node.answer import Answer
from vigg_ros.node.scheduler import Pipeline
from vigg_ros.tracking.sensor_mount import Mount, MountFinder
from vigg_ros.registration.camera import Camera
from vigg_ros.registration.config import Config
from vigg_ros.sensors.observation import Calibration, ColourImage, DepthImage

CAMERA = Camera(160, 120, 131.0, 131.0, 79.5, 59.5)
START_NS, STEP_NS = 10**18, 66_666_667
CHEAP = Config().replace({"visual.detector": "orb", "geometric.voxel_size_m": 0.06, "geometric.sample_k": 800})


@pytest.fixture(scope="module")
def views() -> list[tuple[NDArray[np.uint8], NDArray[np.float32]]]:
    world, path = room(seed=2), HandheldLoop()
    return [render_rgbd(world, CAMERA, path.T_world_camera(number / 15)) for number in range(6)]


class Bench:
    """A pipeline, and what it answers."""

    def __init__(self, find_mount: Callable[[str], Mount]) -> None:
        self.answers: list[Answer] = []
        self.failures: list[BaseException] = []
        self.unpublishable = 0
        """So many answers more cannot be published."""
        self.hold = threading.Event()
        self.hold.set()
        self._find_mount = find_mount
        self.pipeline = Pipeline(
            CHEAP,
            extrinsics=None,
            find_mount=self._mount,
            publish=self._publish,
            failed=self.failures.append,
        )
        self.pipeline.worker.start()
        self.pipeline.add(Calibration(0, "cam", CAMERA), arrived_s=time.monotonic())

    def _mount(self, frame_id: str) -> Mount:
        """Where the worker is stopped by the tests: after it has built a frame, before it registers it."""
        assert self.hold.wait(30.0)
        return self._find_mount(frame_id)

    def _publish(self, answer: Answer) -> None:
        if self.unpublishable:
            self.unpublishable -= 1
            raise OSError("cannot be published")
        self.answers.append(answer)

    def send(self, view: tuple[NDArray[np.uint8], NDArray[np.float32]], number: int) -> int:
        stamp_ns = START_NS + number * STEP_NS
        now_s = time.monotonic()
        self.pipeline.add(ColourImage(stamp_ns, "cam", view[0]), arrived_s=now_s)
        self.pipeline.add(DepthImage(stamp_ns, "cam", view[1]), arrived_s=now_s)
        return stamp_ns

    def wait(self, count: int) -> list[str]:
        end_s = time.monotonic() + 60.0
        while len(self.answers) < count:
            assert time.monotonic() < end_s, f"only {self.answers}"
            time.sleep(0.005)
        return [answer.state for answer in self.answers]

    def wait_until_idle(self) -> None:
        end_s = time.monotonic() + 60.0
        while self.pipeline.worker.is_busy:
            assert time.monotonic() < end_s
            time.sleep(0.005)

    def wait_until_busy(self) -> None:
        end_s = time.monotonic() + 60.0
        while not (self.pipeline.worker.ready.is_set() and self.pipeline.worker.is_busy):
            assert time.monotonic() < end_s
            time.sleep(0.005)


@pytest.fixture
def bench() -> Iterator[Bench]:
    one = Bench(MountFinder("", lambda target, source: None))
    yield one
    one.hold.set()
    assert one.pipeline.stop(30.0)


def test_the_newest_frame_wins_and_each_has_one_answer(bench: Bench, views) -> None:
    bench.hold.clear()
    stamps = [bench.send(views[number], number) for number in range(4)]
    bench.hold.set()
    assert sorted(bench.wait(4)) == ["DROPPED", "DROPPED", "STARTED", "TRACKING"]
    by_stamp = {answer.stamp_ns: answer.state for answer in bench.answers}
    assert [by_stamp[stamp] for stamp in stamps] == ["STARTED", "DROPPED", "DROPPED", "TRACKING"]


def test_a_reset_discards_what_runs_and_what_waits(bench: Bench, views) -> None:
    bench.hold.clear()
    bench.send(views[0], 0)
    bench.wait_until_busy()
    bench.send(views[1], 1)
    bench.pipeline.reset()
    bench.send(views[2], 0)
    bench.hold.set()
    assert bench.wait(3) == ["DISCARDED", "DISCARDED", "STARTED"]
    assert bench.answers[-1].session > 0
    assert not any(answer.has_pose for answer in bench.answers[:2])


def test_pauses_and_keyframes_on_request(bench: Bench, views) -> None:
    bench.send(views[0], 0)
    bench.wait(1)
    bench.pipeline.pause(True)
    bench.send(views[1], 1)
    assert bench.wait(2)[-1] == "PAUSED"
    bench.pipeline.pause(False)
    bench.pipeline.request_keyframe()
    bench.send(views[2], 2)
    assert bench.wait(3)[-1] == "TRACKING"
    assert bench.answers[-1].estimate is not None
    assert bench.answers[-1].estimate.new_keyframe


def test_other_options_hold_from_the_next_frame_on(bench: Bench, views) -> None:
    bench.send(views[0], 0)
    bench.wait(1)
    bench.pipeline.configure(CHEAP.replace({"verification.min_inliers": 1000}), max_rate_hz=0.0)
    bench.send(views[1], 1)
    assert bench.wait(2)[-1] == "LOST"
    assert bench.answers[-1].reason == "TOO_FEW_INLIERS"


def test_a_mount_that_is_not_known_refuses_the_frame(views) -> None:
    bench = Bench(MountFinder("base_link", lambda target, source: None))
    bench.send(views[0], 0)
    assert bench.wait(1) == ["REFUSED"]
    assert bench.answers[0].reason == "NO_TF"
    assert bench.pipeline.stop(30.0)


def test_an_internal_error_costs_one_frame(views) -> None:
    def broken_once(frame_id: str) -> Mount:
        if not bench.failures:
            raise RuntimeError("unforeseen")
        return Mount(np.eye(4))

    bench = Bench(broken_once)
    bench.send(views[0], 0)
    assert bench.wait(1) == ["REFUSED"]
    assert bench.answers[0].reason == "INTERNAL_ERROR"
    bench.send(views[1], 1)
    assert bench.wait(2)[-1] == "STARTED"
    assert bench.pipeline.stop(30.0)


def test_nothing_is_published_after_the_end(bench: Bench, views) -> None:
    bench.hold.clear()
    bench.send(views[0], 0)
    bench.wait_until_busy()
    assert not bench.pipeline.stop(0.05), "a registration still runs"
    bench.hold.set()
    assert bench.pipeline.stop(30.0)
    assert bench.answers == []


def test_stamps_that_do_not_ascend_are_refused_until_a_reset(bench: Bench, views) -> None:
    bench.send(views[0], 5)
    bench.wait(1)
    bench.send(views[1], 4)
    bench.send(views[1], 5)
    assert bench.wait(3)[1:] == ["REFUSED", "REFUSED"]
    assert [answer.reason for answer in bench.answers[1:]] == ["STAMP_LATE", "STAMP_DUPLICATE"]
    bench.pipeline.reset()
    bench.send(views[1], 4)
    assert bench.wait(4)[-1] == "STARTED"


def test_a_reset_lets_the_next_frame_pass_the_limit_of_the_rate(bench: Bench, views) -> None:
    bench.pipeline.configure(CHEAP, max_rate_hz=5.0)
    bench.send(views[0], 1500)
    bench.send(views[1], 1501)
    assert sorted(bench.wait(2)) == ["SKIPPED", "STARTED"]
    bench.pipeline.reset()
    bench.send(views[2], 0)  # 100 s earlier, as when a recording is played again
    assert bench.wait(3)[-1] == "STARTED"


def test_an_answer_that_cannot_be_published_costs_one_frame(bench: Bench, views) -> None:
    bench.unpublishable = 1
    bench.send(views[0], 0)
    assert bench.wait(1) == ["REFUSED"]
    assert bench.answers[0].reason == "INTERNAL_ERROR"
    bench.unpublishable = 2  # the answer, and the one that tells of the failure
    bench.send(views[1], 1)
    bench.wait_until_idle()
    bench.send(views[2], 2)
    assert bench.wait(2)[1:] == ["TRACKING"]
    assert [str(failure) for failure in bench.failures] == ["cannot be published"] * 2


def test_what_is_returned_is_why_this_observation_could_not_be_used(bench: Bench, views) -> None:
    image, depth_m = views[0]
    stamp_ns = bench.send(views[0], 5)
    now_s = time.monotonic()
    late = ColourImage(stamp_ns - STEP_NS, "cam", image), DepthImage(stamp_ns, "cam", depth_m)
    found = [bench.pipeline.add(one, arrived_s=now_s) for one in late]
    assert [[(one.code, one.leads) for one in refusals] for refusals in found] == [
        [("STAMP_LATE", True)], [("STAMP_DUPLICATE", False)],
    ]  # fmt: skip
    lonely = ColourImage(stamp_ns + STEP_NS, "cam", image), DepthImage(stamp_ns + 3 * STEP_NS, "cam", depth_m)
    assert [bench.pipeline.add(one, arrived_s=now_s) for one in lonely] == [[], []]
    assert bench.wait(3).count("REFUSED") == 2, "the late image and the one without depth"
