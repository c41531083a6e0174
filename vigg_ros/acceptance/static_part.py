# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which part of the view moves as another one does: the own body in the image, a thing that is carried past, a person.

Where the surfaces contradict a motion in one connected region of the image, something else moves there; where they do
all over the place, the motion is wrong.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vigg_ros.acceptance.agreement import Pair
from vigg_ros.acceptance.sight import Sight, sights
from vigg_ros.registration.features import Features
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.geometry import DepthMap

COLUMNS = 80
"""Cells across the image in which regions are sought."""

MIN_REGION_SHARE = 0.02
"""Share of the image below which a region is no thing: noise and the rims of things are smaller."""

MAX_MOVING_SHARE = 0.5
"""Share of the view that may move otherwise: from half on nobody knows which of the two parts is the world."""


@dataclass(frozen=True, slots=True)
class Region:
    """A part of the view of both frames, connected but for a few pieces."""

    target: NDArray[np.bool_]
    """(h, w) cells of the target's image."""
    source: NDArray[np.bool_]
    share: float
    """Of the cells that have depth, the greater of both frames."""

    def removed_from(self, pair: Pair) -> tuple[Frame, Frame]:
        """Target and source without the depth in this region."""
        return _without(pair.target.frame, self.target), _without(pair.source.frame, self.source)


def is_possible(target: Features, source: Features) -> bool:
    """Whether regions can be told: both frames are depth images."""
    return all(isinstance(features.frame.geometry, DepthMap) for features in (target, source))


def region_of(pair: Pair, T_target_source: NDArray[np.float64], *, coinciding: bool) -> Region:
    """Where the surfaces coincide under a motion, or where they contradict it."""
    forward, backward = sights(pair.target, pair.source, T_target_source, pair.config)
    source, source_share = _cells(pair.source, forward, coinciding=coinciding)
    target, target_share = _cells(pair.target, backward, coinciding=coinciding)
    return Region(target, source, max(source_share, target_share))


def _cells(features: Features, sight: Sight, *, coinciding: bool) -> tuple[NDArray[np.bool_], float]:
    """Cells (h, w) of the image whose surface is of a kind, and their share of those with depth."""
    frame, patches, kinds = features.frame, features.patches.points, sight.kinds()
    assert isinstance(frame.geometry, DepthMap)
    height, width = frame.geometry.depth_m.shape
    step = max(min(width // COLUMNS, height), 1)
    v, u = np.mgrid[step // 2 : height : step, step // 2 : width : step]
    shape = v.shape
    points = frame.points_at(np.column_stack((u.ravel(), v.ravel())).astype(np.float64))
    known = np.isfinite(points).all(axis=1)
    is_one = np.zeros(len(patches), bool)
    is_one[sight.row] = kinds[0] if coinciding else kinds[1] | kinds[2]
    cells = np.zeros(len(points), np.uint8)
    cells[known] = is_one[cKDTree(patches).query(points[known])[1]]
    square = np.ones((3, 3), np.uint8)
    closed = cv2.morphologyEx(cells.reshape(shape), cv2.MORPH_CLOSE, square)
    count, label, stats, _ = cv2.connectedComponentsWithStats(cv2.morphologyEx(closed, cv2.MORPH_OPEN, square))
    large = [i for i in range(1, count) if stats[i, cv2.CC_STAT_AREA] >= MIN_REGION_SHARE * cells.size]
    region = np.isin(label, large)
    share = int(np.count_nonzero(region & known.reshape(shape))) / max(int(np.count_nonzero(known)), 1)
    return cv2.dilate(region.astype(np.uint8), square).astype(bool), share


def _without(frame: Frame, region: NDArray[np.bool_]) -> Frame:
    assert isinstance(frame.geometry, DepthMap)
    depth_m = frame.geometry.depth_m
    size = depth_m.shape[1], depth_m.shape[0]
    masked = cv2.resize(region.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST).astype(bool)
    return Frame.from_depth(
        frame.image, np.where(masked, np.float32(0), depth_m), frame.camera, stamp_ns=frame.stamp_ns
    )
