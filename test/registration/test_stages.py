# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Timings are collected from outside, and only while somebody records."""

import threading
import time

import pytest

from vigg_ros.registration.stages import OutOfTime, record_stages, stage, time_limit


@stage("slow")
def slow(seconds: float) -> float:
    """Waits."""
    time.sleep(seconds)
    return seconds


@stage("failing")
def failing() -> None:
    raise ValueError("on purpose")


def test_calls_of_a_stage_are_summed_in_order_of_first_use() -> None:
    with record_stages() as timings_ms:
        with pytest.raises(ValueError, match="on purpose"):
            failing()
        assert slow(0.002) == 0.002
        once_ms = timings_ms["slow"]
        slow(0.002)
    assert list(timings_ms) == ["failing", "slow"]
    # A sleep is never shorter than asked for.
    assert once_ms >= 2
    assert timings_ms["slow"] >= once_ms + 2


def test_only_its_own_thread_within_the_block_is_recorded() -> None:
    with record_stages() as outer:
        thread = threading.Thread(target=slow, args=(0,))
        thread.start()
        thread.join()
        assert outer == {}
        with record_stages() as inner:
            slow(0)
        inner_ms = dict(inner)
        slow(0)  # an inner recording does not end the outer one
    slow(0)
    assert list(inner) == list(outer) == ["slow"]
    assert inner == inner_ms


def test_no_stage_begins_once_the_time_is_used_up() -> None:
    with time_limit(0.005):
        assert slow(0.006) == 0.006, "a stage that has begun is finished"
        with pytest.raises(OutOfTime, match=r"0\.005 s was used up before slow"):
            slow(0)
        with pytest.raises(OutOfTime), time_limit(10):  # the earlier end holds
            slow(0)
        with pytest.raises(OutOfTime), time_limit(0):
            slow(0)
    with time_limit(0):
        assert slow(0.001) == 0.001, "no budget is no limit, as outside"
    assert (slow.__name__, slow.__doc__) == ("slow", "Waits.")
