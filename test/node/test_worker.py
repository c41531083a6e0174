# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The worker: newest jobs first, nothing lost without being told, and a prompt end."""

import threading

import pytest

from vigg_ros.node.worker import Worker


class Bench:
    """Jobs are numbers; each waits for its release."""

    def __init__(self, failed=None):
        self.begun = []
        self.failures = []
        self._release = threading.Semaphore(0)
        self._progress = threading.Condition()
        self.worker = Worker(self._work, failed=failed or self.failures.append)
        self.worker.start()

    def _work(self, job):
        with self._progress:
            self.begun.append(job)
            self._progress.notify_all()
        self._release.acquire()
        if job < 0:
            raise ValueError(job)

    def wait_for_begun(self, count):
        with self._progress:
            assert self._progress.wait_for(lambda: len(self.begun) >= count, 10.0)

    def finish(self, count):
        self._release.release(count)


@pytest.fixture
def bench():
    one = Bench()
    yield one
    one.finish(100)
    assert one.worker.stop(10.0)


def test_the_newest_job_displaces_those_that_wait(bench):
    assert bench.worker.offer([1]) == []
    bench.wait_for_begun(1)
    assert bench.worker.offer([2]) == []
    assert bench.worker.offer([3]) == [2]
    bench.finish(2)
    bench.wait_for_begun(2)
    assert bench.begun == [1, 3]


def test_a_job_for_an_idle_thread_is_not_displaced(bench):
    assert bench.worker.offer([1]) == []
    # However soon the next one comes, before the thread has woken up or after.
    assert bench.worker.offer([2]) == []
    bench.finish(2)
    bench.wait_for_begun(2)
    assert bench.begun == [1, 2]


def test_jobs_brought_together_do_not_displace_each_other(bench):
    bench.worker.offer([1, 2, 3])
    bench.finish(3)
    bench.wait_for_begun(3)
    assert bench.begun == [1, 2, 3]


def test_jobs_can_be_taken_back(bench):
    bench.worker.offer([1, 2])
    assert bench.worker.withdraw() == [2]
    assert bench.worker.is_busy


def test_a_job_that_fails_does_not_end_the_thread(bench):
    bench.worker.offer([-1, 2])
    bench.finish(2)
    bench.wait_for_begun(2)
    assert [type(failure) for failure in bench.failures] == [ValueError]


def test_stop_says_whether_a_job_still_runs(bench):
    bench.worker.offer([1, 2])
    bench.wait_for_begun(1)
    assert not bench.worker.stop(0.01)
    bench.finish(2)
    assert bench.worker.stop(10.0)
    assert bench.begun == [1], "what waited is not begun any more"


def test_the_thread_prepares_before_the_first_job():
    order = []
    worker = Worker(order.append, failed=order.append, prepare=lambda: order.append("prepared"))
    worker.offer([1])
    worker.start()
    assert worker.ready.wait(10.0)
    worker.stop(10.0)
    assert order[0] == "prepared"


def test_a_failure_that_cannot_be_reported_does_not_end_the_thread(caplog):
    bench = Bench(failed=lambda error: [].remove(error))
    bench.worker.offer([-1, 2])
    bench.finish(2)
    bench.wait_for_begun(2)
    assert bench.worker.stop(10.0)
    assert not bench.worker.is_busy
    assert "ValueError: -1" in caplog.text
    assert "list.remove(x): x not in list" in caplog.text
