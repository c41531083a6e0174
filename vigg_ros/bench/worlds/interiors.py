# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rooms that are harder than a living room: a wide one, a shelf right before the camera, a row of equal doors."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from vigg_ros.bench.worlds.canvas import Rng, Size
from vigg_ros.bench.worlds.patterns import carton, label, mottled, planks, poster
from vigg_ros.bench.worlds.poses import Pose, flat, upright, upside_down
from vigg_ros.bench.worlds.rooms import ball, bookcase, pile, table, tin
from vigg_ros.bench.worlds.scene import Light, Scene
from vigg_ros.bench.worlds.surfaces import Rectangle, TexturedSurface, box
from vigg_ros.bench.worlds.texture import Texture

DOOR_M = 0.6
"""Width of the kitchen's doors: the row looks alike after a step of this length along y."""


def workshop(seed: int) -> Scene:
    """A hall of 14 x 9 x 3.4 m with tables, shelves and cartons: things from half a metre to ten metres away."""
    rng = np.random.default_rng(seed)
    surfaces: list[TexturedSurface] = [*_walls(rng, (14.0, 9.0, 3.4), planks(rng, (14.0, 9.0), texel_m=0.008))]
    for x, y, yaw_deg in ((-2.6, 1.3, 15), (0.6, -1.9, 80), (2.4, 1.6, -10), (4.8, -0.6, 60)):
        surfaces.extend(table(rng, flat((x, y, 0), yaw_deg + rng.uniform(-10, 10))))
    for x, y, yaw_deg in ((-1.5, 4.3, 90), (3.0, 4.3, 90), (6.8, 0.8, 0), (6.8, -2.6, 0), (1.5, -4.3, -90)):
        surfaces.extend(bookcase(rng, flat((x, y, 0), yaw_deg)))
    for x, y in ((-3.6, -1.9), (-1.2, -0.9), (-0.3, 2.8), (1.6, 0.2), (3.7, -2.6), (3.4, 3.0), (5.6, 2.6), (5.5, -3.6)):
        surfaces.extend(_stack(rng, flat((x, y, 0) + np.append(rng.uniform(-0.3, 0.3, 2), 0), rng.uniform(0, 90))))
    for x, y, facing_deg, across in (
        (6.95, 3.0, 180, 1.6), (6.95, -0.9, 180, 1.2), (0.9, 4.45, 270, 1.8), (5.2, 4.45, 270, 1.4),
        (-4.6, 4.45, 270, 1.5), (-1.0, -4.45, 90, 1.8), (4.2, -4.45, 90, 1.6),
        (-5.2, -4.45, 90, 1.4), (-6.95, 0.0, 0, 2.0),
    ):  # fmt: skip
        size_m = (across, 0.7 * across)
        on_wall = upright((x, y, rng.uniform(1.6, 2.2)), facing_deg)
        surfaces.append(Rectangle(on_wall, size_m, poster(rng, size_m, texel_m=0.006)))
    return Scene(tuple(surfaces), Light((0.0, 0.0, 3.2), ambient=0.65))


def shelf(seed: int) -> Scene:
    """A shelf of 2.4 x 2 m with its boards' front edges at x = 0, full of things, seen from half a metre away."""
    rng = np.random.default_rng(seed)
    wood = partial(mottled, rng, colour=(95, 130, 160), contrast=9, coarsest_m=0.3, texel_m=0.002)
    back = mottled(rng, (2.4, 2.0), colour=(140, 165, 185), contrast=8, coarsest_m=0.4, texel_m=0.003)
    surfaces: list[TexturedSurface] = [Rectangle(upright((0.35, 0, 1.0), 180), (2.4, 2.0), back)]
    for y in (-1.2, -0.4, 0.4, 1.2):
        surfaces.extend(box(flat((0.175, y, 0)), (0.35, 0.02, 2.0), wood))
    for z in (0.0, 0.3, 0.6, 0.9, 1.2, 1.5, 1.8):
        surfaces.extend(box(flat((0.175, 0, z)), (0.35, 2.38, 0.02), wood))
        for y in (-0.8, 0.0, 0.8):
            surfaces.extend(_shelf_things(rng, flat((0.0, y, z + 0.02)), 0.74))
    return Scene(tuple(surfaces), Light((-1.5, 0.5, 2.4), ambient=0.6))


