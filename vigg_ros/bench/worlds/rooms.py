# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A furnished room, as a handheld RGB-D camera sees one."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from vigg_ros.bench.worlds.canvas import Rng, vivid
from vigg_ros.bench.worlds.patterns import carton, label, mottled, planks, poster
from vigg_ros.bench.worlds.poses import Pose, flat, upright, upside_down
from vigg_ros.bench.worlds.scene import Light, Scene
from vigg_ros.bench.worlds.surfaces import Cylinder, Pattern, Rectangle, Sphere, TexturedSurface, box

LENGTH_M, WIDTH_M, HEIGHT_M = 5.0, 4.0, 2.6
"""The room's inside along x, y and z; the world's origin is in the middle of its floor."""


def room(seed: int) -> Scene:
    """A room of about 5 x 4 x 2.6 m with a table, shelves, boxes, pictures and balls."""
    rng = np.random.default_rng(seed)
    surfaces = (
        *_shell(rng),
        *_wall_things(rng),
        *table(rng, flat((0.75, 0.25, 0), 12)),
        *bookcase(rng, flat((2.3, -0.55, 0))),
        *_floor_things(rng),
    )
    return Scene(surfaces, Light((-0.5, -0.4, 2.5), ambient=0.55))


def _shell(rng: Rng) -> Iterator[TexturedSurface]:
    """Floor, ceiling and walls; ceiling and walls are weakly textured, as they are in most rooms."""
    length, width, height = LENGTH_M, WIDTH_M, HEIGHT_M
    yield Rectangle(flat((0, 0, 0)), (length, width), planks(rng, (length, width)))
    ceiling = mottled(rng, (length, width), colour=(225, 228, 230), contrast=3, texel_m=0.008)
    yield Rectangle(upside_down((0, 0, height)), (length, width), ceiling)
    for position, facing_deg, extent in (
        ((length / 2, 0, height / 2), 180, width),
        ((-length / 2, 0, height / 2), 0, width),
        ((0, width / 2, height / 2), 270, length),
        ((0, -width / 2, height / 2), 90, length),
    ):
        colour = tuple(rng.uniform((175, 185, 190), (205, 215, 220)))
        paint = mottled(rng, (extent, height), colour=colour, contrast=5, coarsest_m=0.8, octaves=8)
        yield Rectangle(upright(position, facing_deg), (extent, height), paint)


def _wall_things(rng: Rng) -> Iterator[TexturedSurface]:
    """Pictures, a window, a door and a whiteboard, a few centimetres in front of their walls."""
    for x, y, z, facing_deg, width, height in (
        (2.47, 1.35, 1.55, 180, 0.9, 0.65),
        (2.47, 0.45, 1.75, 180, 0.5, 0.7),
        (0.2, 1.97, 1.5, 270, 1.1, 0.8),
        (1.35, 1.97, 1.6, 270, 0.6, 0.85),
        (-1.1, 1.97, 1.45, 270, 0.7, 0.5),
        (-2.47, -1.2, 1.6, 0, 0.8, 0.6),
        (0.9, -1.97, 1.55, 90, 0.9, 0.65),
        (-1.9, -1.97, 1.5, 90, 0.5, 0.7),
    ):
        yield Rectangle(upright((x, y, z), facing_deg), (width, height), poster(rng, (width, height)))
    view = poster(rng, (1.3, 1.1), shapes=60)
    yield Rectangle(upright((-2.46, 0.6, 1.5), 0), (1.3, 1.1), view)
    board = mottled(rng, (1.2, 0.9), colour=(240, 242, 240), contrast=2)
    yield Rectangle(upright((-0.5, -1.96, 1.5), 90), (1.2, 0.9), board)
    yield from box(flat((2.1, -1.98, 0)), (0.8, 0.06, 2.05), partial(planks, rng, plank_m=0.4))


def table(rng: Rng, T_world_table: Pose) -> Iterator[TexturedSurface]:
    """A table of 1.3 x 0.75 m with books, tins and balls on it."""
    wood = partial(planks, rng, plank_m=0.19, texel_m=0.004)
    yield from box(T_world_table @ flat((0, 0, 0.70)), (1.3, 0.75, 0.04), wood)
    for x, y in ((0.6, 0.33), (0.6, -0.33), (-0.6, 0.33), (-0.6, -0.33)):
        yield from box(T_world_table @ flat((x, y, 0)), (0.05, 0.05, 0.70), wood)
    top = T_world_table @ flat((0, 0, 0.74))
    yield from pile(rng, top @ flat((-0.42, 0.2, 0), 20), (0.22, 0.16, 0.035), 4)
    yield from pile(rng, top @ flat((0.2, -0.22, 0), -35), (0.26, 0.18, 0.04), 3)
    yield from box(top @ flat((0.05, 0.2, 0), 8), (0.3, 0.2, 0.24), partial(carton, rng, texel_m=0.003))
    yield from box(top @ flat((0.45, 0.12, 0), -20), (0.18, 0.12, 0.3), partial(label, rng))
    yield from box(top @ flat((-0.15, -0.05, 0), 40), (0.1, 0.07, 0.16), partial(label, rng))
    yield tin(rng, top @ flat((-0.35, -0.2, 0)), 0.04, 0.12)
    yield tin(rng, top @ flat((-0.24, -0.27, 0)), 0.035, 0.1)
    yield tin(rng, top @ flat((0.52, -0.18, 0)), 0.05, 0.2)
    yield ball(rng, tuple((top @ (-0.08, -0.27, 0.06, 1))[:3]), 0.06)
    yield ball(rng, tuple((top @ (0.38, -0.02, 0.05, 1))[:3]), 0.05)


