# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Painted surfaces: each call paints a new texture of a size in metres from a generator's numbers.

All are band-limited: nothing is finer than about three texels, so that a feature that one view
finds is there in the next.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.worlds.texture import Texture

Canvas = NDArray[np.float32]
Colour = tuple[float, float, float]
"""BGR, 0..255."""
Size = tuple[float, float]
Rng = np.random.Generator


def vivid(rng: Rng, *, saturation: float = 0.5, value: float = 0.75) -> Colour:
    """A colour of any hue."""
    hsv = np.array([[[rng.uniform(0, 360), saturation, value * rng.uniform(0.7, 1.2)]]], dtype=np.float32)
    blue, green, red = np.clip(255 * cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)[0, 0], 0, 255)
    return float(blue), float(green), float(red)


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
    canvas = _canvas(size_m, texel_m, colour)
    canvas += contrast * _stains(rng, canvas, coarsest_m / texel_m, octaves)
    return _texture(canvas, texel_m)


def poster(rng: Rng, size_m: Size, *, shapes: int = 30, texel_m: float = 0.004) -> Texture:
    """A picture: shapes of all sizes and colours on a stained ground, in a frame, with a line of text."""
    canvas = _canvas(size_m, texel_m, vivid(rng, saturation=0.3))
    canvas += 12 * _stains(rng, canvas, 0.3 / texel_m, 5)
    largest_px = 0.25 * min(canvas.shape[:2])
    for size_px in np.geomspace(largest_px, 4, shapes):
        _draw_shape(rng, canvas, size_px * rng.uniform(0.7, 1.3))
    height, width = canvas.shape[:2]
    _write(rng, canvas, (0.08 * width, 0.9 * height), (0.84 * width, 0.08 * height))
    rim_px = max(2, round(0.012 / texel_m))
    cv2.rectangle(canvas, (0, 0), (width - 1, height - 1), vivid(rng, value=0.4), 2 * rim_px)
    return _texture(canvas, texel_m)


def label(rng: Rng, size_m: Size, *, texel_m: float = 0.003) -> Texture:
    """A book's spine or a tin: one colour with bands and lines of text."""
    ground = vivid(rng)
    canvas = _canvas(size_m, texel_m, ground)
    height, width = canvas.shape[:2]
    for row in rng.uniform(0.05, 0.95, 3):
        top, thick = int(row * height), max(2, int(rng.uniform(0.02, 0.1) * height))
        canvas[top : top + thick] = vivid(rng)
    ink = (20, 20, 20) if sum(ground) > 380 else (235, 235, 235)
    for row in (0.3, 0.5, 0.7, 0.9):
        line_px = (rng.uniform(0.5, 0.88) * width, 0.14 * height)
        _write(rng, canvas, (0.06 * width, row * height), line_px, ink=ink)
    canvas += 8 * _stains(rng, canvas, 0.1 / texel_m, 4)
    return _texture(canvas, texel_m)


