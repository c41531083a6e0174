# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A scene: surfaces under one light, in one world frame (z up, metres)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.worlds.surfaces import TexturedSurface


@dataclass(frozen=True, slots=True)
class Light:
    """A lamp without falloff or shadow, so that a point looks alike from everywhere."""

    position: tuple[float, float, float]
    ambient: float = 0.6
    """The share of brightness that a surface turned away from the lamp keeps."""

    def shades(self, points: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Brightness factors (N,) in 0..1 at points (N, 3) with unit normals (N, 3)."""
        towards = np.asarray(self.position) - points
        cosine = (towards * normals).sum(axis=1) / np.linalg.norm(towards, axis=1)
        return np.asarray(self.ambient + (1 - self.ambient) * np.clip(cosine, 0, 1))


@dataclass(frozen=True, slots=True)
class Scene:
    """Surfaces, a light, and the colour (BGR, 0..255) of what is seen where there is no surface."""

    surfaces: tuple[TexturedSurface, ...]
    light: Light
    background_bgr: tuple[int, int, int] = (0, 0, 0)