def bookcase(rng: Rng, T_world_shelves: Pose) -> Iterator[TexturedSurface]:
    """A bookcase of 0.35 x 1.3 x 1.9 m along the wall, with rows of books and some boxes."""
    wood = partial(mottled, rng, colour=(70, 95, 125), contrast=9, coarsest_m=0.3)
    for y in (-0.65, 0.65):
        yield from box(T_world_shelves @ flat((0, y, 0)), (0.35, 0.03, 1.9), wood)
    for z in (0.08, 0.52, 0.96, 1.4, 1.87):
        yield from box(T_world_shelves @ flat((0, 0, z)), (0.35, 1.28, 0.03), wood)
    for z in (0.11, 0.55, 0.99, 1.43):
        yield from _book_row(rng, T_world_shelves @ flat((0, 0, z)))
    yield from box(T_world_shelves @ flat((0, -0.3, 1.9), 10), (0.28, 0.4, 0.25), partial(carton, rng))
    yield ball(rng, tuple((T_world_shelves @ (0, 0.3, 2.0, 1))[:3]), 0.1)


def _book_row(rng: Rng, T_world_board: Pose) -> Iterator[TexturedSurface]:
    """Books from one side to somewhere before the other, then one box."""
    y_m = -0.62
    while y_m < rng.uniform(0.0, 0.3):
        size_m = tuple(rng.uniform((0.18, 0.04, 0.22), (0.28, 0.1, 0.36)))
        yield from box(T_world_board @ flat((-0.02, y_m + size_m[1] / 2, 0)), size_m, partial(label, rng))
        y_m += size_m[1] + 0.004
    size_m = tuple(rng.uniform((0.18, 0.16, 0.12), (0.26, 0.24, 0.3)))
    yield from box(T_world_board @ flat((0, 0.46, 0), rng.uniform(-12, 12)), size_m, partial(carton, rng))


def _floor_things(rng: Rng) -> Iterator[TexturedSurface]:
    """Cartons, a rug, a chest, a stool, a bin and balls."""
    yield from box(flat((-0.6, 0.3, 0), -8), (1.6, 1.1, 0.01), partial(poster, rng, shapes=80))
    for x, y, z, yaw_deg, size_m in (
        (1.95, 1.5, 0, 25, (0.55, 0.45, 0.5)),
        (1.95, 1.52, 0.5, 5, (0.38, 0.33, 0.3)),
        (-0.1, 1.65, 0, -15, (0.5, 0.4, 0.4)),
        (0.55, 1.6, 0, 30, (0.35, 0.3, 0.55)),
        (-2.1, -1.5, 0, 10, (0.5, 0.5, 0.6)),
        (1.1, -1.55, 0, -20, (0.6, 0.45, 0.35)),
    ):
        yield from box(flat((x, y, z), yaw_deg), size_m, partial(carton, rng))
    yield from box(flat((1.1, -1.55, 0.35), 5), (0.3, 0.25, 0.28), partial(label, rng))
    chest: Pattern = partial(planks, rng, plank_m=0.2)
    yield from box(flat((-1.6, 1.7, 0)), (1.0, 0.5, 0.75), chest)
    yield from pile(rng, flat((-1.5, 1.7, 0.75), 60), (0.26, 0.2, 0.05), 4)
    yield tin(rng, flat((-0.45, -0.85, 0)), 0.18, 0.45)
    yield tin(rng, flat((1.45, 1.15, 0)), 0.13, 0.3)
    for x, y, radius_m in ((-0.2, 0.85, 0.12), (0.15, -0.65, 0.16), (1.25, -0.95, 0.11), (-1.9, 0.4, 0.14)):
        yield ball(rng, (x, y, radius_m), radius_m)


def pile(rng: Rng, T_world_base: Pose, size_m: tuple[float, float, float], count: int) -> Iterator[TexturedSurface]:
    """Books on top of each other, each a little turned."""
    for level in range(count):
        lying = T_world_base @ flat((0, 0, level * size_m[2]), rng.uniform(-18, 18))
        yield from box(lying, size_m, partial(label, rng))


def tin(rng: Rng, T_world_base: Pose, radius_m: float, height_m: float) -> Cylinder:
    paint = label(rng, (2 * np.pi * radius_m, height_m))
    return Cylinder(T_world_base @ flat((0, 0, height_m / 2)), radius_m, height_m, paint)


def ball(rng: Rng, centre: tuple[float, float, float], radius_m: float) -> Sphere:
    side_m = 2 * np.pi * radius_m
    if rng.random() < 0.5:
        return Sphere(centre, radius_m, poster(rng, (side_m, side_m), shapes=60, texel_m=0.004))
    paint = mottled(rng, (side_m, side_m), colour=vivid(rng), contrast=35, coarsest_m=radius_m / 2)
    return Sphere(centre, radius_m, paint)
