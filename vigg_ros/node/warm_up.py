# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Kernels compiled or loaded before the first frame, which would wait for them otherwise."""

from __future__ import annotations

import numpy as np

from vigg_ros.registration.camera import Camera
from vigg_ros.registration.config import Config
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.vigg import extract, register
from vigg_ros.sensors.rvl import decode_rvl

CAMERA = Camera(160, 120, 131.0, 131.0, 79.5, 59.5)


def warm_up(config: Config, *, with_points: bool) -> None:
    """Register a small made-up frame with itself, visually and geometrically."""
    frame = _made_up_frame(config, with_points=with_points)
    for always in (False, True):
        chosen = config.replace({"geometric.always": always, "time_budget_s": 0.0})
        features = extract(frame, chosen)
        register(features, features, chosen)
    if not with_points:
        one_pixel_without_depth = np.array([0, 0, 0, 0x10], np.uint8)
        decode_rvl(one_pixel_without_depth, width_px=1, height_px=1)


def _made_up_frame(config: Config, *, with_points: bool) -> Frame:
    """Blocks of random brightness on wavy ground, at a distance that the configuration accepts."""
    rng = np.random.default_rng(0)
    image = np.kron(rng.integers(0, 255, (15, 20)), np.ones((8, 8))).astype(np.uint8)
    rows, columns = np.mgrid[0:120, 0:160]
    voxel_m = config.geometric.voxel_size_m
    near_m = max(config.geometric.min_range_m * 1.2, 40 * voxel_m)
    depth_m = (near_m + 8 * voxel_m * (np.sin(rows / 9) + np.cos(columns / 11) + 2)).astype(np.float32)
    frame = Frame.from_depth(image, depth_m, CAMERA, stamp_ns=1)
    return Frame.from_points(image, frame.points(), CAMERA, np.eye(4), stamp_ns=1) if with_points else frame
