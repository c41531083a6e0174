# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The alternatives run, with target and source the right way round; those whose library is missing are skipped."""

from __future__ import annotations

import dataclasses
import importlib.util

import numpy as np
import pytest

from vigg_ros.bench import methods
from vigg_ros.bench.alternatives import BASELINES, refine_truth
from vigg_ros.bench.catalogue import find_method
from vigg_ros.bench.frame_cache import FrameCache, LoadedFrame
from vigg_ros.bench.pairs import FramePair
from vigg_ros.registration import Config, ConfigError
from vigg_ros.report.trajectory_errors import rotation_error_deg, translation_error_m
from vigg_ros_testing import street_samples
from vigg_ros_testing.pair_samples import CONFIG, room_pair

CACHE = FrameCache()
NEAR = room_pair(0.0, 0.1)
"""6 cm and 6 deg: what methods without features can do."""


def run(name, pair, config=CONFIG):
    method = find_method(name)
    if method.library and importlib.util.find_spec(method.library) is None:
        pytest.skip(f"{method.library} is not installed")
    return method.answer(methods.Task(pair, CACHE, config))


@pytest.mark.parametrize(
    ("name", "within_deg", "within_m"),
    [
        ("icp-point", 3.0, 0.06),
        ("icp-plane", 1.5, 0.03),
        ("gicp", 1.5, 0.03),
        ("rgbd-odometry", 1.5, 0.03),
        ("floor", 1.5, 0.03),
        ("kiss-matcher", 5.0, 0.15),
        ("fpfh-ransac", 10.0, 0.3),
        ("fpfh-mac", 5.0, 0.15),
    ],
)
def test_a_near_pair_is_registered(name, within_deg, within_m):
    answer = run(name, NEAR)
    assert answer.T_target_source is not None
    # A quarter of a Kinect's pixels with its noise: a few degrees for those that match features of a 5 cm grid.
    assert rotation_error_deg(answer.T_target_source, NEAR.T_target_source) < within_deg
    assert translation_error_m(answer.T_target_source, NEAR.T_target_source) < within_m
    assert min(answer.timings_ms.values()) > 0


ON_ONE_CORE = ("kiss-matcher", "rgbd-odometry")
"""They repeat themselves only on one core, as the runner has it."""


@pytest.mark.parametrize("name", [name for name in BASELINES if name not in ON_ONE_CORE])
def test_the_same_pair_gets_the_same_answer(name):
    first, second = run(name, NEAR), run(name, NEAR)
    # Sums of parallel libraries come in any order, so the last digits may differ.
    np.testing.assert_allclose(first.T_target_source, second.T_target_source, rtol=0, atol=1e-9)


def test_rgbd_odometry_says_that_scans_have_no_depth_image():
    frame = street_samples.frame_along(0.0)
    pair = FramePair("g", LoadedFrame("a", frame), LoadedFrame("b", frame), np.eye(4))
    assert run("rgbd-odometry", pair, Config.preset("lidar")).reason == "NO_DEPTH_IMAGE"


def test_a_truth_that_is_off_is_refined_towards_the_depth():
    pytest.importorskip("small_gicp")
    T_off = NEAR.T_target_source.copy()
    T_off[:3, 3] += 0.02
    refined = refine_truth(methods.Task(dataclasses.replace(NEAR, T_target_source=T_off), CACHE, CONFIG))
    # 3.5 cm off before.
    assert translation_error_m(refined.T_target_source, NEAR.T_target_source) < 0.015
    assert refined.name == NEAR.name


def test_a_missing_library_is_said_before_anything_runs(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(methods, "_is_installed", lambda library: library != "kiss_matcher")
    chosen = [find_method(name) for name in ("default", "kiss-matcher")]
    with pytest.raises(ConfigError, match=r"kiss-matcher \(needs kiss_matcher\).*pip install"):
        methods.require(chosen)
    methods.require(chosen[:1])