def carton(rng: Rng, size_m: Size, *, texel_m: float = 0.004) -> Texture:
    """A cardboard box: stained brown, a strip of tape, a sticker, a stamp."""
    canvas = _canvas(size_m, texel_m, (95 + rng.uniform(-15, 15), 140 + rng.uniform(-20, 20), 175))
    canvas += 10 * _stains(rng, canvas, 0.3 / texel_m, 6)
    height, width = canvas.shape[:2]
    tape = int(width * rng.uniform(0.4, 0.55))
    canvas[:, tape : tape + max(3, width // 12)] *= rng.uniform(0.65, 0.85)
    left, top = int(rng.uniform(0.05, 0.5) * width), int(rng.uniform(0.1, 0.5) * height)
    sticker = canvas[top : top + height // 3, left : left + width // 3]
    sticker[:] = (225, 230, 235)
    for row in (0.3, 0.55, 0.85):
        _write(rng, sticker, (0.08 * sticker.shape[1], row * sticker.shape[0]), (width * 0.27, height * 0.08))
    _write(rng, canvas, (0.1 * width, 0.92 * height), (0.5 * width, 0.14 * height))
    return _texture(canvas, texel_m)


def planks(rng: Rng, size_m: Size, *, plank_m: float = 0.14, texel_m: float = 0.005) -> Texture:
    """A wooden floor or board: planks along x with their own tone, grain and ends."""
    canvas = _canvas(size_m, texel_m, (88, 125, 165))
    plank_px = max(4, round(plank_m / texel_m))
    for top in range(0, canvas.shape[0], plank_px):
        left = -int(rng.uniform(0, 1.2) / texel_m)
        while left < canvas.shape[1]:
            right = left + int(rng.uniform(0.6, 1.4) / texel_m)
            canvas[top : top + plank_px, max(left, 0) : right] *= rng.uniform(0.72, 1.15)
            canvas[top : top + plank_px, max(left, 0) : max(left + 1, 0)] *= 0.6
            left = right
        canvas[top : top + 1] *= 0.6
    along = _stains(rng, canvas[:, ::6], 0.3 / texel_m, 6)
    canvas += 11 * cv2.resize(along, canvas.shape[1::-1], interpolation=cv2.INTER_CUBIC)[..., None]
    canvas += 5 * _stains(rng, canvas, 0.08 / texel_m, 3)
    return _texture(canvas, texel_m)


def bricks(
    rng: Rng,
    size_m: Size,
    *,
    colour: Colour = (75, 95, 160),
    brick_m: Size = (0.25, 0.08),
    texel_m: float = 0.012,
) -> Texture:
    """Courses of bricks, every other one shifted by half a brick, each brick with its own tone."""
    canvas = _canvas(size_m, texel_m, colour)
    wide, high = max(4, round(brick_m[0] / texel_m)), max(3, round(brick_m[1] / texel_m))
    rows, columns = -(-canvas.shape[0] // high), -(-canvas.shape[1] // wide) + 1
    tone = rng.normal(1.0, 0.13, (rows, columns))
    row, column = np.mgrid[: canvas.shape[0], : canvas.shape[1]]
    shifted = column + (row // high % 2) * (wide // 2)
    canvas *= tone[row // high, shifted // wide][..., None].astype(np.float32)
    canvas[(row % high == 0) | (shifted % wide == 0)] = (165, 170, 175)
    canvas += 12 * _stains(rng, canvas, 1.5 / texel_m, 6)
    return _texture(canvas, texel_m)


def tiles(rng: Rng, size_m: Size, *, tile_m: float = 0.3, texel_m: float = 0.004) -> Texture:
    """One decorated tile again and again: every place looks like the next one."""
    side_px = round(tile_m / texel_m)
    tile = _canvas((side_px * texel_m, side_px * texel_m), texel_m, vivid(rng, saturation=0.3))
    for size_px in np.geomspace(0.3 * side_px, 4, 14):
        _draw_shape(rng, tile, size_px)
    cv2.rectangle(tile, (0, 0), (side_px - 1, side_px - 1), (60, 60, 60), 2)
    height, width = _canvas(size_m, texel_m, (0, 0, 0)).shape[:2]
    copies = np.tile(tile, (-(-height // side_px), -(-width // side_px), 1))
    return _texture(copies[:height, :width], texel_m)


def _canvas(size_m: Size, texel_m: float, colour: Colour) -> Canvas:
    """An even canvas (H, W, 3) float32 that covers the size; it may stand out by less than a texel."""
    width, height = (max(8, int(np.ceil(length_m / texel_m))) for length_m in size_m)
    canvas = np.empty((height, width, 3), dtype=np.float32)
    canvas[:] = colour
    return canvas


def _texture(canvas: Canvas, texel_m: float) -> Texture:
    soft = cv2.GaussianBlur(canvas, (0, 0), 0.8)
    return Texture.of(np.clip(np.rint(soft), 0, 255).astype(np.uint8), texel_m)


def _stains(rng: Rng, canvas: NDArray[np.floating[Any]], coarsest_px: float, octaves: int) -> Canvas:
    """Noise (H, W, 1) of unit variance: octaves of smooth value noise from coarsest_px down to 3 texels."""
    height, width = canvas.shape[:2]
    field = np.zeros((height, width), dtype=np.float32)
    cell_px, amplitude = max(coarsest_px, 3.0), 1.0
    for _ in range(octaves):
        cells = rng.standard_normal((int(height / cell_px) + 3, int(width / cell_px) + 3)).astype(np.float32)
        smooth = cv2.resize(cells, None, fx=cell_px, fy=cell_px, interpolation=cv2.INTER_CUBIC)
        field += amplitude * smooth[int(cell_px) : int(cell_px) + height, int(cell_px) : int(cell_px) + width]
        cell_px, amplitude = cell_px / 2, amplitude * 0.8
        if cell_px < 3:
            break
    return np.asarray(((field - field.mean()) / max(float(field.std()), 1e-6))[..., None])


def _draw_shape(rng: Rng, canvas: Canvas, size_px: float) -> None:
    """One disc, ring, polygon or bar of about size_px in radius, somewhere."""
    centre = rng.uniform((0, 0), canvas.shape[1::-1])
    colour = vivid(rng, saturation=rng.uniform(0.1, 0.9), value=rng.uniform(0.3, 1.0))
    kind = rng.integers(3)
    if kind == 0:
        thick = -1 if rng.random() < 0.6 else max(2, int(size_px / 3))
        cv2.circle(canvas, centre.astype(int).tolist(), max(2, int(size_px)), colour, thick)
        return
    angles = np.sort(rng.uniform(0, 2 * np.pi, 3 + kind * 2))
    stretch = rng.uniform(0.5, 1.4, (len(angles), 1))
    outline = centre + size_px * stretch * np.column_stack((np.cos(angles), np.sin(angles)))
    cv2.fillPoly(canvas, [np.rint(outline).astype(np.int32)], colour)


def _write(rng: Rng, canvas: Canvas, baseline_px: Size, size_px: Size, *, ink: Colour = (30, 30, 30)) -> None:
    """A line of invented letters from a baseline point: each a few strokes between points of a grid."""
    width_px, height_px = size_px
    letter_px = np.array((0.6 * height_px, height_px))
    thick = max(1, round(0.12 * height_px))
    for left_px in np.arange(0, width_px - letter_px[0], 0.9 * height_px):
        if rng.random() < 0.15:
            continue  # the space between words
        corner = np.array(baseline_px) + (left_px, -height_px)
        strokes = corner + letter_px * rng.integers(0, 3, (4, 2)) / 2
        cv2.polylines(canvas, [np.rint(strokes).astype(np.int32)], False, ink, thick)