def kitchen_row(seed: int) -> Scene:
    """Ten equal doors of 0.6 m below and above a worktop along y, the lower at x = 0.

    The shapes repeat, and so do the doors' patterns; floor, wall, stone, and what stands on it, do not.
    """
    rng = np.random.default_rng(seed)
    door_seed, width_m = int(rng.integers(2**31)), 10 * DOOR_M
    paint = partial(mottled, rng, colour=(150, 165, 172), contrast=4, coarsest_m=0.3)
    steel = partial(mottled, rng, colour=(120, 120, 120), contrast=6, texel_m=0.002)

    def door(size_m: Size) -> Texture:
        """The same on every door: veneer with a grain."""
        return planks(np.random.default_rng(door_seed), size_m, plank_m=0.2, texel_m=0.003)

    floor = planks(rng, (7.0, 8.0), texel_m=0.006)
    surfaces: list[TexturedSurface] = [*_walls(rng, (7.0, 8.0, 2.6), floor, middle=(-2.9, 0.0))]
    splash = mottled(rng, (width_m, 0.55), colour=(190, 200, 200), contrast=5)
    surfaces.append(Rectangle(upright((0.595, 0, 1.175), 180), (width_m, 0.55), splash))
    stone = partial(mottled, rng, colour=(95, 100, 105), contrast=12, coarsest_m=0.1)
    surfaces.extend(box(flat((0.3, 0, 0.1)), (0.58, width_m, 0.76), paint))
    surfaces.extend(box(flat((0.29, 0, 0.86)), (0.62, width_m, 0.04), stone))
    surfaces.extend(box(flat((0.42, 0, 1.45)), (0.33, width_m, 0.72), paint))
    for y in (np.arange(10) - 4.5) * DOOR_M:
        for x, z, high_m, handle_m in ((0.0, 0.12, 0.72, 0.76), (0.245, 1.46, 0.7, 1.53)):
            surfaces.extend(box(flat((x, y, z)), (0.02, DOOR_M - 0.012, high_m), door))
            surfaces.extend(box(flat((x - 0.025, y, handle_m)), (0.03, 0.16, 0.015), steel))
    for y in rng.permutation(np.linspace(-2.7, 2.7, 12))[:7]:
        surfaces.extend(_shelf_things(rng, flat((0.12, y, 0.9)), 0.22))
    return Scene(tuple(surfaces), Light((0.0, 0.0, 1e6), ambient=0.7))


def _walls(
    rng: Rng, size_m: tuple[float, float, float], floor: Texture, *, middle: Size = (0.0, 0.0)
) -> Iterator[Rectangle]:
    """Floor, ceiling and weakly textured walls around a middle."""
    (length_m, width_m, height_m), (x, y) = size_m, middle
    paint = partial(mottled, rng, contrast=5, coarsest_m=0.8, octaves=8, texel_m=0.008)
    yield Rectangle(flat((x, y, 0)), (length_m, width_m), floor)
    ceiling = paint((length_m, width_m), colour=(225, 228, 230))
    yield Rectangle(upside_down((x, y, height_m)), (length_m, width_m), ceiling)
    for dx, dy, facing_deg, across_m in (
        (length_m / 2, 0, 180, width_m), (-length_m / 2, 0, 0, width_m),
        (0, width_m / 2, 270, length_m), (0, -width_m / 2, 90, length_m),
    ):  # fmt: skip
        colour = tuple(rng.uniform((175, 185, 190), (205, 215, 220)))
        wall = upright((x + dx, y + dy, height_m / 2), facing_deg)
        yield Rectangle(wall, (across_m, height_m), paint((across_m, height_m), colour=colour))


def _stack(rng: Rng, T_world_base: Pose) -> Iterator[TexturedSurface]:
    """One carton on another, and a ball beside them."""
    low_m, top_m = rng.uniform((0.4, 0.4, 0.3), (0.7, 0.6, 0.7)), rng.uniform((0.2, 0.2, 0.2), (0.4, 0.4, 0.5))
    yield from box(T_world_base, tuple(low_m), partial(carton, rng))
    yield from box(T_world_base @ flat((0, 0, low_m[2]), rng.uniform(-30, 30)), tuple(top_m), partial(label, rng))
    radius_m = rng.uniform(0.1, 0.2)
    yield ball(rng, tuple((T_world_base @ (0.75, 0, radius_m, 1))[:3]), radius_m)


def _shelf_things(rng: Rng, T_world_board: Pose, width_m: float) -> Iterator[TexturedSurface]:
    """Tins, books, boxes, piles and balls side by side along y, around the middle of a board, behind its front edge."""
    left_m = -width_m / 2
    while left_m < width_m / 2 - 0.06:
        wide_m, high_m = min(rng.uniform(0.05, 0.18), width_m / 2 - left_m), rng.uniform(0.1, 0.25)
        place = T_world_board @ flat((rng.uniform(0.02, 0.1) + wide_m / 2, left_m + wide_m / 2, 0))
        kind, fine = rng.integers(5), partial(label, rng, texel_m=0.0015)
        if kind == 0:
            yield tin(rng, place, 0.45 * wide_m, high_m)
        elif kind == 1:
            yield ball(rng, tuple((place @ (0, 0, 0.45 * wide_m, 1))[:3]), 0.45 * wide_m)
        elif kind == 2:
            yield from pile(rng, place, (0.15, 0.8 * wide_m, 0.03), int(rng.integers(2, 5)))
        elif kind == 3:
            yield from box(place, (0.8 * wide_m, 0.8 * wide_m, high_m), partial(carton, rng, texel_m=0.002))
        else:
            yield from box(place @ flat((0, 0, 0), rng.uniform(-15, 15)), (0.12, 0.7 * wide_m, high_m), fine)
        left_m += wide_m + rng.uniform(0.005, 0.05)
