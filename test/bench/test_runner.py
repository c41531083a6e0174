# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs are repeatable, can be taken up again, and survive frames that cannot be used."""

import dataclasses
import importlib.util
import math
import os

import pytest

from vigg_ros.bench.frame_cache import FrameCache
from vigg_ros.bench.pair_results import ResultFile
from vigg_ros.bench.pairs import FramePair
from vigg_ros.bench.runner import EvaluationPlan, count_missing, one_thread_each, run_pair, run_plan
from vigg_ros_testing.pair_samples import CONFIG, UnreadableFrame, result, room_pair
from vigg_ros_testing.trajectory_samples import pose

PLAN = EvaluationPlan("room", [room_pair(), room_pair(0.0, 0.8)], ["default", "paper:noise-0.01"], CONFIG)


def run(plan, path, jobs=1):
    steps = []
    with ResultFile.open(path) as file:
        return run_plan(plan, file, jobs=jobs, step=lambda: steps.append(1)), len(steps)


def figures(results):
    """All but the times, as text: a method without a covariance has NaN, which equals nothing."""
    return [repr(dataclasses.replace(result, timings_ms={})) for result in results]


def test_runs_repeat_themselves_and_are_taken_up_where_they_were_stopped(tmp_path):
    first, steps = run(PLAN, tmp_path / "first.jsonl", jobs=2)
    assert steps == 4
    assert [(one.method, one.source) for one in first] == [
        ("default", "0.4"), ("default", "0.8"), ("paper:noise-0.01", "0.4"), ("paper:noise-0.01", "0.8"),
    ]  # fmt: skip
    assert all(one.translation_error_m < 0.05 for one in first)
    with ResultFile.open(tmp_path / "second.jsonl") as file:
        kept = result(0.5, 0.01, method="default")
        file.add(PLAN.keys()["default", PLAN.pairs[0].name], kept)
        assert count_missing(PLAN, file) == 3
    second, steps = run(PLAN, tmp_path / "second.jsonl")
    assert (steps, second[0]) == (3, kept)
    assert figures(second[1:]) == figures(first[1:])
    # Frames that are to be registered would have to be loaded, and these cannot be.
    unreadable = [
        dataclasses.replace(pair, target=UnreadableFrame(pair.target.name), source=UnreadableFrame(pair.source.name))
        for pair in PLAN.pairs
    ]
    assert run(dataclasses.replace(PLAN, pairs=unreadable), tmp_path / "first.jsonl") == (first, 0)


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system cannot keep a process to one core")
@pytest.mark.parametrize(("name", "library"), [("kiss-matcher", "kiss_matcher"), ("rgbd-odometry", "open3d")])
def test_libraries_repeat_themselves_on_one_core(name, library, tmp_path):
    if importlib.util.find_spec(library) is None:
        pytest.skip(f"{library} is not installed")
    plan = dataclasses.replace(PLAN, methods=[name])
    first, second = (run(plan, tmp_path / f"{jobs}.jsonl", jobs)[0] for jobs in (1, 2))
    assert figures(first) == figures(second)


@pytest.mark.parametrize(
    "changes",
    [
        {"subject": "another"}, {"within_view": True}, {"refine_truth": True},
        {"config": CONFIG.replace({"visual.top_k": 99})},
        {"pairs": [dataclasses.replace(pair, T_target_source=pose(1)) for pair in PLAN.pairs]},
    ],
)  # fmt: skip
def test_results_are_those_of_their_subject_truth_conditions_and_options(changes):
    assert not set(PLAN.keys().values()) & set(dataclasses.replace(PLAN, **changes).keys().values())


def test_a_frame_that_cannot_be_read_costs_its_pair():
    broken = FramePair("g", room_pair().target, UnreadableFrame("broken"), pose())
    (found,) = run_pair(broken, ["default"], PLAN, FrameCache())
    assert (found.reason, found.rotation_error_deg, found.total_ms) == ("UNREADABLE", math.inf, 0)


def test_the_error_is_compared_with_the_covariance_of_those_that_claim_one():
    claimed, silent = run_pair(room_pair(), ["default", "icp-plane"], PLAN, FrameCache())
    assert 0 < claimed.nees < 100
    assert silent.is_answered
    assert math.isnan(silent.nees)


def test_features_are_made_once_for_all_methods_and_charged_to_each():
    first, second = run_pair(room_pair(), ["whole", "whole:no-gvca"], PLAN, FrameCache())
    assert first.timings_ms["extraction"] == second.timings_ms["extraction"] > 0


def test_the_environment_is_left_as_it_was(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    with one_thread_each():
        assert os.environ["OMP_NUM_THREADS"] == os.environ["MKL_NUM_THREADS"] == "1"
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ
