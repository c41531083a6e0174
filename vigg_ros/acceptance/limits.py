# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The limits of acceptance that are no options: each with where it comes from, and what was seen on either side.

"Development pairs" are frames 0 to 299 of redkitchen, KITTI 04, and the rendered rooms and streets: what the limits
were chosen on. docs/results.md says how they do on other recordings.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Limit:
    """A number that a check compares with."""

    value: float
    origin: str
    """Paper, physics, or measured on what."""
    right: str = ""
    """What right answers show, where it was measured."""
    wrong: str = ""
    """What wrong answers show."""


MIN_KEYPOINTS = Limit(8, "a search with fewer could hardly find the inliers asked for")

MIN_PATCHES = Limit(50, "fewer patches of surface decide nothing between two motions")

MIN_MATCH_SHARE = Limit(
    0.025,
    "measured on the development pairs",
    right="0.03 or more",
    wrong="0.02, by chance, where floors and walls of one place are laid on those of another",
)

MIN_MATCH_SHARE_PER_OVERLAP = Limit(
    0.08, "measured on the development pairs", right="0.15 for each share of surface that coincides"
)

MIN_SURFACE_PAIRS = Limit(100, "with fewer pairs of surface points there was nothing to refine with")

MAX_CONFLICT = Limit(
    0.2,
    "measured on the development pairs",
    right="0.01 to 0.09, from desks to streets 20 m apart",
    wrong="0.3 to 0.5 along a street; what is hidden from far apart says nothing about either",
)

MIN_PHOTOMETRIC_CORRELATION = Limit(
    0.3,
    "measured on the development pairs",
    right="0.34 or more, from blurred images 7 s apart",
    wrong="about 0, one corner of a room laid on another; 0.66 to 0.75 for slides along a counter, which it misses",
)

MAX_ROTATION_SIGMA = Limit(5.0, "deg; what is known less well is no pose that a front-end can use")

MAX_RUNNER_UP = Limit(1.0, "by its definition: from 1 on nothing decides between two answers")

COMPETING_SURFACE_SHARE = Limit(0.75, "measured on the development pairs: balance of the surfaces, of the best one's")

COMPETING_MATCH_SHARE = Limit(0.6, "measured on the development pairs: agreeing matches, of the best one's")

DECISIVE_VISUAL_INLIERS = Limit(20, "measured on the development pairs", wrong="fewer, in cliques of repeated texture")

DECISIVE_VISUAL_SHARE = Limit(
    0.15, "measured on the development pairs", wrong="0.1 where texture repeats; then the surfaces contradict as well"
)
