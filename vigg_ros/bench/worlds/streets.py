# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A street with a crossing, as a car with a camera and a LiDAR sees it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from vigg_ros.bench.worlds.canvas import Rng, vivid
from vigg_ros.bench.worlds.paths import Drive, Leg
from vigg_ros.bench.worlds.patterns import asphalt, bodywork, bricks, facade, mottled, poster
from vigg_ros.bench.worlds.poses import Pose, flat, upright
from vigg_ros.bench.worlds.scene import Light, Scene
from vigg_ros.bench.worlds.surfaces import Cylinder, Rectangle, Sphere, TexturedSurface, box

ROAD_WIDTH_M = 7.0
CROSSING_X_M = 20.0
"""The main street runs along x through the origin; a side street leaves it northwards here."""

STREET_DRIVE = Drive(start=(1.3, -0.6, 0.0), speed_mps=6.0, legs=(Leg(12.0), Leg(11.0, turn_deg=90.0), Leg(20.0)))
"""Along the main street, left into the side street, and on."""

_FRONT_M = 8.5
"""From the middle of a road to the house fronts along it."""


def street(seed: int) -> Scene:
    """A street 100 m long with a side street: houses, parked cars, trees, poles, signs and hedges."""
    rng = np.random.default_rng(seed)
    surfaces = (*_ground(rng), *_houses(rng), *_parked_cars(rng), *_trees(rng), *_poles(rng), *_yard_things(rng))
    return Scene(surfaces, Light((-300.0, -500.0, 600.0), ambient=0.5), background_bgr=(235, 215, 190))


def _ground(rng: Rng) -> Iterator[TexturedSurface]:
    """Asphalt everywhere, lane marks, and raised pavements along the roads."""
    yield Rectangle(flat((10, 15, 0)), (120, 110), asphalt(rng, (120, 110)))
    white = partial(mottled, rng, colour=(215, 220, 222), contrast=14, coarsest_m=0.4, texel_m=0.02)
    for x in np.arange(-40, 62, 6.0):
        if abs(x - CROSSING_X_M) > ROAD_WIDTH_M:
            yield Rectangle(flat((x, 0, 0.004)), (2.5, 0.14), white((2.5, 0.14)))
    for y in np.arange(8, 64, 6.0):
        yield Rectangle(flat((CROSSING_X_M, y, 0.004), 90), (2.5, 0.14), white((2.5, 0.14)))
    for x in np.arange(-3, 3.1, 1.0):
        yield Rectangle(flat((CROSSING_X_M + x, 5.3, 0.004), 90), (2.4, 0.5), white((2.4, 0.5)))
    paving = partial(bricks, rng, colour=(135, 140, 145), brick_m=(0.6, 0.4), texel_m=0.03)
    west, east = CROSSING_X_M - ROAD_WIDTH_M / 2, CROSSING_X_M + ROAD_WIDTH_M / 2
    for left, right in ((-45.0, west), (east, 65.0)):
        yield from box(flat(((left + right) / 2, 4.5, 0)), (right - left, 2.0, 0.12), paving)
    yield from box(flat((10, -4.5, 0)), (110.0, 2.0, 0.12), paving)
    for x in (west - 1.0, east + 1.0):
        yield from box(flat((x, 35.5, 0)), (2.0, 60.0, 0.12), paving)


def _houses(rng: Rng) -> Iterator[TexturedSurface]:
    """Rows of houses of different widths, heights and distances, with gaps, and one closing each road."""
    corner_m = ROAD_WIDTH_M / 2 + 2.5
    rows = (
        (flat((-45, _FRONT_M, 0)), CROSSING_X_M - corner_m + 45),
        (flat((65, -_FRONT_M, 0), 180), 110.0),
        (flat((CROSSING_X_M + corner_m, _FRONT_M, 0)), 65 - CROSSING_X_M - corner_m),
        (flat((CROSSING_X_M - corner_m - 0.5, 22, 0), 90), 42.0),
        (flat((CROSSING_X_M + corner_m + 0.5, 64, 0), 270), 42.0),
    )
    for T_world_row, length_m in rows:
        along_m = 0.0
        while along_m < length_m - 6:
            width_m = min(float(rng.uniform(7, 13)), length_m - along_m)
            set_back = flat((along_m + width_m / 2, rng.uniform(0, 1.5), 0))
            yield from _house(rng, T_world_row @ set_back, width_m)
            along_m += width_m + rng.choice((0.0, 0.0, 3.0))
    yield from _house(rng, flat((CROSSING_X_M, 68, 0)), 16.0)
    yield from _house(rng, flat((66, 0, 0), 270), 18.0)
    yield from _house(rng, flat((-46, 0, 0), 90), 18.0)


