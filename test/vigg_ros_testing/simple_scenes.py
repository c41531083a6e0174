# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes of a few plain surfaces, whose views have closed forms."""

from __future__ import annotations

import numpy as np

from vigg_ros.bench.worlds import Light, Scene
from vigg_ros.bench.worlds.poses import look_at, upright
from vigg_ros.bench.worlds.surfaces import Rectangle, TexturedSurface
from vigg_ros.bench.worlds.texture import Texture
from vigg_ros.registration import Camera

CAMERA = Camera(width_px=160, height_px=120, fx_px=138.5, fy_px=138.5, cx_px=79.5, cy_px=59.5)

AHEAD = look_at((0, 0, 0), (1, 0, 0))
"""T_world_camera of a camera at the origin that looks along x."""


def plain_texture(grey: int = 128) -> Texture:
    return Texture.of(np.full((16, 16, 3), grey, dtype=np.uint8), texel_m=1.0)


def wall(x_m: float, size_m: tuple[float, float] = (9, 9), texture: Texture | None = None) -> Rectangle:
    """A wall at x that faces the origin."""
    return Rectangle(upright((x_m, 0, 0), 180), size_m, texture or plain_texture())


def scene_of(*surfaces: TexturedSurface) -> Scene:
    """No side of a surface is darker than another: it shows the colours of its texture."""
    return Scene(surfaces, Light((0.0, 0.0, 1e9), ambient=1.0))
