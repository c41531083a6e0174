# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is computed once per frame and kept with a keyframe."""

from __future__ import annotations

from dataclasses import dataclass

from vigg_ros.registration.config import Config
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.geometric import Landmarks, Surface, build_landmarks, build_surface, rows_in_range
from vigg_ros.registration.visibility import View
from vigg_ros.registration.visual import Keypoints, detect


@dataclass(frozen=True, slots=True)
class Features:
    """A frame as registration sees it; all points are in the frame of the results."""

    keypoints: Keypoints
    landmarks: Landmarks
    surface: Surface
    view: View


def extract(frame: Frame, config: Config) -> Features:
    """Keypoints, surface, landmarks and lines of sight of a frame.

    Never fails for want of texture or depth: that shows in the sizes, and ``register`` says so.
    """
    surface = build_surface(frame.points(), config.geometric)
    keypoints = detect(frame, config.visual)
    return Features(
        keypoints=keypoints.select(rows_in_range(keypoints.points, config.geometric)),
        landmarks=build_landmarks(surface, config.geometric),
        surface=surface,
        view=frame.geometry.view(),
    )
