# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How regularly the messages of a topic follow each other, by their stamps alone."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.ordering import StampEntry, stamp_order


@dataclass(frozen=True, slots=True)
class Rhythm:
    """The stamps of one topic, in the order in which a replay takes them."""

    stamps_ns: NDArray[np.int64]
    """(N,): header stamps without the zeros, or log times where the type has no header."""
    has_stamps: bool
    """False: the type has no header, so these are log times."""
    zeros: int
    """Messages whose stamp is 0."""

    @property
    def steps_ns(self) -> NDArray[np.int64]:
        """From each stamp to the next one, (N - 1,) or (0,); negative where a loop begins."""
        return np.diff(self.stamps_ns)

    @property
    def period_ns(self) -> float:
        """The median step forwards; NaN with fewer than two different stamps."""
        forwards = self.steps_ns[self.steps_ns > 0]
        return float(np.median(forwards)) if forwards.size else math.nan

    @property
    def jitter_ns(self) -> float:
        """How far 95 % of the steps forwards stay within their median; NaN like the period."""
        off_ns = np.abs(self.steps_ns[self.steps_ns > 0] - self.period_ns)
        return float(np.percentile(off_ns, 95)) if off_ns.size else math.nan

    @property
    def largest_gap_ns(self) -> int:
        """The largest step forwards, 0 if there is none."""
        return int(self.steps_ns.max(initial=0))


def find_rhythms(entries: Sequence[StampEntry]) -> dict[str, Rhythm]:
    """The rhythm of each topic of one reading of a bag (``BagReader.stamps``)."""
    topics: defaultdict[str, list[StampEntry]] = defaultdict(list)
    for index in stamp_order(entries).tolist():
        topics[entries[index].topic].append(entries[index])
    return {topic: _rhythm(own) for topic, own in sorted(topics.items())}


def _rhythm(entries: Sequence[StampEntry]) -> Rhythm:
    stamped = [entry for entry in entries if entry.stamp_ns is not None]
    if not stamped:
        return Rhythm(np.array([entry.log_ns for entry in entries], np.int64), False, 0)
    useful = [entry for entry in stamped if entry.stamp_ns]
    stamps_ns = np.array([entry.stamp_ns for entry in useful], np.int64)
    return Rhythm(stamps_ns, True, len(stamped) - len(useful))
