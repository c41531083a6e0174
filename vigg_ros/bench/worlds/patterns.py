# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Painted surfaces: each call paints a new texture of a size in metres from a generator's numbers."""

from __future__ import annotations

import cv2
import numpy as np

from vigg_ros.bench.worlds.canvas import Colour, Rng, Size, blank, draw_shape, draw_window, finish, stains, vivid, write
from vigg_ros.bench.worlds.texture import Texture


def mottled(
    rng: Rng,
    size_m: Size,
    *,
    colour: Colour,
    contrast: float = 20.0,
    coarsest_m: float = 0.5,
    octaves: int = 6,
    texel_m: float = 0.004,
) -> Texture:
    """One colour with irregular stains of all sizes; contrast is their standard deviation in grey levels."""
    canvas = blank(size_m, texel_m, colour)
    canvas += contrast * stains(rng, canvas, coarsest_m / texel_m, octaves)
    return finish(canvas, texel_m)


def poster(rng: Rng, size_m: Size, *, shapes: int = 30, texel_m: float = 0.004) -> Texture:
    """A picture: shapes of all sizes and colours on a stained ground, in a frame, with a line of text."""
    canvas = blank(size_m, texel_m, vivid(rng, saturation=0.3))
    canvas += 12 * stains(rng, canvas, 0.3 / texel_m, 5)
    largest_px = 0.25 * min(canvas.shape[:2])
    for size_px in np.geomspace(largest_px, 4, shapes):
        draw_shape(rng, canvas, size_px * rng.uniform(0.7, 1.3))
    height, width = canvas.shape[:2]
    write(rng, canvas, (0.08 * width, 0.9 * height), (0.84 * width, 0.08 * height))
    rim_px = max(2, round(0.012 / texel_m))
    cv2.rectangle(canvas, (0, 0), (width - 1, height - 1), vivid(rng, value=0.4), 2 * rim_px)
    return finish(canvas, texel_m)


def label(rng: Rng, size_m: Size, *, texel_m: float = 0.003) -> Texture:
    """A book's spine or a tin: one colour with bands and lines of text."""
    ground = vivid(rng)
    canvas = blank(size_m, texel_m, ground)
    height, width = canvas.shape[:2]
    for row in rng.uniform(0.05, 0.95, 3):
        top, thick = int(row * height), max(2, int(rng.uniform(0.02, 0.1) * height))
        canvas[top : top + thick] = vivid(rng)
    ink = (20, 20, 20) if sum(ground) > 380 else (235, 235, 235)
    for row in (0.3, 0.5, 0.7, 0.9):
        line_px = (rng.uniform(0.5, 0.88) * width, 0.14 * height)
        write(rng, canvas, (0.06 * width, row * height), line_px, ink=ink)
    canvas += 8 * stains(rng, canvas, 0.1 / texel_m, 4)
    return finish(canvas, texel_m)


