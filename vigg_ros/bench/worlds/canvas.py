# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What painters have in hand: a canvas, colours, stains, shapes, letters and windows.

All is band-limited: nothing is finer than about three texels, so that a feature that one view
finds is there in the next.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.worlds.texture import Texture

Canvas = NDArray[np.float32]
"""(H, W, 3) BGR, 0..255, on a grid of square texels."""
Colour = tuple[float, float, float]
"""BGR, 0..255."""
Size = tuple[float, float]
Rng = np.random.Generator


def vivid(rng: Rng, *, saturation: float = 0.5, value: float = 0.75) -> Colour:
    """A colour of any hue."""
    hsv = np.array([[[rng.uniform(0, 360), saturation, value * rng.uniform(0.7, 1.2)]]], dtype=np.float32)
    blue, green, red = np.clip(255 * cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)[0, 0], 0, 255)
    return float(blue), float(green), float(red)


def blank(size_m: Size, texel_m: float, colour: Colour) -> Canvas:
    """An even canvas (H, W, 3) float32 that covers the size; it may stand out by less than a texel."""
    width, height = (max(8, int(np.ceil(length_m / texel_m))) for length_m in size_m)
    canvas = np.empty((height, width, 3), dtype=np.float32)
    canvas[:] = colour
    return canvas


def finish(canvas: Canvas, texel_m: float) -> Texture:
    soft = cv2.GaussianBlur(canvas, (0, 0), 0.8)
    np.rint(np.clip(soft, 0, 255, out=soft), out=soft)
    return Texture.of(soft.astype(np.uint8), texel_m)


def stains(rng: Rng, canvas: NDArray[np.floating[Any]], coarsest_px: float, octaves: int) -> Canvas:
    """Noise (H, W, 1) of unit variance, with cells from coarsest_px down by halves, to 3 texels at least.

    Each octave is added on its own grid of cells and carried on to the next, finer one.
    """
    size_px = np.array(canvas.shape[1::-1])
    field, amplitude = np.zeros((2, 2), dtype=np.float32), 1.0
    for octave in range(octaves):
        cell_px = coarsest_px / 2**octave
        if octave and cell_px < 3:
            break
        columns, rows = (np.ceil(size_px / cell_px).astype(int) + 1).tolist()
        field = cv2.resize(field, (columns, rows), interpolation=cv2.INTER_CUBIC)
        field += amplitude * rng.standard_normal((rows, columns), dtype=np.float32)
        amplitude *= 0.8
    field = cv2.resize(field, size_px.tolist(), interpolation=cv2.INTER_CUBIC)
    return np.asarray(((field - field.mean()) / max(float(field.std()), 1e-6))[..., None])


def draw_shape(rng: Rng, canvas: Canvas, size_px: float) -> None:
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


def write(rng: Rng, canvas: Canvas, baseline_px: Size, size_px: Size, *, ink: Colour = (30, 30, 30)) -> None:
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


def draw_window(rng: Rng, canvas: Canvas, middle_px: Size, size_px: Size) -> None:
    """A frame with panes: dark glass that mirrors something, some with a curtain."""
    half = np.array(size_px) / 2
    corners = np.rint(np.array([middle_px - half, middle_px + half])).astype(int)
    (left, top), (right, bottom) = np.clip(corners, 0, np.array(canvas.shape[1::-1]) - 1).tolist()
    frame = tuple(rng.uniform((150, 150, 150), (245, 245, 245)).tolist())
    cv2.rectangle(canvas, (left, top), (right, bottom), frame, -1)
    glass = canvas[top + 4 : bottom - 3, left + 4 : right - 3]
    if glass.size == 0:
        return
    glass[:] = rng.uniform((40, 35, 30), (110, 90, 70))
    glass += 18 * stains(rng, glass, 0.4 * size_px[0], 5)
    if rng.random() < 0.5:
        glass[: int(rng.uniform(0.2, 0.9) * len(glass))] += rng.uniform(30, 110)
    bars = rng.integers(1, 4)
    for bar in range(1, bars + 1):
        column = left + bar * (right - left) // (bars + 1)
        cv2.rectangle(canvas, (column - 1, top), (column + 1, bottom), frame, -1)
