# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A rendered pair, results made by hand, and frames that need no files."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from vigg_ros.bench.pair_results import PairResult
from vigg_ros.bench.pairs import FramePair, PosedFrame
from vigg_ros.bench.worlds import HandheldLoop, ImageNoise, KinectNoise, render_rgbd, room
from vigg_ros.registration import BagError, Camera, Config, Frame
from vigg_ros.registration.rigid import inverse
from vigg_ros_testing.trajectory_samples import pose

CAMERA = Camera(width_px=160, height_px=120, fx_px=131.0, fy_px=131.0, cx_px=79.5, cy_px=59.5)
CONFIG = Config()


@dataclass(frozen=True)
class RoomView:
    """A noisy view of a rendered room at a time of a handheld loop."""

    time_s: float

    @property
    def name(self) -> str:
        return f"{self.time_s:g}"

    def load(self) -> Frame:
        return _room_frame(self.time_s)


@cache
def _room_frame(time_s: float) -> Frame:
    rng = np.random.default_rng(round(1000 * time_s))
    image, depth_m = render_rgbd(room(seed=2), CAMERA, HandheldLoop().T_world_camera(time_s))
    return Frame.from_depth(ImageNoise().apply(image, rng), KinectNoise().apply(depth_m, CAMERA, rng), CAMERA)


@dataclass(frozen=True)
class UnreadableFrame:
    """A frame whose file cannot be read, or that nobody is to load."""

    name: str

    def load(self) -> Frame:
        raise BagError("cut")


def room_pair(target_s: float = 0.0, source_s: float = 0.4) -> FramePair:
    """A pair of the loop with its exact motion."""
    T_world_target, T_world_source = (HandheldLoop().T_world_camera(time_s) for time_s in (target_s, source_s))
    T_target_source = inverse(T_world_target) @ T_world_source
    return FramePair("room", RoomView(target_s), RoomView(source_s), T_target_source, 0.8)


def result(rotation_deg=math.inf, translation_m=math.inf, *, method="m", group="g", reason=None, **more) -> PairResult:
    """A result; without errors there is no answer."""
    if reason is None:
        reason = "" if math.isfinite(rotation_deg) else "LOST"
    values = {"target": "1", "source": "0", "overlap": 0.5, "nees": 6.0, "timings_ms": {"all": 10.0}, **more}
    errors = {"rotation_error_deg": rotation_deg, "translation_error_m": translation_m}
    return PairResult(method=method, group=group, reason=reason, **errors, **values)


def along_x(*places_m: float | None) -> list[PosedFrame]:
    """Frames at these places along x; None has no pose."""
    return [PosedFrame(i, UnreadableFrame(str(i)), None if x is None else pose(x)) for i, x in enumerate(places_m)]
