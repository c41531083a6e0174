# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Repeated texture: another motion under which the keypoints find their like just as well.

Where a print repeats, most keypoints have several equal counterparts and fail the ratio test. What passes agrees by
chance on one of the copies, so the matches alone show no doubt. The keypoints that failed do.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from vigg_ros.acceptance.agreement import Pair, chances_of
from vigg_ros.acceptance.significance import log10_tail
from vigg_ros.registration.cliques import DISTINCT_THRESHOLDS
from vigg_ros.registration.rigid import transform
from vigg_ros.registration.stages import stage
from vigg_ros.registration.visual import closeness

MAX_REPEATED_COUNTERPARTS = 60
"""Counterparts of a keypoint beyond which it is like everything, and tells nothing about a period."""

HALF_GRID_CELLS = 2**16
"""Cells of one threshold on either side of 0, per axis; vectors are counted in them."""

SAME_DESCRIPTOR_DISTANCE = 0.05
"""Squared distance of unit descriptors up to which two show the same thing. Copies on a print differ by less, since the
pixels cut them differently; the best counterpart is then the one that is cut alike, and alone passes the ratio test."""

MIN_REPEATED_KEYPOINTS = 30
"""Keypoints whose copies lie at the same distance and direction, below which no texture repeats."""

MIN_REPEATED_SHARE = 0.4
"""Share of the keypoints that fit the answer which must fit the shifted one as well, to compete with it: a quarter
or more are shifted out of sight. In a furnished room up to 0.15 do."""

MIN_RATIO_OVER_CHANCE = 2.0
"""How many times more keypoints must fit after a shift by a period than by half of it. Where thousands of keypoints
look much alike, a shift by anything fits some."""


@stage("repetition")
def repeated_motion(pair: Pair, T_target_source: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """A different motion (4, 4), shifted by a period of the texture, that the images show as well; else None.

    Only shifts are looked for: prints, tiles, shelves and windows repeat along lines. Surfaces are not asked.
    """
    target, source = pair.keypoints
    if len(target) < 2 or len(source) < MIN_REPEATED_KEYPOINTS:
        return None
    threshold_m = pair.config.cliques.inlier_threshold_m
    cosine = closeness(target.descriptors, source.descriptors)
    # As like a keypoint as its best counterpart, by the ratio test on squared distances 2 - 2 cosine, or the same.
    best = (1.0 - cosine.max(axis=1, keepdims=True)) / np.float32(pair.config.visual.ratio)
    like = 1.0 - cosine <= np.maximum(best, np.float32(SAME_DESCRIPTOR_DISTANCE / 2))
    period = _period(like, cosine.argmax(axis=1), target.points, threshold_m)
    if period is None:
        return None
    moved = transform(T_target_source, source.points)
    fitting = np.count_nonzero(_fits(moved, target.points, like, threshold_m))
    for shift in (period, -period):
        as_well, by_chance = (
            np.count_nonzero(_fits(moved + share * shift, target.points, like, threshold_m)) for share in (1.0, 0.5)
        )
        if as_well >= max(MIN_REPEATED_KEYPOINTS, MIN_REPEATED_SHARE * fitting, MIN_RATIO_OVER_CHANCE * by_chance):
            shifted = T_target_source.copy()
            shifted[:3, 3] += shift
            return shifted
    return None


@stage("repetition")
def shifted_motion(pair: Pair, T_target_source: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """A different motion (4, 4), shifted, that the visual matches which contradict this one show beyond chance.

    Each of them says by what shift it would agree. Columns, doors and windows repeat as things, not as textures:
    matches that chose another copy than most agree on one shift.
    """
    threshold_m = pair.config.cliques.inlier_threshold_m
    outside = ~pair.visual.agree(T_target_source, threshold_m)
    shifts = (pair.visual.target - transform(T_target_source, pair.visual.source))[outside]
    far = np.linalg.norm(shifts, axis=1) > DISTINCT_THRESHOLDS * threshold_m
    shifts, weights = shifts[far], pair.visual_weights[outside][far]
    if len(shifts) < 2:
        return None
    alike = cdist(shifts, shifts) < threshold_m
    together = alike @ weights
    most = int(together.argmax())
    if together[most] < MIN_REPEATED_SHARE * float(pair.visual_weights[~outside].sum()):
        return None
    T_shifted = T_target_source.copy()
    T_shifted[:3, 3] += shifts[alike[most]].mean(axis=0)
    chance, _ = chances_of(pair, T_shifted)
    # The match that proposes a shift agrees with it whatever it is; each proposes one.
    tail = log10_tail(together[most] - weights[most], float(pair.visual_weights.sum()), chance)
    shows = math.log10(len(shifts)) + float(tail) <= math.log10(pair.config.acceptance.max_false_alarms)
    return T_shifted if shows else None


def _period(
    like: NDArray[np.bool_], best: NDArray[np.int64], places: NDArray[np.float64], threshold_m: float
) -> NDArray[np.float64] | None:
    """The most frequent vector (3,) from the best counterpart of a keypoint to another one, if it is far and frequent.

    like: (K, L); best: (K,) columns; places: (L, 3), metres.
    """
    row, column = np.nonzero(like & (np.count_nonzero(like, axis=1) <= MAX_REPEATED_COUNTERPARTS)[:, None])
    between = places[column] - places[best[row]]
    between = between[np.linalg.norm(between, axis=1) > DISTINCT_THRESHOLDS * threshold_m]
    if len(between) < MIN_REPEATED_KEYPOINTS:
        return None
    # Both directions of a period count for it.
    between[between[:, np.abs(between).max(axis=0).argmax()] < 0] *= -1
    half = HALF_GRID_CELLS
    cell = np.clip(np.floor(between / threshold_m).astype(np.int64), -half, half - 1) + half
    key = (cell[:, 0] * (2 * half) + cell[:, 1]) * (2 * half) + cell[:, 2]
    _, place, counts = np.unique(key, return_inverse=True, return_counts=True)
    if counts.max() < MIN_REPEATED_KEYPOINTS:
        return None
    return np.asarray(between[place == counts.argmax()].mean(axis=0))


def _fits(
    moved: NDArray[np.float64], places: NDArray[np.float64], like: NDArray[np.bool_], threshold_m: float
) -> NDArray[np.bool_]:
    """Which source keypoints, moved to the target (K, 3), lie where one of their counterparts is."""
    return np.asarray(((cdist(moved, places) < threshold_m) & like).any(axis=1))
