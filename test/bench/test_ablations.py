# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Variations of the method change what they say and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from vigg_ros.bench.ablations import BASE_METHODS, VARIATIONS, Variation, icp, near_truth, register_varied, with_noise
from vigg_ros.bench.catalogue import all_names, expand, find_method
from vigg_ros.bench.frame_cache import FrameCache
from vigg_ros.bench.methods import Task
from vigg_ros.registration import ConfigError, Registration, register
from vigg_ros.registration.cliques import Hypotheses
from vigg_ros.registration.matches import Matches
from vigg_ros.registration.rigid import inverse, transform
from vigg_ros.report.trajectory_errors import rotation_error_deg, translation_error_m
from vigg_ros_testing.pair_samples import CONFIG, room_pair
from vigg_ros_testing.trajectory_samples import pose

PAIR = room_pair()
CACHE = FrameCache()


OURS = [name for name in all_names() if name.startswith(("default", "whole", "paper"))]
OF_STREETS = ("zone-0.3", "zone-0.6", "zone-1.2")
"""Zones as large as the things in a room find anything in them."""


@pytest.mark.parametrize("name", [name for name in OURS if not name.endswith(OF_STREETS)])
def test_each_variation_registers_an_easy_pair(name):
    answer = find_method(name).answer(Task(PAIR, CACHE, CONFIG))
    assert answer.T_target_source is not None, answer.reason
    # The walk is 0.3 m here. Without guidance or with 2.5 cm of noise centimetres of the clique's own error are left.
    assert translation_error_m(answer.T_target_source, PAIR.T_target_source) < 0.08
    assert rotation_error_deg(answer.T_target_source, PAIR.T_target_source) < 3.0
    assert {"extraction", "visual matches", "cliques", "other"} <= set(answer.timings_ms)


@pytest.mark.parametrize("base", ["whole", "paper"])
def test_with_nothing_exchanged_the_answer_is_that_of_register(base):
    config = CONFIG.replace(BASE_METHODS[base][1])
    features = CACHE.features(PAIR.target, config)[0], CACHE.features(PAIR.source, config)[0]
    expected = register(*features, config)
    found = register_varied(features, config, Variation("nothing"), PAIR)
    assert isinstance(expected, Registration)
    assert isinstance(found, Registration)
    np.testing.assert_array_equal(found.T_target_source, expected.T_target_source)


def test_options_are_changed_as_the_paper_has_them():
    assert VARIATIONS["no-guidance"].options == {"cliques.geometric_guidance": False, "local_match.iterations": 0}
    assert VARIATIONS["gamma2-5"].options == {"local_match.gamma_squared": 5.0}
    assert VARIATIONS["zone-0.6"].options == {"local_match.fixed_zone_m": 0.6}
    assert VARIATIONS["sample-1000"].options == {"geometric.sample_k": 1000}
    for variation in VARIATIONS.values():
        CONFIG.replace(variation.options)  # all within bounds


def test_noise_has_the_deviation_it_says_and_is_the_same_each_time():
    points, rows = np.zeros((3000, 3)), np.arange(3000)
    matches = Matches(points, points, np.ones(3000), rows, rows)
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


def test_sets_hold_what_makes_sense_for_the_sensor():
    indoor = [method.name for method in expand(["paper-ablations", "baselines", "paper"], outdoor=False)]
    outdoor = [method.name for method in expand(["paper-ablations", "baselines"], outdoor=True)]
    assert indoor.count("paper") == 1
    assert {"paper:zone-0.1", "rgbd-odometry", "paper:sample-10000"} <= set(indoor) - set(outdoor)
    assert {"paper:zone-0.6", "paper:within-view", "paper:sample-5000"} <= set(outdoor) - set(indoor)
    assert not {"paper:gamma2-10", "paper:iterations-3", "floor"} & {*indoor, *outdoor}
    assert [m.name for m in expand(["ablations"], outdoor=False)][:2] == ["whole", "whole:no-guidance"]


@pytest.mark.parametrize("name", ["papr", "paper:no-gvc", "floor:icp", "", "whole:"])
def test_unknown_methods_are_refused_with_the_nearest_one(name):
    with pytest.raises(ConfigError, match="unknown method"):
        expand([name], outdoor=False)


def test_fingerprints_change_with_options_and_methods_and_nothing_else():
    method = find_method("default")
    assert method.fingerprint(CONFIG) == find_method("default").fingerprint(CONFIG.replace({}))
    assert method.fingerprint(CONFIG) != method.fingerprint(CONFIG.replace({"visual.top_k": 151}))
    assert method.fingerprint(CONFIG) != find_method("paper").fingerprint(CONFIG)
