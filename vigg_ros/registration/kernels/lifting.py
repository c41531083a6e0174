# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A depth image as points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.kernels.compilation import compiled


@compiled
def lift_depth(depth_m, fx, fy, cx, cy):  # pragma: no cover - compiled
    """Points (N, 3) float32 of a depth image (H, W) float32, metres, where it is not 0, row by row."""
    height, width = depth_m.shape
    points = np.empty((height * width, 3), np.float32)
    n = 0
    for v in range(height):
        for u in range(width):
            z = depth_m[v, u]
            if z != 0:
                points[n, 0] = (np.float32(u) - cx) * (z / fx)
                points[n, 1] = (np.float32(v) - cy) * (z / fy)
                points[n, 2] = z
                n += 1
    return points[:n]


def lift_depth_plain(
    depth_m: NDArray[np.float32], fx: np.float32, fy: np.float32, cx: np.float32, cy: np.float32
) -> NDArray[np.float32]:
    """Twin of ``lift_depth``."""
    v, u = np.nonzero(depth_m)
    z = depth_m[v, u]
    return np.column_stack(((u.astype(np.float32) - cx) * (z / fx), (v.astype(np.float32) - cy) * (z / fy), z))
