#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Registers two RGB-D images, prints the motion between them, and draws the matches that agree.

    python examples/register_two_images.py                              # renders two views of a room itself
    python examples/register_two_images.py A.jpg A.png B.jpg B.png --intrinsics 585 585 320 240

Depth images are 16-bit millimetres, aligned to the colour images. Writes matches.png, or what --output says.
"""

from __future__ import annotations

import argparse

import cv2
import numpy as np

from vigg_ros.bench.worlds import HandheldLoop, render_rgbd, room
from vigg_ros.pictures import draw_matches
from vigg_ros.registration import Camera, Config, Frame, Registration, extract, register


def rendered() -> list[Frame]:
    """Two views of a room, half a second apart on a handheld path."""
    camera = Camera(width_px=320, height_px=240, fx_px=262.5, fy_px=262.5, cx_px=159.5, cy_px=119.5)
    world, path = room(seed=1), HandheldLoop()
    return [Frame.from_depth(*render_rgbd(world, camera, path.T_world_camera(t)), camera) for t in (0.0, 0.5)]


def loaded(colour: str, depth: str, intrinsics: list[float]) -> Frame:
    """A colour image and its depth image."""
    image, depth_mm = cv2.imread(colour, cv2.IMREAD_COLOR), cv2.imread(depth, cv2.IMREAD_UNCHANGED)
    if image is None or depth_mm is None:
        raise SystemExit(f"{colour if image is None else depth} is no readable image")
    depth_m = depth_mm.astype(np.float32) / 1000
    return Frame.from_depth(image, depth_m, Camera(image.shape[1], image.shape[0], *intrinsics))


def main() -> None:
    """Register, print, draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("files", nargs="*", help="colour and depth of the target, colour and depth of the source")
    parser.add_argument("--intrinsics", type=float, nargs=4, metavar=("FX", "FY", "CX", "CY"), help="in pixels")
    parser.add_argument("--output", default="matches.png")
    arguments = parser.parse_args()
    if arguments.files and (len(arguments.files) != 4 or not arguments.intrinsics):
        parser.error("give four files with --intrinsics, or none")
    pairs = zip(arguments.files[::2], arguments.files[1::2], strict=True)
    target, source = [loaded(*pair, arguments.intrinsics) for pair in pairs] or rendered()

    config = Config.preset("rgbd")
    outcome = register(extract(target, config), extract(source, config), config)
    if not isinstance(outcome, Registration):
        raise SystemExit(f"no answer: {outcome.reason.value}: {outcome.message}")
    print(np.round(outcome.T_target_source, 3))  # p_target = T_target_source @ p_source, metres
    pixels = outcome.visual_inliers_px  # u, v in the target's image, u, v in the source's
    cv2.imwrite(arguments.output, draw_matches(target.image, source.image, pixels[:, :2], pixels[:, 2:]))
    print(f"{len(pixels)} matches agree, {outcome.evidence.overlap:.0%} of the surface coincides: {arguments.output}")


if __name__ == "__main__":
    main()
