# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The picture on ~/matches: a keyframe and a frame with the matches that their registration rests on."""

from __future__ import annotations

import numpy as np

from vigg_ros.pictures import Picture, draw_matches
from vigg_ros.registration.result import Registration
from vigg_ros.tracking.registrar import Attempt, Estimate


def matches_picture(estimate: Estimate, attempt: Attempt) -> Picture:
    """Both images side by side, the keyframe left; a blank one where there is none, no lines while lost."""
    image, outcome = attempt.frame.image, estimate.outcome
    if attempt.keyframe is None or not isinstance(outcome, Registration):
        left = np.full_like(image, 255) if attempt.keyframe is None else attempt.keyframe.frame.image
        return draw_matches(left, image, np.empty((0, 2)), np.empty((0, 2)))
    pixels = outcome.visual_inliers_px
    return draw_matches(attempt.keyframe.frame.image, image, pixels[:, :2], pixels[:, 2:])
