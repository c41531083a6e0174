# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of a registration: matches between two images, depth, and two clouds laid onto each other."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
"""(H, W, 3) BGR."""

OPTICAL_AXES = np.array([[1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0]])
"""Rows right, up, ahead (3, 3) in an optical frame (x right, y down, z forward; REP-103)."""
BODY_AXES = np.array([[0, -1.0, 0], [0, 0, 1.0], [1.0, 0, 0]])
"""Rows right, up, ahead (3, 3) in a body or LiDAR frame (x forward, y left, z up; REP-103)."""

TARGET_BGR, SOURCE_BGR = (178, 114, 0), (0, 94, 213)
"""Blue and vermillion of Okabe and Ito, which colour-blind people can tell apart."""

MAX_MATCH_LINES = 60
"""More lines than this hide the images."""

_WHITE_BGR, _TEXT_BGR, _DISAGREEING_BGR = (255, 255, 255), (70, 70, 70), (190, 190, 190)
_BACKGROUND_GREY, _NO_DEPTH_GREY = 250, 40
_GAP_PX, _GAP_GREY = 6, 160


def draw_matches(
    target_image: NDArray[np.uint8],
    source_image: NDArray[np.uint8],
    pixels_target: NDArray[np.floating],
    pixels_source: NDArray[np.floating],
    *,
    agrees: NDArray[np.bool_] | None = None,
    panel_width_px: int | None = None,
) -> Picture:
    """Both images side by side, target left, with a line for each match of pixels (M, 2) as (u, v).

    Lines are coloured by the direction in which a pixel moved between the images, so that a match that
    does not follow its neighbours stands out. ``agrees`` (M,) says which matches to draw so; the others
    become thin grey lines beneath. Images are (H, W) or (H, W, 3); each is scaled to ``panel_width_px``.
    """
    left, right = (fit_width(_colour(image), panel_width_px) for image in (target_image, source_image))
    shift = np.array([left.shape[1] + _GAP_PX, 0.0])
    a = _scaled(pixels_target, target_image, left)
    b = _scaled(pixels_source, source_image, right)
    agrees = np.ones(len(a), bool) if agrees is None else agrees
    colours = _direction_colours((a - b) / left.shape[1])
    canvas = beside(_dimmed(left), _dimmed(right))
    grey, coloured = _evenly_spread(~agrees), _evenly_spread(agrees)
    canvas = _with_lines(canvas, a[grey], b[grey] + shift, [_DISAGREEING_BGR] * len(grey), opacity=0.45)
    return _with_lines(canvas, a[coloured], b[coloured] + shift, [colours[i] for i in coloured], opacity=0.75)


def draw_depth(depth_m: NDArray[np.floating], *, panel_width_px: int | None = None) -> Picture:
    """A depth image (H, W), metres, near red to far blue, dark without depth; its range is written in it."""
    measured = depth_m > 0
    picture = np.full((*depth_m.shape, 3), _NO_DEPTH_GREY, np.uint8)
    picture[measured], label = _depth_colours(depth_m[measured])
    picture = fit_width(picture, panel_width_px)
    return write(picture, label or "no depth", (8, picture.shape[0] - 10), _WHITE_BGR)


def draw_scan(
    image: NDArray[np.uint8],
    pixels: NDArray[np.floating],
    depth_m: NDArray[np.floating],
    *,
    panel_width_px: int | None = None,
) -> Picture:
    """Points of a scan over the image that sees them: pixels (N, 2), depths (N,) in metres, near red to far blue.

    Wrong extrinsics show as points that do not lie on the things they were measured on.
    """
    picture = _dimmed(fit_width(_colour(image), panel_width_px))
    colours, label = _depth_colours(depth_m)
    places = _scaled(pixels, image, picture)
    for i in np.argsort(-depth_m):  # the near ones on top
        cv2.circle(picture, _fixed_point(places[i]), 16, colours[i].tolist(), -1, cv2.LINE_AA, 4)
    return write(picture, label or "no point in the image", (8, picture.shape[0] - 10), _WHITE_BGR)


