# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Our method's variations and other libraries, on pairs whose motion is known; what is not installed is skipped."""

import dataclasses
import importlib.util

import numpy as np
import pytest

from vigg_ros.bench import methods
from vigg_ros.bench.ablations import BASE_METHODS, VARIATIONS, Variation, icp, near_truth, register_varied, with_noise
from vigg_ros.bench.alternatives import BASELINES, refine_truth
from vigg_ros.bench.catalogue import all_names, expand, find_method
from vigg_ros.bench.frame_cache import FrameCache, LoadedFrame
from vigg_ros.bench.methods import Task
from vigg_ros.bench.pairs import FramePair
from vigg_ros.registration import Config, ConfigError, Registration, register
from vigg_ros.registration.cliques import Hypotheses
from vigg_ros.registration.matches import Matches
from vigg_ros.registration.rigid import inverse, transform
from vigg_ros.report.trajectory_errors import rotation_error_deg, translation_error_m
from vigg_ros_testing import street_samples
from vigg_ros_testing.pair_samples import CONFIG, room_pair
from vigg_ros_testing.trajectory_samples import pose

CACHE = FrameCache()
PAIR, NEAR_PAIR = room_pair(), room_pair(0.0, 0.1)
"""0.3 m apart; and 6 cm and 6 deg, which methods without features can do."""

STREET_VARIATIONS = ("zone-0.3", "zone-0.6", "zone-1.2")
"""Zones as large as the things in a room find anything in them."""

NEAR_LIMITS = {
    "icp-point": (3.0, 0.06), "icp-plane": (1.5, 0.03), "gicp": (1.5, 0.03), "rgbd-odometry": (1.5, 0.03),
    "floor": (1.5, 0.03), "kiss-matcher": (5.0, 0.15), "fpfh-ransac": (10.0, 0.3), "fpfh-mac": (5.0, 0.15),
}  # fmt: skip
"""In deg and m: a few for those that match features of a 5 cm grid in a quarter of a Kinect's pixels."""

ONE_CORE_METHODS = ("kiss-matcher", "rgbd-odometry")
"""They repeat themselves only on one core, as the runner has it."""


def run(name, pair, config=CONFIG):
    method = find_method(name)
    if method.library and importlib.util.find_spec(method.library) is None:
        pytest.skip(f"{method.library} is not installed")
    return method.answer(Task(pair, CACHE, config))


@pytest.mark.parametrize(
    ("name", "pair", "within_deg", "within_m"),
    [
        # Without guidance or with 2.5 cm of noise centimetres of the clique's own error are left.
        *((n, PAIR, 3.0, 0.08) for n in all_names() if n not in BASELINES and not n.endswith(STREET_VARIATIONS)),
        *((name, NEAR_PAIR, *limits) for name, limits in NEAR_LIMITS.items()),
    ],
)
def test_an_easy_pair_is_registered(name, pair, within_deg, within_m):
    answer = run(name, pair)
    assert answer.T_target_source is not None, answer.reason
    assert rotation_error_deg(answer.T_target_source, pair.T_target_source) < within_deg
    assert translation_error_m(answer.T_target_source, pair.T_target_source) < within_m
    if name in BASELINES:
        assert min(answer.timings_ms.values()) > 0
    else:
        assert {"extraction", "visual matches", "cliques", "other"} <= set(answer.timings_ms)


@pytest.mark.parametrize("name", [name for name in BASELINES if name not in ONE_CORE_METHODS])
def test_the_same_pair_gets_the_same_answer(name):
    first, second = run(name, NEAR_PAIR), run(name, NEAR_PAIR)
    # Sums of parallel libraries come in any order, so the last digits may differ.
    np.testing.assert_allclose(first.T_target_source, second.T_target_source, rtol=0, atol=1e-9)


@pytest.mark.parametrize("base", ["whole", "paper"])
def test_with_nothing_exchanged_the_answer_is_that_of_register(base):
    config = CONFIG.replace(BASE_METHODS[base][1])
    target, source, _ = Task(PAIR, CACHE, config).features(config)
    expected = register(target, source, config)
    found = register_varied((target, source), config, Variation("nothing"), PAIR)
    assert isinstance(expected, Registration)
    assert isinstance(found, Registration)
    np.testing.assert_array_equal(found.T_target_source, expected.T_target_source)


def test_options_are_changed_as_the_paper_has_them():
    assert VARIATIONS["no-guidance"].options == {"cliques.geometric_guidance": False, "local_match.iterations": 0}
    assert VARIATIONS["gamma2-5"].options == {"local_match.gamma_squared": 5.0}
    assert VARIATIONS["zone-0.6"].options == {"local_match.fixed_zone_m": 0.6}
    assert VARIATIONS["sample-10000"].options == {"geometric.sample_k": 10000}
    for variation in VARIATIONS.values():
        CONFIG.replace(variation.options)  # all within bounds


