# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cliques of graphs whose cliques are known, and hypotheses computed by hand."""

import resource
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from vigg_ros.registration.cliques import Hypotheses, compatibility, differ, distinct, find_cliques, propose, score
from vigg_ros.registration.kernels.maximal_cliques import heaviest_cliques_plain
from vigg_ros.registration.matches import no_matches
from vigg_ros.registration.options import CliqueConfig
from vigg_ros_testing.registration_samples import apply, errors, matches_of, motion

Weights = NDArray[np.float32]


def graph(count: int, edges: list[tuple[int, int, float]]) -> Weights:
    weight = np.zeros((count, count), np.float32)
    for a, b, w in edges:
        weight[a, b] = weight[b, a] = w
    return weight


def symmetric(weight: NDArray[np.floating]) -> Weights:
    """The weights above the diagonal, on both sides of it."""
    upper = np.triu(weight, 1)
    return (upper + upper.T).astype(np.float32)


def by_nodes(adjacency: NDArray[np.bool_], value: NDArray[np.floating]) -> Weights:
    """Weights w_ij = value_i + value_j: a clique of k nodes weighs (k - 1) times the sum of its values."""
    return np.where(adjacency, value[:, None] + value[None], 0).astype(np.float32)


def parts(sizes: list[int]) -> NDArray[np.bool_]:
    """The complete multipartite graph: nodes of the same part are not connected, all others are."""
    part = np.repeat(np.arange(len(sizes)), sizes)
    return np.asarray(part[:, None] != part[None])


def cliques_of(weight: Weights, **options: int) -> set[tuple[int, ...]]:
    found = find_cliques(weight, **options)
    cliques = {tuple(np.flatnonzero(row).tolist()) for row in found}
    assert len(cliques) == len(found), "no clique is given twice"
    return cliques


def is_maximal_clique(clique: tuple[int, ...], weight: Weights) -> bool:
    """All connected, and nobody else connected with all."""
    inside = (weight > 0)[np.ix_(clique, clique)] | np.eye(len(clique), dtype=bool)
    others = (weight > 0)[:, list(clique)].all(axis=1)
    others[list(clique)] = False
    return bool(inside.all() and not others.any())


def test_each_node_gets_its_heaviest_clique() -> None:
    """Two triangles on one edge: 0-1-2 weighs 6, 1-2-3 weighs 9. Nodes 1 and 2 want the second, 0 the first."""
    two = [(0, 1, 1), (0, 2, 2), (1, 2, 3), (1, 3, 2), (2, 3, 4)]
    assert cliques_of(graph(4, two)) == {(0, 1, 2), (1, 2, 3)}
    assert [find_cliques(graph(count, [])).shape for count in (0, 1, 2, 70)] == [(0, 0), (0, 1), (0, 2), (0, 70)]
    # A third, lighter one on the edge, that nobody prefers but its own node.
    assert cliques_of(graph(5, [*two, (1, 4, 0.1), (2, 4, 0.1)])) == {(0, 1, 2), (1, 2, 3), (1, 2, 4)}
    # A triangle whose nodes all have heavier ones is not given.
    heavy = [(a, outer, 9) for a, outer in ((0, 3), (1, 3), (1, 4), (2, 4), (0, 5), (2, 5))]
    assert cliques_of(graph(6, [(0, 1, 1), (1, 2, 1), (0, 2, 1), *heavy])) == {(0, 1, 3), (1, 2, 4), (0, 2, 5)}


