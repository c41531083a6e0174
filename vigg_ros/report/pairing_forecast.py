# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which messages of two topics a replay would pair, known from their stamps alone."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.ordering import StampEntry, stamp_order
from vigg_ros.registration.errors import DataError
from vigg_ros.registration.options import PairingConfig
from vigg_ros.tracking.pairing import Pairing, SyncedPair


@dataclass(frozen=True, slots=True)
class PairingForecast:
    """What the replay's own pairing makes of the stamps."""

    leaders: int
    """Messages of the leading topic: colour images with depth images, scans with points."""
    followers: int
    """Messages of the other topic."""
    paired: int
    refused: int
    """Leaders with a zero, duplicate or late stamp."""
    sessions: int
    """1, and one more for each jump back in time."""
    offsets_ns: NDArray[np.int64]
    """(N,): to each leader's stamp, the nearest one of the other topic minus its own; (0,) without any."""


def forecast_pairing(
    entries: Sequence[StampEntry], leader: str, follower: str, config: PairingConfig
) -> PairingForecast:
    """Feed the stamps of two topics to the pairing, as a replay of the same entries would."""
    pairing: Pairing[int, int] = Pairing(config)
    add = {leader: pairing.add_first, follower: pairing.add_second}
    stamps_ns: dict[str, list[int]] = {leader: [], follower: []}
    pairs: list[SyncedPair[int, int]] = []
    for entry in (entries[index] for index in stamp_order(entries).tolist()):
        if entry.topic in add and entry.stamp_ns:
            stamps_ns[entry.topic].append(entry.stamp_ns)
            with suppress(DataError):  # a duplicate or late stamp
                pairs += add[entry.topic](entry.stamp_ns, entry.stamp_ns)
    pairs += pairing.flush()
    leaders, followers = (sum(entry.topic == topic for entry in entries) for topic in (leader, follower))
    return PairingForecast(
        leaders=leaders,
        followers=followers,
        paired=sum(pair.second is not None for pair in pairs),
        refused=leaders - len(pairs),  # each leader that was taken is in one pair, alone or not
        sessions=1 + max((pair.loop for pair in pairs), default=0),
        offsets_ns=_offsets(*(np.sort(np.array(own, np.int64)) for own in stamps_ns.values())),
    )


def _offsets(leading: NDArray[np.int64], following: NDArray[np.int64]) -> NDArray[np.int64]:
    """To each of the ascending stamps, the nearest of the other ascending ones minus itself."""
    if not (leading.size and following.size):
        return np.empty(0, np.int64)
    after = np.clip(np.searchsorted(following, leading), 0, following.size - 1)
    candidates = np.stack((following[after], following[np.maximum(after - 1, 0)])) - leading
    nearest = np.abs(candidates).argmin(axis=0)
    return np.asarray(candidates[nearest, np.arange(leading.size)], np.int64)