def draw_aligned(
    target_points: NDArray[np.floating],
    source_points: NDArray[np.floating],
    *,
    axes: NDArray[np.float64] = OPTICAL_AXES,
    panel_width_px: int = 480,
) -> Picture:
    """Two clouds (N, 3) and (M, 3), metres, both in the target's frame, from above and from the front.

    Target blue, source vermillion, dark where they coincide. ``axes`` (3, 3) are the directions right, up
    and ahead in the target's frame, see OPTICAL_AXES and BODY_AXES. Both views have the scale of the bar.
    """
    clouds = [np.asarray(points, np.float64) @ axes.T for points in (target_points, source_points)]
    size = (panel_width_px, round(0.75 * panel_width_px))
    low, high = _bounds(np.concatenate(clouds))
    px_per_m = 0.92 * min(size[0] / (high - low)[0], size[1] / (high - low)[1:].max())
    middle = (low + high) / 2
    panels = []
    for name, rows in (("from above", (0, 2)), ("from the front", (0, 1))):
        flat = [(cloud - middle)[:, rows] * px_per_m for cloud in clouds]
        panel = _with_scale_bar(_shade(flat, size), px_per_m)
        panels.append(write(panel, name, (10, 20), _TEXT_BGR))
    picture = write(beside(*panels), "target", (10, size[1] - 12), TARGET_BGR)
    return write(picture, "source", (70, size[1] - 12), SOURCE_BGR)


def beside(left: Picture, right: Picture) -> Picture:
    """Two pictures side by side, at the top of a common height."""
    height = max(left.shape[0], right.shape[0])
    canvas = np.full((height, left.shape[1] + _GAP_PX + right.shape[1], 3), _GAP_GREY, np.uint8)
    canvas[: left.shape[0], : left.shape[1]] = left
    canvas[: right.shape[0], left.shape[1] + _GAP_PX :] = right
    return canvas


def fit_width(picture: Picture, width_px: int | None) -> Picture:
    """The picture scaled to a width; as it is for None."""
    if width_px is None or width_px == picture.shape[1]:
        return picture
    height_px = max(1, round(picture.shape[0] * width_px / picture.shape[1]))
    shrinks = width_px < picture.shape[1]
    method = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(picture, (width_px, height_px), interpolation=method), np.uint8)


def write(picture: Picture, text: str, place_px: tuple[int, int], colour: tuple[int, int, int]) -> Picture:
    """The picture with a line of ASCII text, its lower left corner at (u, v)."""
    picture = picture.copy()
    cv2.putText(picture, text, place_px, cv2.FONT_HERSHEY_SIMPLEX, 0.45, colour, 1, cv2.LINE_AA)
    return picture


def _depth_colours(depth_m: NDArray[np.floating]) -> tuple[NDArray[np.uint8], str]:
    """BGR (N, 3) of depths (N,), near red to far blue, and their range in words; empty without depths."""
    if not len(depth_m):
        return np.empty((0, 3), np.uint8), ""
    near, far = np.percentile(depth_m, (2, 98))
    share = np.clip((far - depth_m) / max(far - near, 1e-6), 0.0, 1.0)
    colours = cv2.applyColorMap((255 * share).astype(np.uint8)[:, None], cv2.COLORMAP_TURBO)[:, 0]
    return np.asarray(colours, np.uint8), f"{near:.2g} to {far:.2g} m"


def _colour(image: NDArray[np.uint8]) -> Picture:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image, np.uint8)


def _dimmed(picture: Picture) -> Picture:
    """Towards grey and dark, so that thin lines can be seen."""
    grey = _colour(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY))
    return np.asarray(cv2.addWeighted(picture, 0.35, grey, 0.4, 0), np.uint8)


def _scaled(pixels: NDArray[np.floating], image: Picture, panel: Picture) -> NDArray[np.float64]:
    """Pixels of an image as pixels of its panel; both count from the centre of the first pixel."""
    scale = panel.shape[1] / image.shape[1]
    return np.asarray((np.asarray(pixels, np.float64).reshape(-1, 2) + 0.5) * scale - 0.5)


