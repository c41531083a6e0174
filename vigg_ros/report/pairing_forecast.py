# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which messages of two topics a replay would pair, known from their stamps alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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

    @property
    def offset_ns(self) -> float:
        """The median offset; NaN if there are none."""
        return float(np.median(self.offsets_ns)) if self.offsets_ns.size else float("nan")

    @property
    def largest_offset_ns(self) -> int:
        """The largest of all, either way."""
        return int(np.abs(self.offsets_ns).max(initial=0))


def forecast_pairing(
    entries: Sequence[StampEntry], leader: str, follower: str, config: PairingConfig
) -> PairingForecast:
    """Feed the stamps of two topics to the pairing, as a replay of the same entries would."""
    pairing: Pairing[int, int] = Pairing(config)
    ordered = [entries[index] for index in stamp_order(entries).tolist()]
    pairs: list[SyncedPair[int, int]] = []
    refused = 0
    for entry in ordered:
        if entry.topic not in (leader, follower):
            continue
        add = pairing.add_first if entry.topic == leader else pairing.add_second
        try:
            pairs += add(*_usable(entry))
        except DataError:
            refused += entry.topic == leader
    pairs += pairing.flush()
    return PairingForecast(
        leaders=sum(entry.topic == leader for entry in ordered),
        followers=sum(entry.topic == follower for entry in ordered),
        paired=sum(pair.second is not None for pair in pairs),
        refused=refused,
        sessions=1 + max((pair.loop for pair in pairs), default=0),
        offsets_ns=_offsets(*(np.sort([*_stamps(ordered, topic)]) for topic in (leader, follower))),
    )


def _usable(entry: StampEntry) -> tuple[int, int]:
    if not entry.stamp_ns:
        raise DataError("STAMP_ZERO", found="stamp 0", expected="a time", remedy="fill header.stamp")
    return entry.stamp_ns, entry.stamp_ns


def _stamps(entries: Sequence[StampEntry], topic: str) -> Iterator[int]:
    return (entry.stamp_ns for entry in entries if entry.topic == topic and entry.stamp_ns)


def _offsets(leading: NDArray[np.int64], following: NDArray[np.int64]) -> NDArray[np.int64]:
    """To each of the ascending stamps, the nearest of the other ascending ones minus itself."""
    if not (leading.size and following.size):
        return np.empty(0, np.int64)
    after = np.clip(np.searchsorted(following, leading), 0, following.size - 1)
    candidates = np.stack((following[after], following[np.maximum(after - 1, 0)])) - leading
    nearest = np.abs(candidates).argmin(axis=0)
    return np.asarray(candidates[nearest, np.arange(leading.size)], np.int64)
