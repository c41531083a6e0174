# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A texture: colours on a surface, filtered to the size of the pixel that looks."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration import ConfigError

_REMAP_COLUMNS = 1024
"""cv2.remap takes no map longer than 32,766 in either direction, so points are folded into rows."""


@dataclass(frozen=True, slots=True, eq=False)
class Texture:
    """Colours (H, W, 3) uint8 BGR on a grid of texel_m, and the same at half resolutions.

    The middle of the image is the surface's origin; its columns run along +x, its rows along -y.
    """

    levels: tuple[NDArray[np.uint8], ...]
    texel_m: float

    @classmethod
    def of(cls, image: NDArray[np.uint8], texel_m: float) -> Texture:
        """The texture of an image (H, W, 3) uint8 BGR. Raises ConfigError on any other."""
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8 or texel_m <= 0:
            raise ConfigError(
                f"found a texture of shape {image.shape}, type {image.dtype}, {texel_m} m per texel; "
                "expected (H, W, 3) uint8 with a positive texel; convert it to BGR"
            )
        levels = [image]
        while min(levels[-1].shape[:2]) > 8:
            levels.append(np.asarray(cv2.pyrDown(levels[-1]), dtype=np.uint8))
        return cls(tuple(levels), float(texel_m))

    def sample(self, coordinates: NDArray[np.float64], footprint_m: NDArray[np.float64]) -> NDArray[np.float32]:
        """Colours (N, 3) BGR in 0..255 at surface coordinates (N, 2), metres.

        footprint_m (N,) is the width on the surface of what one ray stands for: linear between the
        two levels whose texels are nearest to it, so that far texture does not flicker between views.
        """
        height, width = self.levels[0].shape[:2]
        column = coordinates[:, 0] / self.texel_m + (width - 1) / 2
        row = (height - 1) / 2 - coordinates[:, 1] / self.texel_m
        level_of = np.clip(np.log2(footprint_m / self.texel_m), 0, len(self.levels) - 1)
        colours = np.zeros((len(coordinates), 3), dtype=np.float32)
        for level, image in enumerate(self.levels):
            weight = 1 - np.abs(level_of - level)
            chosen = np.flatnonzero(weight > 0)
            if len(chosen):
                # pyrDown puts the centre of its pixel i on pixel 2 i of the level below.
                seen = _lookup(image, column[chosen] / 2**level, row[chosen] / 2**level)
                colours[chosen] += weight[chosen, None].astype(np.float32) * seen
        return colours


def _lookup(image: NDArray[np.uint8], column: NDArray[np.float64], row: NDArray[np.float64]) -> NDArray[np.float32]:
    count = len(column)
    folded = np.zeros((2, -(-count // _REMAP_COLUMNS) * _REMAP_COLUMNS), dtype=np.float32)
    folded[0, :count], folded[1, :count] = column, row
    maps = folded.reshape(2, -1, _REMAP_COLUMNS)
    seen = cv2.remap(image, maps[0], maps[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(seen, dtype=np.float32).reshape(-1, 3)[:count]