@pytest.mark.parametrize("size", [2, 3], ids=["cocktail party", "Moon-Moser"])
def test_graphs_with_the_most_cliques(size: int) -> None:
    """2^8 and 3^8 maximal cliques, one node of each part. A node's heaviest takes the best of all other parts."""
    count = 8
    value = np.random.default_rng(size).permutation(size * count).astype(float) + 1
    best = value.reshape(count, size).argmax(axis=1) + size * np.arange(count)
    expected = {tuple(np.where(np.arange(count) == node // size, node, best).tolist()) for node in range(size * count)}
    assert cliques_of(by_nodes(parts([size] * count), value)) == expected


@pytest.mark.parametrize(("count", "density"), [(24, 0.15), (24, 0.4), (24, 0.7), (130, 0.05)])
@pytest.mark.parametrize("seed", range(4))
def test_random_graphs_equal_the_plain_twin(seed: int, count: int, density: float) -> None:
    """The largest spread over three words of 64 nodes; in sparse ones most cliques are pairs, which do not count."""
    rng = np.random.default_rng([seed, int(100 * density)])
    # Powers of two times integers: sums are exact in any order, so that ties cannot fall either way.
    weight = symmetric((rng.random((count, count)) < density) * rng.integers(1, 1 << 16, (count, count)))
    members, heaviest = heaviest_cliques_plain(weight > 0, weight)
    expected = {tuple(np.flatnonzero(row).tolist()) for row in members[heaviest > 0]}
    assert cliques_of(weight) == expected
    assert all(is_maximal_clique(clique, weight) for clique in expected)


@pytest.mark.parametrize("max_work", [0, 500, 10_000])
def test_at_the_bound_each_node_has_at_least_its_greedy_clique(max_work: int) -> None:
    """3^20 cliques cannot be looked at; the answer is still made of maximal cliques, one for every node."""
    value = np.random.default_rng(1).permutation(60).astype(float) + 1
    weight = by_nodes(parts([3] * 20), value)
    found = cliques_of(weight, max_work=max_work)
    assert all(is_maximal_clique(clique, weight) for clique in found)
    assert set().union(*found) == set(range(60))
    for node in range(60):
        greedy = [node]
        for other in np.argsort(-weight[node], kind="stable"):
            if all(weight[other, member] > 0 for member in greedy):
                greedy.append(int(other))
        held, wanted = (
            max(weight[np.ix_(clique, clique)].sum(dtype=float) for clique in cliques)
            for cliques in ([clique for clique in found if node in clique], [greedy])
        )
        assert held >= wanted * (1 - 1e-5)  # float32 sums of 190 weights up to 120, in another order


@pytest.mark.hostile("Scene: a complete graph of 2,000 nodes: bounded time and memory")
def test_a_complete_graph_of_2000_nodes() -> None:
    """Weights and the order of neighbours take 16 and 32 MB; a search without a bound takes many GB."""
    weight = symmetric(np.random.default_rng(0).uniform(0.9, 1, (2000, 2000)))
    resident_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    tracemalloc.start()
    try:
        found = find_cliques(weight)
        traced = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert found.shape == (1, 2000)
    assert found.all()
    assert traced < 200e6
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - resident_kb < 400e3


def test_compatibility_by_hand_whatever_the_motion() -> None:
    """Four matches on a line; the source is stretched so that lengths differ by known amounts."""
    target = np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0), (5, 0, 0)], float)
    source = np.array([(0, 0, 0), (1.1, 0, 0), (2, 0, 0), (4, 0, 0)], float)
    # d_01 = 0.1, d_02 = 0, d_12 = 0.1, d_03 = 1, d_13 = 1.1, d_23 = 1; with t = 0.2:
    s = np.exp(-(0.1**2) / (2 * 0.2**2))
    first = np.array([(0, s, 1, 0), (s, 0, s, 0), (1, s, 0, 0), (0, 0, 0, 0)])
    expected = first * (first @ first)
    assert expected[0, 2] == pytest.approx(s * s)
    for T in (np.eye(4), motion((20, -40, 100), (3, 1, -2))):
        matches = matches_of(target, apply(T, source))
        np.testing.assert_allclose(compatibility(matches, 0.2, 0.85), expected, atol=1e-5)
        # s = 0.8825: a threshold above it cuts the edges with d = 0.1, and no triangle is left to support the third.
        np.testing.assert_array_equal(compatibility(matches, 0.2, 0.89), np.zeros((4, 4)))


def test_compatibility_is_symmetric_and_as_wide_as_both_matches_are_noisy() -> None:
    """Lengths that differ by 0.15 m: too much for two sure matches, not for a noisy one with either."""
    source = np.array([(0, 0, 4), (1, 0, 4), (0, 1, 4), (1, 1, 4)], float)
    target = np.array([(0, 0, 4), (1.15, 0, 4), (0, 1, 4), (1, 1, 4)], float)
    sure = replace(matches_of(target, source), sigma_m=np.full(4, 1e-3))
    noisy = replace(sure, sigma_m=np.array([0.08, 1e-3, 1e-3, 1e-3]))
    at_first = [compatibility(matches, 0.1, 0.7) for matches in (sure, noisy)]
    for found in at_first:
        np.testing.assert_array_equal(found, found.T)
    assert (at_first[0][0, 1] > 0, at_first[1][0, 1] > 0) == (False, True)
    # Under no motion the second is out by 0.15 m, twice what a sure one may be; the others score their radius.
    expected_m = np.hypot(0.1, 0.24) + 2 * np.hypot(0.1, 0.003)
    np.testing.assert_allclose(score(np.eye(4)[None], noisy, 0.1), expected_m, rtol=1e-5)


def test_score_by_hand() -> None:
    """Eq. 4 with t = 0.5: distances 0, 0.2, 0.5 and 3 m give 0.5 + 0.3 + 0 + 0."""
    source = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    target = source + [(0, 0, 0), (0, 0.2, 0), (0.3, 0.4, 0), (3, 0, 0)]
    shifted = motion((0, 0, 0), (0, 0.2, 0))
    found = score(np.array([np.eye(4), shifted]), matches_of(target, source), 0.5)
    # Shifted by 0.2 along y: 0.2, 0, |(0.3, 0.2)|, |(3, -0.2)|.
    expected = [0.5 + 0.3, 0.3 + 0.5 + 0.5 - np.hypot(0.3, 0.2)]
    np.testing.assert_allclose(found, expected, atol=1e-6)
    np.testing.assert_array_equal(score(np.array([np.eye(4)]), no_matches(), 0.5), [0])


