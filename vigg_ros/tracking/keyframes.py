# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Keyframes: references whose features are computed once, and the bounded memory of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.features import Features
from vigg_ros.registration.frame import Frame
from vigg_ros.registration.options import KeyframeConfig
from vigg_ros.registration.result import Registration
from vigg_ros.registration.rigid import angle_rad
from vigg_ros.tracking.chain import UncertainPose


@dataclass(frozen=True, slots=True)
class Keyframe:
    """A frame that others are registered against."""

    id: int
    frame: Frame
    features: Features
    pose: UncertainPose
    """In the odometry frame."""
    displacement: NDArray[np.float64]
    """(6,) by which its stamp leaves it uncertain; see ``stamp_error``."""


class KeyframeBuffer:
    """The last keyframes, the reference among them; the oldest other one makes room."""

    def __init__(self, config: KeyframeConfig) -> None:
        self._size = config.buffer_size
        self._keyframes: list[Keyframe] = []
        self._reference: Keyframe | None = None
        self._next_id = 0

    def __len__(self) -> int:
        return len(self._keyframes)

    @property
    def reference(self) -> Keyframe | None:
        """The keyframe that new frames are registered against first."""
        return self._reference

    def add(
        self, frame: Frame, features: Features, pose: UncertainPose, displacement: NDArray[np.float64]
    ) -> Keyframe:
        """A new keyframe, which becomes the reference."""
        keyframe = Keyframe(self._next_id, frame, features, pose, displacement)
        self._next_id += 1
        self._keyframes.append(keyframe)
        self._reference = keyframe
        if len(self._keyframes) > self._size:
            del self._keyframes[0]
        return keyframe

    def replace(self, old: Keyframe, new: Keyframe) -> None:
        """The same keyframe with better features, in the same place."""
        self._keyframes[self._keyframes.index(old)] = new
        if self._reference is old:
            self._reference = new

    def make_reference(self, keyframe: Keyframe) -> None:
        """Return to a keyframe of the buffer, which counts as its newest from now on."""
        self._keyframes.remove(keyframe)
        self._keyframes.append(keyframe)
        self._reference = keyframe

    def others(self, position: NDArray[np.float64], count: int, turn: int) -> list[Keyframe]:
        """Some keyframes besides the reference, nearest to a position (3,) first.

        ``turn`` counts the searches so far: each turn tries the next ones, so that all are tried in time.
        """
        rest = [keyframe for keyframe in self._keyframes if keyframe is not self._reference]
        rest.sort(key=lambda keyframe: float(np.linalg.norm(keyframe.pose.T_parent_child[:3, 3] - position)))
        count = min(count, len(rest))
        return [rest[(turn * count + i) % len(rest)] for i in range(count)]


def is_far(registration: Registration, config: KeyframeConfig) -> bool:
    """Whether the frame sees so little of its reference that a new one should be taken."""
    T_keyframe_frame, evidence = registration.T_target_source, registration.evidence
    return (
        evidence.overlap < config.min_overlap
        or evidence.visual_inliers < config.min_inliers
        or float(np.linalg.norm(T_keyframe_frame[:3, 3])) > config.max_translation_m
        or np.rad2deg(angle_rad(T_keyframe_frame[:3, :3])) > config.max_rotation_deg
    )
