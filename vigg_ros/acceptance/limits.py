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

MAX_CONFLICT_BY_SHAPES = Limit(
    0.1,
    "measured on the development pairs, cut to little overlap: where the images do not carry an answer",
    right="0.08 or less, of 98 %",
    wrong="0.07 to 0.18 of two thirds, one corner laid on another",
)

MAX_MATCH_LOG10_P = Limit(
    -2.0,
    "the usual level of a test: what the matches show by themselves, however well the surfaces fit",
    right="below -2 of 97 %",
    wrong="above -2 of three quarters, slides along counters and walls",
)

CLEAR_VISUAL_SHARE = Limit(
    0.13,
    "measured on the rendered hall of columns",
    right="0.15 at 11 m in a street, 0.3 and more indoors where frames share half of their view",
    wrong="0.08 to 0.12, by a period of the hall: the other matches chose other copies",
)

PHOTOMETRIC_LEAD = Limit(
    0.05,
    "measured on the development pairs: what an answer's correlation must be above that of a sound alias",
    right="0.1 or more above slides along a counter",
    wrong="-0.03 to 0.04 in the hall of columns",
)
