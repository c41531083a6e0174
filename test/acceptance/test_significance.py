# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of false alarms against binomials in closed form, and against matches that are wrong by construction."""

import math

import numpy as np
import pytest
from scipy.stats import binom

from vigg_ros.acceptance.agreement import inliers_of
from vigg_ros.acceptance.significance import (
    MINIMAL,
    cell_weights,
    log10_joint,
    log10_tail,
    log10_triples,
    log10_type_probability,
    wrong_pairings,
)
from vigg_ros.registration import Config
from vigg_ros.registration.cliques import propose
from vigg_ros.registration.matches import Matches, no_matches

CONFIG = Config()


@pytest.mark.parametrize("trials", [20, 150, 500])
@pytest.mark.parametrize("chance", [0.002, 0.05, 0.4])
def test_the_tail_bounds_the_binomial_and_follows_it(trials, chance):
    agreeing = np.arange(trials + 1)
    exact = binom.logsf(agreeing - 1, trials, chance) / math.log(10)
    bound = log10_tail(agreeing, trials, chance)
    assert (bound >= exact - 1e-9).all()
    assert bound[-1] == pytest.approx(trials * math.log10(chance)), "all of them: p^n"
    # Chernoff's bound is off by a factor of the order of sqrt(n) only, where the binomial can be computed.
    known = exact > -300
    assert (bound - exact)[known].max() < 0.5 * math.log10(trials) + 0.5
    assert (bound[agreeing <= trials * chance] == 0).all()


def test_two_outcomes_are_the_tail_and_the_joint_probability_of_one_is_its_own():
    shares, chances = np.array((0.3, 0.7)), np.array((0.1, 0.9))
    assert log10_type_probability(shares, 50, chances) == pytest.approx(float(log10_tail(15, 50, 0.1)))
    assert log10_joint((-4.0,)) == pytest.approx(-4.0)
    # Of two uniform variables P(product <= x) = x (1 - ln x).
    assert 10 ** log10_joint((-1.0, -2.0)) == pytest.approx(1e-3 * (1 - math.log(1e-3)))
    assert log10_joint((0.0, 0.0)) == 0


def test_neighbours_count_as_one():
    points = np.array([(0.01, 0, 0), (0.09, 0.05, 0), (0.11, 0, 0), (-0.01, 0, 0), (5, 5, 5)])
    assert cell_weights(points, 0.1).tolist() == [0.5, 0.5, 1, 1, 1]
    assert len(cell_weights(np.empty((0, 3)), 0.1)) == 0


def random_matches(rng, count, side_m=0.7):
    """Points of a cube on either side, matched at random: one of 81 agrees with most motions by chance."""
    target, source = (rng.uniform(-side_m / 2, side_m / 2, (count, 3)) for _ in range(2))
    return Matches(target, source, np.ones(count), np.arange(count), np.arange(count), np.zeros(count))


@pytest.mark.parametrize("count", [2, 1, 0, 40])
def test_no_wrong_pairing_is_a_match(count):
    wrong = wrong_pairings(random_matches(np.random.default_rng(0), count))
    assert (wrong.target_row != wrong.source_row).all()
    assert (len(wrong) > 0) == (count > 1)


def test_random_matches_raise_fewer_false_alarms_than_the_level():
    """Of the best of all cliques of matches that are all wrong, whose number is tried in each of 60 draws."""
    best, most = [], 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        matches = random_matches(rng, 80)
        motions = propose(matches, no_matches(), CONFIG.cliques).T_target_source
        wrong = wrong_pairings(matches)
        chance = np.mean([np.mean(inliers_of(wrong, T, CONFIG)) for T in motions]) + 1 / len(wrong)
        agreeing = max(np.count_nonzero(inliers_of(matches, T, CONFIG)) for T in motions)
        tail = float(log10_tail(max(agreeing - MINIMAL, 0), len(matches) - MINIMAL, float(chance)))
        best.append(log10_triples(len(matches)) + tail)
        most = max(most, agreeing)
    assert most >= 6, "some agree beyond the three that fix a motion, or nothing was tested"
    for level in (0, -1):
        assert np.mean(np.array(best) <= level) <= 10.0**level
    assert min(best) < 3, "the bound is not idle"
