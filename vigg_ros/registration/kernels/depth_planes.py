# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Planes fitted to the windows of a depth image, in inverse depth, in which planes are linear and noise is even.

With w = 1 / z a plane n . X = d is w = (n_x x + n_y y + n_z) / d of the ray (x, y, 1). Structured light and stereo
measure disparity, which is w times a constant: its steps and noise are the same near and far.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.kernels.compilation import compiled

EDGE_SHARE, EDGE_W = 0.05, 0.004
"""Neighbours whose inverse depth differs by more than this share of it, plus 4 mm at 1 m, lie on another surface."""

MIN_FILLED = 0.7
"""Share of the window that must lie on the surface."""

MIN_DETERMINED = 1e-6
"""Share of the product of variances that their determinant must reach: the pixels must not lie on a line."""


@compiled
def _first(centre, half, stride):  # pragma: no cover - compiled
    """The first offset of a window that lies inside the image."""
    return -half + max(-((centre - half) // stride), 0) * stride


@compiled
def depth_planes(depth_m, camera, step, half, stride):  # pragma: no cover - compiled
    """Planes (H / step, W / step, 5) float32: depth at the centre, unit normal towards the camera, deviation of 1 / z.

    depth_m: (H, W) float32, metres, 0 where there is none. camera: fx, fy, cx, cy. Each window reaches ``half`` pixels
    to either side of its centre, of which every ``stride``-th is used. The depth is 0 where no plane is seen.
    """
    fx, fy, cx, cy = camera
    height, width = depth_m.shape
    rows, columns = height // step, width // step
    out = np.zeros((rows, columns, 5), np.float32)
    window = (2 * half // stride + 1) ** 2
    for i in range(rows):
        v = i * step + step // 2
        for j in range(columns):
            u = j * step + step // 2
            if depth_m[v, u] <= 0:
                continue
            w0 = 1.0 / depth_m[v, u]
            edge = EDGE_SHARE * w0 + EDGE_W
            n = 0
            su = sv = sw = suu = svv = suv = suw = svw = sww = 0.0
            for dv in range(_first(v, half, stride), min(half, height - 1 - v) + 1, stride):
                for du in range(_first(u, half, stride), min(half, width - 1 - u) + 1, stride):
                    z = depth_m[v + dv, u + du]
                    if z <= 0:
                        continue
                    w = 1.0 / z - w0
                    if abs(w) > edge:
                        continue
                    n += 1
                    su, sv, sw = su + du, sv + dv, sw + w
                    suu, svv, suv = suu + du * du, svv + dv * dv, suv + du * dv
                    suw, svw, sww = suw + du * w, svw + dv * w, sww + w * w
            if n < MIN_FILLED * window:
                continue
            mu, mv, mw = su / n, sv / n, sw / n
            uu, vv, uv = suu - n * mu * mu, svv - n * mv * mv, suv - n * mu * mv
            uw, vw = suw - n * mu * mw, svw - n * mv * mw
            determinant = uu * vv - uv * uv
            if determinant <= MIN_DETERMINED * uu * vv:
                continue
            a, b = (uw * vv - vw * uv) / determinant, (vw * uu - uw * uv) / determinant
            centre = w0 + mw - a * mu - b * mv
            if centre <= 0:
                continue
            nx, ny = a * fx, b * fy
            nz = centre - nx * (u - cx) / fx - ny * (v - cy) / fy
            scale = -1.0 / np.sqrt(nx * nx + ny * ny + nz * nz)
            out[i, j, 0] = 1.0 / centre
            out[i, j, 1], out[i, j, 2], out[i, j, 3] = nx * scale, ny * scale, nz * scale
            # Two of the n differences are spent on the slopes, one on the mean.
            out[i, j, 4] = np.sqrt(max(sww - n * mw * mw - a * uw - b * vw, 0.0) / max(n - 3, 1))
    return out


def depth_planes_plain(
    depth_m: NDArray[np.float32], camera: tuple[float, float, float, float], step: int, half: int, stride: int
) -> NDArray[np.float32]:
    """Twin of ``depth_planes``."""
    fx, fy, cx, cy = camera
    height, width = depth_m.shape
    out = np.zeros((height // step, width // step, 5), np.float32)
    with np.errstate(divide="ignore"):
        inverse = np.where(depth_m > 0, 1.0 / depth_m.astype(np.float64), np.nan)
    offsets = np.arange(-half, half + 1, stride)
    dv, du = (offset.ravel() for offset in np.meshgrid(offsets, offsets, indexing="ij"))
    for i, j in np.ndindex(*out.shape[:2]):
        v, u = i * step + step // 2, j * step + step // 2
        inside = (v + dv >= 0) & (v + dv < height) & (u + du >= 0) & (u + du < width)
        w = inverse[v + dv[inside], u + du[inside]]
        with np.errstate(invalid="ignore"):
            kept = np.abs(w - inverse[v, u]) <= EDGE_SHARE * inverse[v, u] + EDGE_W
        if np.count_nonzero(kept) < MIN_FILLED * len(du):
            continue
        design = np.column_stack((du[inside][kept], dv[inside][kept], np.ones(np.count_nonzero(kept))))
        (a, b, centre), *_ = np.linalg.lstsq(design, w[kept], rcond=None)
        if np.linalg.matrix_rank(design) < 3 or centre <= 0:
            continue
        normal = np.array((a * fx, b * fy, centre - a * (u - cx) - b * (v - cy)))
        rest = w[kept] - design @ (a, b, centre)
        deviation = np.sqrt(rest @ rest / max(len(rest) - 3, 1))
        out[i, j] = (1 / centre, *(-normal / np.linalg.norm(normal)), deviation)
    return out