def _house(rng: Rng, T_world_front: Pose, width_m: float) -> Iterator[TexturedSurface]:
    """A house whose front faces -y of its frame, with a cornice, a porch and balconies; it has no back."""
    height_m, depth_m = float(rng.choice((6.4, 9.4, 12.4))), 9.0
    red = partial(bricks, rng, colour=(70, 85, 140), texel_m=0.025)
    skin = partial(facade, rng) if rng.random() < 0.75 else red
    for x, y, facing_deg, wide_m in (
        (0, 0, 270, width_m),
        (width_m / 2, depth_m / 2, 0, depth_m),
        (-width_m / 2, depth_m / 2, 180, depth_m),
    ):
        T_world_side = T_world_front @ upright((x, y, height_m / 2), facing_deg)
        yield Rectangle(T_world_side, (wide_m, height_m), skin((wide_m, height_m)))
    trim = partial(mottled, rng, colour=(150, 160, 165), contrast=15, coarsest_m=1.0, texel_m=0.03)
    cornice = flat((0, depth_m / 2, height_m))
    yield from box(T_world_front @ cornice, (width_m + 0.5, depth_m + 0.5, 0.35), trim)
    yield from box(T_world_front @ flat((rng.uniform(-1, 1), -0.6, 0)), (1.8, 1.2, 0.4), trim)
    for x in rng.uniform(-width_m / 2 + 1.5, width_m / 2 - 1.5, 2):
        yield from box(T_world_front @ flat((x, -0.5, 3.0)), (2.0, 1.0, 1.0), trim)


def _parked_cars(rng: Rng) -> Iterator[TexturedSurface]:
    """Cars along the kerbs; none where a drive through the middle of the roads would meet them."""
    for x in (-32, -25.5, -12, -5, 3.5, 9.5, 34, 41, 53):
        yield from _car(rng, flat((x + rng.uniform(-0.4, 0.4), -2.65, 0), rng.uniform(-2, 2)))
    for x in (-36, -20, -13, -1, 6, 32, 46):
        yield from _car(rng, flat((x + rng.uniform(-0.4, 0.4), 2.65, 0), 180 + rng.uniform(-2, 2)))
    for y in (14, 20.5, 33, 40, 52):
        yield from _car(rng, flat((CROSSING_X_M + 2.65, y + rng.uniform(-0.4, 0.4), 0), 90))
    for y in (17, 28, 46):
        yield from _car(rng, flat((CROSSING_X_M - 2.65, y + rng.uniform(-0.4, 0.4), 0), 270))


def _car(rng: Rng, T_world_car: Pose) -> Iterator[TexturedSurface]:
    """A car of 4.2 x 1.7 m: body, cabin, wheels."""
    paint = partial(bodywork, rng, colour=vivid(rng, saturation=float(rng.uniform(0, 0.7)), value=0.6))
    glass = partial(mottled, rng, colour=(70, 62, 55), contrast=22, coarsest_m=0.6, texel_m=0.015)
    yield from box(T_world_car @ flat((0, 0, 0.28)), (4.2, 1.7, 0.62), paint)
    yield from box(T_world_car @ flat((-0.3, 0, 0.9)), (2.1, 1.5, float(rng.uniform(0.5, 0.9))), glass)
    rubber = mottled(rng, (2.0, 0.6), colour=(45, 45, 45), contrast=16, coarsest_m=0.2, texel_m=0.015)
    for x in (-1.3, 1.3):
        for y, facing_deg in ((-0.78, 270), (0.78, 90)):
            yield Cylinder(T_world_car @ upright((x, y, 0.31), facing_deg), 0.31, 0.2, rubber)