@pytest.mark.parametrize(
    ("turn_deg", "shift_m", "apart"), [(0, 0.29, False), (0, 0.31, True), (14.9, 0, False), (15.1, 0, True)]
)
def test_two_answers_differ_from_three_thresholds_or_15_degrees(turn_deg: float, shift_m: float, apart: bool) -> None:
    assert differ(np.eye(4), motion((0, turn_deg, 0), (shift_m, 0, 0)), 0.1) == apart


def test_distinct_keeps_the_best_of_each_answer() -> None:
    shifts = [0.0, 0.1, 5.0, 5.1, 9.0, 12.0]
    scores = np.array([10.0, 9.0, 8.0, 7.0, 6.0, 2.9])
    hypotheses = Hypotheses(np.array([motion((0, 0, 0), (x, 0, 0)) for x in shifts]), scores)

    def kept(limit: int) -> list[float]:
        few = distinct(hypotheses, limit, 0.1)
        assert few.score.tolist() == [scores[shifts.index(x)] for x in few.T_target_source[:, 0, 3]]
        return few.T_target_source[:, 0, 3].tolist()

    # The last has less than 0.3 of the best score.
    assert kept(10) == [0.0, 5.0, 9.0]
    assert kept(2) == [0.0, 5.0]
    assert len(distinct(Hypotheses(np.empty((0, 4, 4)), np.empty(0)), 5, 0.1)) == 0


def scattered(seed: int, right: int, wrong: int, T_true: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points and their targets (2, right + wrong, 3): the first ones moved, the others anywhere."""
    rng = np.random.default_rng(seed)
    source = rng.uniform(-1, 1, (right + wrong, 3))
    target = rng.uniform(-1, 1, source.shape)
    target[:right] = apply(T_true, source[:right])
    return np.array((target, source))


@pytest.mark.parametrize("seed", range(5))
def test_a_tenth_of_right_matches_is_enough(seed: int) -> None:
    T_true = motion((10, 50, -30), (0.3, 0.1, -0.2))
    visual = matches_of(*scattered(seed, 15, 135, T_true))
    hypotheses = propose(visual, no_matches(), CliqueConfig())
    rotation_deg, translation_m = errors(hypotheses.T_target_source[0], T_true)
    # Exact matches, and perhaps a wrong one that happens to fit to the threshold of 10 cm in 15.
    assert rotation_deg < 2
    assert translation_m < 0.05
    assert (np.diff(hypotheses.score) <= 0).all()


def test_geometric_matches_guide_the_choice_between_visual_cliques() -> None:
    """A repeated picture gives the larger clique to a wrong motion; the shape of the room knows better."""
    T_true, T_wrong = motion((0, 0, 10), (0.1, 0, 0)), motion((0, 0, 10), (1.1, 0, 0))
    visual = matches_of(*np.hstack((scattered(0, 8, 0, T_true), scattered(1, 12, 0, T_wrong))))
    geometric = matches_of(*scattered(2, 30, 60, T_true))
    paper = {"geometric_hypotheses": False}
    unguided = propose(visual, geometric, CliqueConfig(geometric_guidance=False, **paper))
    assert errors(unguided.T_target_source[0], T_wrong)[1] < 0.05
    guided = propose(visual, geometric, CliqueConfig(**paper))
    assert errors(guided.T_target_source[0], T_true)[1] < 0.05
    parts_of_score = [score(guided.T_target_source[:1], matches, 0.1)[0] for matches in (visual, geometric)]
    np.testing.assert_allclose(guided.score[0], sum(parts_of_score), rtol=1e-5)
    # And they answer alone where the images share no view.
    assert errors(propose(no_matches(), geometric, CliqueConfig()).T_target_source[0], T_true)[1] < 0.05
    assert len(propose(no_matches(), geometric, CliqueConfig(**paper))) == 0


@pytest.mark.hostile("Scene: Fewer than 3 matches")
@pytest.mark.parametrize(
    "points",
    [*(scattered(0, count, 0, np.eye(4))[1] for count in range(3)), np.outer(np.linspace(0, 1, 20), (0.6, 0.8, 0))],
    ids=["none", "one", "two", "on a line"],
)
def test_what_determines_no_motion_proposes_nothing(points: NDArray[np.float64]) -> None:
    matches = matches_of(points, points)
    assert len(propose(matches, no_matches(), CliqueConfig())) == 0
    assert len(propose(matches, matches, CliqueConfig())) == 0