def test_noise_has_the_deviation_it_says_and_is_the_same_each_time():
    points, rows = np.zeros((3000, 3)), np.arange(3000)
    matches = Matches(points, points, np.ones(3000), rows, rows, np.zeros(3000))
    noisy = with_noise(matches, 0.025, seed=1)
    # 9,000 draws: the deviation is known to 0.7 %, 3 sigma.
    assert np.std(noisy.source) == pytest.approx(0.025, rel=0.025)
    np.testing.assert_array_equal(noisy.target, matches.target)
    np.testing.assert_array_equal(with_noise(matches, 0.025, seed=1).source, noisy.source)
    assert with_noise(matches, 0.0, seed=1) is matches


def test_only_cliques_near_the_truth_stay():
    motions = np.array([pose(0.29), pose(0.31), pose(yaw_deg=14), pose(yaw_deg=16)])
    kept = near_truth(Hypotheses(motions, np.arange(4.0)), np.eye(4), 0.1)
    assert kept.score.tolist() == [0, 2]


def test_icp_closes_a_small_gap_and_stays_where_nothing_is_near():
    target = np.random.default_rng(0).uniform(0, 3, (400, 3))
    T_true = pose(0.03, -0.02, 0.01, yaw_deg=1)
    source = transform(inverse(T_true), target)
    np.testing.assert_allclose(icp(target, source, np.eye(4), 0.1), T_true, atol=1e-9)
    np.testing.assert_array_equal(icp(target, source + 100, np.eye(4), 0.1), np.eye(4))


def test_rgbd_odometry_says_that_scans_have_no_depth_image():
    frame = street_samples.frame_along(0.0)
    pair = FramePair("g", LoadedFrame("a", frame), LoadedFrame("b", frame), np.eye(4))
    assert run("rgbd-odometry", pair, Config.preset("lidar")).reason == "NO_DEPTH_IMAGE"


def test_a_truth_that_is_off_is_refined_towards_the_depth():
    pytest.importorskip("small_gicp")
    T_off = NEAR_PAIR.T_target_source.copy()
    T_off[:3, 3] += 0.02  # 3.5 cm
    refined = refine_truth(Task(dataclasses.replace(NEAR_PAIR, T_target_source=T_off), CACHE, CONFIG))
    assert translation_error_m(refined.T_target_source, NEAR_PAIR.T_target_source) < 0.015
    assert refined.name == NEAR_PAIR.name


def test_sets_hold_what_makes_sense_for_the_sensor():
    indoor = [method.name for method in expand(["paper-ablations", "baselines", "paper"], outdoor=False)]
    outdoor = [method.name for method in expand(["paper-ablations", "baselines"], outdoor=True)]
    assert indoor.count("paper") == 1
    assert {"paper:zone-0.1", "rgbd-odometry", "paper:sample-10000"} <= set(indoor) - set(outdoor)
    assert {"paper:zone-0.6", "paper:within-view", "paper:sample-5000"} <= set(outdoor) - set(indoor)
    assert not {"paper:gamma2-10", "paper:iterations-3", "floor"} & {*indoor, *outdoor}
    assert [m.name for m in expand(["ablations"], outdoor=False)][:2] == ["whole", "whole:no-guidance"]


@pytest.mark.parametrize(
    ("name", "hint"),
    [("papr", "did you mean paper"), ("paper:no-gvc", "no-gvca"), ("floor:icp", ""), ("", "see `vigg")],
)
def test_unknown_methods_are_refused_with_the_nearest_one(name, hint):
    with pytest.raises(ConfigError, match=f"unknown method.*{hint}"):
        expand([name], outdoor=False)


def test_a_missing_library_is_said_before_anything_runs(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(methods, "_is_installed", lambda library: library != "kiss_matcher")
    chosen = [find_method(name) for name in ("default", "kiss-matcher")]
    with pytest.raises(ConfigError, match=r"kiss-matcher \(needs kiss_matcher\).*pip install"):
        methods.require(chosen)
    methods.require(chosen[:1])


def test_fingerprints_change_with_options_and_methods_and_nothing_else():
    prints = {name: find_method(name).fingerprint(CONFIG) for name in all_names()}
    assert len(set(prints.values())) == len(prints)
    assert prints["default"] == find_method("default").fingerprint(CONFIG.replace({}))
    assert prints["default"] != find_method("default").fingerprint(CONFIG.replace({"visual.top_k": 151}))
