# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What one message says, as arrays: the type between decode and pairing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Union

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.camera import Camera


@dataclass(frozen=True, slots=True)
class ColourImage:
    """A colour or grey image: (H, W, 3) BGR or (H, W), uint8."""

    stamp_ns: int
    frame_id: str
    image: NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class DepthImage:
    """A depth image: (H, W) float32, metres along z, 0 where there is none."""

    stamp_ns: int
    frame_id: str
    depth_m: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Calibration:
    """A camera: the intrinsics of its rectified image."""

    stamp_ns: int
    frame_id: str
    camera: Camera


@dataclass(frozen=True, slots=True)
class PointCloud:
    """A scan: points (N, 3) float32, metres, all finite; times_s (N,) float64 relative to the stamp, if known."""

    stamp_ns: int
    frame_id: str
    points: NDArray[np.float32]
    times_s: NDArray[np.float64] | None = None


Observation = Union[ColourImage, DepthImage, Calibration, PointCloud]
