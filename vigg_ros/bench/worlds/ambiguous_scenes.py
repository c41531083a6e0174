# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Worlds in which registration is ambiguous or blind: a front-end must say so instead of guessing."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from vigg_ros.bench.worlds.canvas import vivid
from vigg_ros.bench.worlds.patterns import label, mottled, poster, tiles
from vigg_ros.bench.worlds.poses import flat, upright, upside_down
from vigg_ros.bench.worlds.scene import Light, Scene
from vigg_ros.bench.worlds.surfaces import Cylinder, Pattern, Rectangle, TexturedSurface, box
from vigg_ros.bench.worlds.texture import Texture

HALL_PERIOD_M = 1.2
"""The hall of columns looks the same after a step of this length along x: columns and tiles alike."""

_LAMP = Light((0.0, 0.0, 2.4), ambient=0.7)


def hall_of_columns(seed: int) -> Scene:
    """A hall of 72 x 4 x 2.8 m along x: one tile, one column, everywhere; only its far ends are ends."""
    rng = np.random.default_rng(seed)
    length_m, width_m, height_m = 60 * HALL_PERIOD_M, 4.0, 2.8
    paint = tiles(rng, (length_m, width_m), tile_m=HALL_PERIOD_M / 4, texel_m=0.01)
    column = label(rng, (2 * np.pi * 0.18, height_m), texel_m=0.006)
    # The lamp is far above, as one near by would give each place a brightness of its own.
    surfaces: list[TexturedSurface] = [
        Rectangle(flat((0, 0, 0)), (length_m, width_m), paint),
        Rectangle(upside_down((0, 0, height_m)), (length_m, width_m), paint),
        Rectangle(upright((0, width_m / 2, height_m / 2), 270), (length_m, height_m), paint),
        Rectangle(upright((0, -width_m / 2, height_m / 2), 90), (length_m, height_m), paint),
    ]
    for x in (np.arange(60) - 29.5) * HALL_PERIOD_M:
        for y in (-1.2, 1.2):
            surfaces.append(Cylinder(flat((x, y, height_m / 2)), 0.18, height_m, column))
    return Scene(tuple(surfaces), Light((0.0, 0.0, 1e6), ambient=0.7))


def bare_room(seed: int) -> Scene:
    """A freshly painted room of 5 x 4 x 2.6 m with two white boxes: shape, but hardly any texture."""
    rng = np.random.default_rng(seed)
    white = partial(mottled, rng, colour=(205, 210, 212), contrast=0.8, coarsest_m=1.0, texel_m=0.01)
    surfaces: list[TexturedSurface] = [*_shell(white)]
    for x, y, yaw_deg, size_m in ((1.2, 0.6, 20.0, (0.8, 0.6, 0.7)), (1.6, -0.8, -10.0, (0.5, 0.5, 1.2))):
        surfaces.extend(box(flat((x, y, 0), yaw_deg), size_m, white))
    return Scene(tuple(surfaces), _LAMP)


def tiled_room(seed: int) -> Scene:
    """A room of 5 x 4 x 2.6 m with one tile on all sides and one label on all boxes: only shape tells places apart."""
    rng = np.random.default_rng(seed)
    tile_seed, label_seed = rng.integers(2**31, size=2)

    def tiled(size_m: tuple[float, float]) -> Texture:
        return tiles(np.random.default_rng(tile_seed), size_m, tile_m=0.25)

    def labelled(size_m: tuple[float, float]) -> Texture:
        return label(np.random.default_rng(label_seed), size_m)

    surfaces: list[TexturedSurface] = [*_shell(tiled)]
    for x, y in ((1.3, 1.2), (1.9, 0.3), (1.2, -0.5), (2.0, -1.3), (0.6, 1.6), (0.7, -1.6)):
        wide_m, deep_m, high_m = rng.uniform((0.25, 0.25, 0.3), (0.6, 0.6, 1.2))
        lying = flat((x + rng.uniform(-0.1, 0.1), y + rng.uniform(-0.1, 0.1), 0), rng.uniform(0, 90))
        surfaces.extend(box(lying, (wide_m, deep_m, high_m), labelled))
    return Scene(tuple(surfaces), _LAMP)


def single_plane(seed: int) -> Scene:
    """One painted wall of 8 x 5 m at x = 2, facing -x: texture, but a shape that fixes three of six."""
    rng = np.random.default_rng(seed)
    return Scene((_wall(poster(rng, (8, 5), shapes=2500, texel_m=0.006)),), _LAMP)


def blank_plane(seed: int) -> Scene:
    """The same wall in one colour: neither texture nor shape says where one is."""
    rng = np.random.default_rng(seed)
    return Scene((_wall(mottled(rng, (8, 5), colour=vivid(rng), contrast=0.0, texel_m=0.02)),), _LAMP)


def _shell(pattern: Pattern) -> Iterator[Rectangle]:
    """Floor, ceiling and walls of a room of 5 x 4 x 2.6 m."""
    yield Rectangle(flat((0, 0, 0)), (5, 4), pattern((5, 4)))
    yield Rectangle(upside_down((0, 0, 2.6)), (5, 4), pattern((5, 4)))
    for x, y, facing_deg, width_m in ((2.5, 0, 180, 4), (-2.5, 0, 0, 4), (0, 2, 270, 5), (0, -2, 90, 5)):
        yield Rectangle(upright((x, y, 1.3), facing_deg), (width_m, 2.6), pattern((width_m, 2.6)))


def _wall(texture: Texture) -> Rectangle:
    return Rectangle(upright((2, 0, 1.3), 180), (8, 5), texture)
