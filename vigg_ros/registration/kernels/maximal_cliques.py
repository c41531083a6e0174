# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""For each node the heaviest maximal clique that holds it (MAC's node-guided selection), in bounded work."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.kernels.compilation import compiled

_ONE = np.uint64(1)

MAX_GREEDY_WORK = 20_000_000
"""Weights looked at for greedy cliques, after which only nodes that are in none yet grow one."""


@compiled
def _popcount(x):  # pragma: no cover - compiled
    x = x - ((x >> np.uint64(1)) & np.uint64(0x5555555555555555))
    x = (x & np.uint64(0x3333333333333333)) + ((x >> np.uint64(2)) & np.uint64(0x3333333333333333))
    x = (x + (x >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return (x * np.uint64(0x0101010101010101)) >> np.uint64(56)


@compiled
def _has_bit(bits, i):  # pragma: no cover - compiled
    return (bits[i >> 6] >> np.uint64(i & 63)) & _ONE != 0


@compiled
def _is_empty(bits):  # pragma: no cover - compiled
    for word in bits:  # noqa: SIM110 - numba compiles loops, not generators
        if word != 0:
            return False
    return True


@compiled
def _keep_heaviest(members, size, weight, best_weight, best):  # pragma: no cover - compiled
    """Give the clique to each member that has none as heavy; equal weights keep the first found."""
    total = np.float32(0)
    for a in range(size):
        for b in range(a):
            total += weight[members[a], members[b]]
    for a in range(size):
        node = members[a]
        if total > best_weight[node]:
            best_weight[node] = total
            best[node] = 0
            for b in range(size):
                best[node, members[b] >> 6] |= _ONE << np.uint64(members[b] & 63)


@compiled
def _greedy(node, order, neighbours, members):  # pragma: no cover - compiled
    """One maximal clique: from the node, add what fits, its heaviest neighbours first. Returns its size."""
    members[0] = node
    size = 1
    fits = neighbours[node].copy()
    for candidate in order:
        if _has_bit(fits, candidate):
            members[size] = candidate
            size += 1
            for word in range(len(fits)):
                fits[word] &= neighbours[candidate, word]
    return size


@compiled
def _is_clique(members, size, bits):  # pragma: no cover - compiled
    """Whether the bits hold these members and no others."""
    count = 0
    for word in bits:
        count += int(_popcount(word))
    if count != size:
        return False
    for a in range(size):  # noqa: SIM110 - numba compiles loops, not generators
        if not _has_bit(bits, members[a]):
            return False
    return True


@compiled
def _grow_greedily(neighbours, weight, order, members, best_weight, best):  # pragma: no cover - compiled
    """One clique from each node on, within about MAX_GREEDY_WORK."""
    grown = 0
    for node in range(len(order)):
        # Thousands of large cliques that hardly differ would take seconds to weigh.
        if grown > MAX_GREEDY_WORK and best_weight[node] > 0:
            continue
        size = _greedy(node, order[node], neighbours, members)
        grown += len(order) + size * size
        # In a dense graph many nodes grow the same clique; weighing it costs the square of its size.
        if size >= 3 and not _is_clique(members, size, best[node]):
            _keep_heaviest(members, size, weight, best_weight, best)


@compiled
def _pivot(candidates, excluded, neighbours):  # pragma: no cover - compiled
    """The node whose neighbours cover most candidates (Tomita 2006): the fewest branches remain."""
    best, most = -1, -1
    for word in range(len(candidates)):
        rest = candidates[word] | excluded[word]
        while rest != 0:
            low = rest & (~rest + _ONE)
            node = word * 64 + int(_popcount(low - _ONE))
            rest ^= low
            cover = 0
            for w in range(len(candidates)):
                cover += int(_popcount(candidates[w] & neighbours[node, w]))
            if cover > most:
                best, most = node, cover
    return best


@compiled
def heaviest_cliques(neighbours, weight, order, max_work):  # pragma: no cover - compiled
    """Bron-Kerbosch with pivoting on bit sets, after one greedy clique per node.

    neighbours (N, W) uint64 bit rows without self-loops, weight (N, N) float32 symmetric, order (N, N) each row's
    nodes by falling weight. Returns best (N, W), the members of each node's clique, their weights (N,),
    and whether every maximal clique was seen. ``max_work`` bounds the word operations of the search;
    at the bound the heaviest cliques found so far stand, and each node has at least its greedy one, or, in graphs
    with so many and so large ones that MAX_GREEDY_WORK is spent, one that it shares.
    Cliques of fewer than three nodes do not count; nodes without one keep weight 0.
    """
    n, words = neighbours.shape
    best = np.zeros((n, words), np.uint64)
    best_weight = np.zeros(n, np.float32)
    members = np.empty(n + 1, np.int64)
    _grow_greedily(neighbours, weight, order, members, best_weight, best)
    # Row d of each stack belongs to the clique members[:d]; branch[d] holds the nodes still to try.
    candidates = np.zeros((n + 2, words), np.uint64)
    excluded = np.zeros((n + 2, words), np.uint64)
    branch = np.zeros((n + 2, words), np.uint64)
    for node in range(n):
        candidates[0, node >> 6] |= _ONE << np.uint64(node & 63)
    branch[0] = candidates[0] & ~neighbours[_pivot(candidates[0], excluded[0], neighbours)]
    depth, work = 0, 0
    while depth >= 0:
        if _is_empty(branch[depth]):
            depth -= 1
            continue
        work += 2 * words
        if work > max_work:
            return best, best_weight, False
        word = 0
        while branch[depth, word] == 0:
            word += 1
        low = branch[depth, word] & (~branch[depth, word] + _ONE)
        node = word * 64 + int(_popcount(low - _ONE))
        branch[depth, word] ^= low
        members[depth] = node
        candidates[depth + 1] = candidates[depth] & neighbours[node]
        excluded[depth + 1] = excluded[depth] & neighbours[node]
        candidates[depth, word] &= ~low
        excluded[depth, word] |= low
        if _is_empty(candidates[depth + 1]):
            if _is_empty(excluded[depth + 1]) and depth + 1 >= 3:
                work += (depth + 1) * (depth + 1)
                _keep_heaviest(members, depth + 1, weight, best_weight, best)
            continue
        depth += 1
        for w in range(words):
            work += words * int(_popcount(candidates[depth, w] | excluded[depth, w]))
        pivot = _pivot(candidates[depth], excluded[depth], neighbours)
        branch[depth] = candidates[depth] & ~neighbours[pivot]
    return best, best_weight, True


def heaviest_cliques_plain(
    adjacency: NDArray[np.bool_], weight: NDArray[np.float32]
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Twin of ``heaviest_cliques`` without a bound: members (N, N) and weights (N,) of each node's clique."""
    n = len(adjacency)
    best, best_weight = np.zeros((n, n), bool), np.zeros(n)
    neighbours = [set(np.flatnonzero(row).tolist()) for row in adjacency]

    def expand(clique: list[int], candidates: set[int], excluded: set[int]) -> None:
        """Bron-Kerbosch: all maximal cliques that grow from this one."""
        if not candidates and not excluded and len(clique) >= 3:
            total = weight[np.ix_(clique, clique)].sum() / 2
            for node in clique:
                if total > best_weight[node]:
                    best_weight[node] = total
                    best[node] = np.isin(np.arange(n), clique)
        for node in sorted(candidates):
            expand([*clique, node], candidates & neighbours[node], excluded & neighbours[node])
            candidates = candidates - {node}
            excluded = excluded | {node}

    expand([], set(range(n)), set())
    return best, best_weight