def _evenly_spread(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """At most MAX_MATCH_LINES of the true rows, evenly spread."""
    rows = np.flatnonzero(mask)
    return rows if len(rows) <= MAX_MATCH_LINES else rows[np.linspace(0, len(rows) - 1, MAX_MATCH_LINES).astype(int)]


def _direction_colours(moved: NDArray[np.float64]) -> list[tuple[int, ...]]:
    """BGR by direction (hue) and distance (full colour at 10 % of the width) of moves (M, 2)."""
    hue = (np.rad2deg(np.arctan2(moved[:, 1], moved[:, 0])) % 360) / 2
    saturation = 60 + 195 * np.clip(np.linalg.norm(moved, axis=1) / 0.1, 0, 1)
    hsv = np.column_stack((hue, saturation, np.full(len(moved), 255.0))).astype(np.uint8)[None]
    bgr = cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)[0] if len(moved) else np.empty((0, 3), np.uint8)
    return [tuple(int(channel) for channel in colour) for colour in bgr]


def _fixed_point(pixel: NDArray[np.float64]) -> tuple[int, int]:
    """A pixel in OpenCV's fixed point of 4 bits, so that lines end where they should."""
    return round(float(pixel[0]) * 16), round(float(pixel[1]) * 16)


def _with_lines(
    picture: Picture,
    starts: NDArray[np.float64],
    ends: NDArray[np.float64],
    colours: Sequence[tuple[int, ...]],
    *,
    opacity: float,
) -> Picture:
    """The picture with lines between pixels (M, 2), with dots at their ends."""
    inked = picture.copy()
    for start, end, colour in zip(starts, ends, colours, strict=True):
        cv2.line(inked, _fixed_point(start), _fixed_point(end), colour, 1, cv2.LINE_AA, 4)
        for dot in (start, end):
            cv2.circle(inked, _fixed_point(dot), 2 * 16, colour, -1, cv2.LINE_AA, 4)
    return np.asarray(cv2.addWeighted(inked, opacity, picture, 1 - opacity, 0), np.uint8)


def _bounds(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A box around nearly all points; a few far ones would shrink the rest."""
    if len(points) == 0:
        return np.full(3, -1.0), np.full(3, 1.0)
    low, high = np.percentile(points, (0.5, 99.5), axis=0)
    return low - 0.05, high + 0.05


def _shade(clouds: list[NDArray[np.float64]], size: tuple[int, int]) -> Picture:
    """Clouds of pixels (N, 2), right and up from the middle, as ink on paper: where both are, both inks."""
    paper = np.full((size[1], size[0], 3), float(_BACKGROUND_GREY))
    for cloud, colour in zip(clouds, (TARGET_BGR, SOURCE_BGR), strict=True):
        column = np.rint(size[0] / 2 + cloud[:, 0]).astype(int)
        row = np.rint(size[1] / 2 - cloud[:, 1]).astype(int)
        inside = (column >= 0) & (column < size[0]) & (row >= 0) & (row < size[1])
        count = np.zeros((size[1], size[0]))
        np.add.at(count, (row[inside], column[inside]), 1.0)
        ink = 1 - np.exp(-1.5 * cv2.GaussianBlur(count, (3, 3), 0.7))
        paper *= 1 - ink[..., None] * (1 - np.array(colour) / 255)
    return paper.astype(np.uint8)


def _with_scale_bar(picture: Picture, px_per_m: float) -> Picture:
    """The picture with a bar of 1, 2 or 5 times a power of ten metres at the lower right."""
    height, width = picture.shape[:2]
    longest_m = 0.25 * width / px_per_m
    power = 10.0 ** math.floor(math.log10(longest_m))
    length_m = next(digit * power for digit in (5, 2, 1) if digit * power <= longest_m)
    end = (width - 12, height - 12)
    start = (end[0] - round(length_m * px_per_m), end[1])
    picture = write(picture, f"{length_m:g} m", (start[0], end[1] - 6), _TEXT_BGR)
    return np.asarray(cv2.line(picture, start, end, _TEXT_BGR, 2, cv2.LINE_AA), np.uint8)