def carton(rng: Rng, size_m: Size, *, texel_m: float = 0.004) -> Texture:
    """A cardboard box: stained brown, a strip of tape, a sticker, a stamp."""
    canvas = blank(size_m, texel_m, (95 + rng.uniform(-15, 15), 140 + rng.uniform(-20, 20), 175))
    canvas += 10 * stains(rng, canvas, 0.3 / texel_m, 6)
    height, width = canvas.shape[:2]
    tape = int(width * rng.uniform(0.4, 0.55))
    canvas[:, tape : tape + max(3, width // 12)] *= rng.uniform(0.65, 0.85)
    left, top = int(rng.uniform(0.05, 0.5) * width), int(rng.uniform(0.1, 0.5) * height)
    sticker = canvas[top : top + height // 3, left : left + width // 3]
    sticker[:] = (225, 230, 235)
    for row in (0.3, 0.55, 0.85):
        write(rng, sticker, (0.08 * sticker.shape[1], row * sticker.shape[0]), (width * 0.27, height * 0.08))
    write(rng, canvas, (0.1 * width, 0.92 * height), (0.5 * width, 0.14 * height))
    return finish(canvas, texel_m)


def planks(rng: Rng, size_m: Size, *, plank_m: float = 0.14, texel_m: float = 0.005) -> Texture:
    """A wooden floor or board: planks along x with their own tone, grain and ends."""
    canvas = blank(size_m, texel_m, (88, 125, 165))
    plank_px = max(4, round(plank_m / texel_m))
    for top in range(0, canvas.shape[0], plank_px):
        left = -int(rng.uniform(0, 1.2) / texel_m)
        while left < canvas.shape[1]:
            right = left + int(rng.uniform(0.6, 1.4) / texel_m)
            canvas[top : top + plank_px, max(left, 0) : right] *= rng.uniform(0.72, 1.15)
            canvas[top : top + plank_px, max(left, 0) : max(left + 1, 0)] *= 0.6
            left = right
        canvas[top : top + 1] *= 0.6
    along = stains(rng, canvas[:, ::6], 0.3 / texel_m, 6)
    canvas += 11 * cv2.resize(along, canvas.shape[1::-1], interpolation=cv2.INTER_CUBIC)[..., None]
    canvas += 5 * stains(rng, canvas, 0.08 / texel_m, 3)
    return finish(canvas, texel_m)


def bricks(
    rng: Rng, size_m: Size, *, colour: Colour = (75, 95, 160), brick_m: Size = (0.25, 0.08), texel_m: float = 0.012
) -> Texture:
    """Courses of bricks, every other one shifted by half a brick, each brick with its own tone."""
    canvas = blank(size_m, texel_m, colour)
    wide, high = max(4, round(brick_m[0] / texel_m)), max(3, round(brick_m[1] / texel_m))
    rows, columns = -(-canvas.shape[0] // high), -(-canvas.shape[1] // wide) + 1
    tone = rng.normal(1.0, 0.13, (rows, columns))
    row, column = np.mgrid[: canvas.shape[0], : canvas.shape[1]]
    shifted = column + (row // high % 2) * (wide // 2)
    canvas *= tone[row // high, shifted // wide][..., None].astype(np.float32)
    canvas[(row % high == 0) | (shifted % wide == 0)] = (165, 170, 175)
    canvas += 12 * stains(rng, canvas, 1.5 / texel_m, 6)
    return finish(canvas, texel_m)


def tiles(rng: Rng, size_m: Size, *, tile_m: float = 0.3, texel_m: float = 0.004) -> Texture:
    """One decorated tile again and again: every place looks like the next one."""
    side_px = round(tile_m / texel_m)
    tile = blank((side_px * texel_m, side_px * texel_m), texel_m, vivid(rng, saturation=0.3))
    for size_px in np.geomspace(0.3 * side_px, 4, 14):
        draw_shape(rng, tile, size_px)
    cv2.rectangle(tile, (0, 0), (side_px - 1, side_px - 1), (60, 60, 60), 2)
    height, width = blank(size_m, texel_m, (0, 0, 0)).shape[:2]
    copies = np.tile(tile, (-(-height // side_px), -(-width // side_px), 1))
    return finish(copies[:height, :width], texel_m)


def facade(rng: Rng, size_m: Size, *, texel_m: float = 0.025) -> Texture:
    """A house front: plaster or bricks, a plinth, and rows of windows that differ in what they show."""
    ground = rng.uniform((110, 140, 150), (200, 215, 225))
    canvas = blank(size_m, texel_m, (ground[0], ground[1], ground[2]))
    canvas += 9 * stains(rng, canvas, 2.0 / texel_m, 7)
    height, width = canvas.shape[:2]
    canvas[height - round(0.6 / texel_m) :] *= 0.6
    across, up = max(1, int(size_m[0] / rng.uniform(2.2, 3.0))), max(1, int(size_m[1] / 3.0))
    for row in range(up):
        for column in range(across):
            middle = ((column + 0.5) / across * width, height - (row + 0.55) * 3.0 / texel_m)
            wide_m, high_m = (1.0, 2.3) if row == 0 and column == across // 2 else (1.2, 1.4)
            draw_window(rng, canvas, middle, (wide_m / texel_m, high_m / texel_m))
    return finish(canvas, texel_m)


def asphalt(rng: Rng, size_m: Size, *, texel_m: float = 0.05) -> Texture:
    """A road: grey with stains of all sizes, patches where it was mended, and cracks."""
    canvas = blank(size_m, texel_m, (95, 95, 92))
    canvas += 10 * stains(rng, canvas, 4.0 / texel_m, 8)
    height, width = canvas.shape[:2]
    area = size_m[0] * size_m[1]
    for left, top in rng.uniform((0, 0), (width, height), (int(area / 60), 2)).astype(int):
        wide, high = (rng.uniform(0.4, 2.5, 2) / texel_m).astype(int)
        canvas[top : top + high, left : left + wide] *= rng.uniform(0.7, 1.15)
    for start in rng.uniform((0, 0), (width, height), (int(area / 25), 1, 2)):
        crack = start + np.cumsum(rng.normal(0, 0.4 / texel_m, (8, 2)), axis=0)
        cv2.polylines(canvas, [np.rint(crack).astype(np.int32)], False, (55, 55, 55), 2)
    return finish(canvas, texel_m)


def bodywork(rng: Rng, size_m: Size, *, colour: Colour, texel_m: float = 0.012) -> Texture:
    """The side of a car: paint with dirt, door joints, a dark sill, lamps and a plate."""
    canvas = blank(size_m, texel_m, colour)
    canvas += 8 * stains(rng, canvas, 0.8 / texel_m, 6)
    height, width = canvas.shape[:2]
    canvas[int(0.8 * height) :] *= 0.45
    for joint in (0.3, 0.52, 0.75):
        canvas[:, int(joint * width) : int(joint * width) + 2] *= 0.5
    for edge, lamp in ((0.02, (60, 60, 200)), (0.88, (210, 230, 235))):
        left, top = int(edge * width), int(0.25 * height)
        canvas[top : top + height // 5, left : left + width // 10] = lamp
    write(rng, canvas, (0.4 * width, 0.7 * height), (0.25 * width, 0.14 * height), ink=(240, 240, 240))
    return finish(canvas, texel_m)