def _trees(rng: Rng) -> Iterator[TexturedSurface]:
    """Trees on the pavements: a trunk and a crown of four balls of leaves."""
    places = [(x, y) for x in (-38, -22, -8, 6.5, 38, 50) for y in (-5.1, 5.1)]
    places += [(CROSSING_X_M + side, y) for y in (12, 26, 38, 50) for side in (-5.0, 5.0)]
    bark = mottled(rng, (0.8, 3.0), colour=(60, 75, 90), contrast=24, coarsest_m=0.2, texel_m=0.01)
    for x, y in places:
        height_m, radius_m = rng.uniform(2.2, 3.0), rng.uniform(0.1, 0.18)
        yield Cylinder(flat((x, y, height_m / 2)), radius_m, height_m, bark)
        for _ in range(4):
            crown_m = float(rng.uniform(0.6, 1.1))
            offset = rng.uniform((-0.7, -0.7, 0.2), (0.7, 0.7, 1.6))
            side_m = 2 * np.pi * crown_m
            leaves = mottled(rng, (side_m, side_m), colour=(55, 115, 85), contrast=32, coarsest_m=0.4, texel_m=0.03)
            yield Sphere((x + offset[0], y + offset[1], height_m + offset[2]), crown_m, leaves)


def _poles(rng: Rng) -> Iterator[TexturedSurface]:
    """Lamp posts, and signs on posts: as thin as what a LiDAR finds hardest."""
    steel = mottled(rng, (0.5, 6.0), colour=(140, 145, 140), contrast=12, coarsest_m=0.4, texel_m=0.01)
    lamp = partial(mottled, rng, colour=(170, 175, 175), contrast=10, texel_m=0.02)
    for x, y in ((-30, 3.8), (-10, -3.8), (11, 3.8), (30, -3.8), (45, 3.8), (CROSSING_X_M - 3.8, 24)):
        yield Cylinder(flat((x, y, 3.0)), 0.08, 6.0, steel)
        yield from box(flat((x, y * 0.85, 5.9)), (0.3, 1.4, 0.12), lamp)
    signs = ((14.6, -3.9, 180), (15.8, 4.0, 270), (24.6, 4.2, 180), (-16, 3.9, 0), (16, 13, 270))
    for x, y, facing_deg in signs:
        yield Cylinder(flat((x, y, 1.3)), 0.04, 2.6, steel)
        sign = upright((x, y, 2.4), facing_deg) @ flat((0, 0, 0.05))
        yield from box(sign, (0.7, 0.7, 0.03), partial(poster, rng, shapes=10, texel_m=0.008))


def _yard_things(rng: Rng) -> Iterator[TexturedSurface]:
    """Hedges, bins, a kiosk with posters and an advertising column in front of the houses."""
    hedge = partial(mottled, rng, colour=(50, 95, 70), contrast=28, coarsest_m=0.4, texel_m=0.025)
    for x, y, length_m in ((-28.0, 6.6, 7), (-2, 6.4, 5), (2, -6.5, 8), (33, -6.5, 6), (40, 6.5, 9)):
        height_m = float(rng.uniform(0.7, 1.4))
        yield from box(flat((x, y, 0), rng.uniform(-2, 2)), (float(length_m), 0.8, height_m), hedge)
    plastic = partial(mottled, rng, coarsest_m=0.3, contrast=14, texel_m=0.012)
    for x, y in ((-17.0, 5.6), (-16.2, 5.6), (8.2, -5.7), (13.2, 5.6), (28.0, 5.6), (16.0, 9.5)):
        yield from box(flat((x, y, 0.12)), (0.6, 0.65, 1.05), partial(plastic, colour=vivid(rng, value=0.5)))
    bills = partial(poster, rng, shapes=40, texel_m=0.012)
    yield from box(flat((26.3, -6.2, 0)), (3.0, 2.0, 2.7), bills)
    yield Cylinder(flat((14.0, 6.0, 1.4)), 0.6, 2.8, bills((2 * np.pi * 0.6, 2.8)))
