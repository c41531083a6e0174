# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""sensor_msgs/Image with depths to metres (REP-118)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.colour_image import COLOUR_ENCODINGS, DEPTH_ENCODINGS
from vigg_ros.sensors.header import Header, read_header
from vigg_ros.sensors.message_limits import MAX_RANGE_M, shortened
from vigg_ros.sensors.observation import DepthImage, Note
from vigg_ros.sensors.pixels import pixel_rows

UNIT_16_BIT_M = 0.001
UNIT_FLOAT_M = 1.0
NO_RETURN_16_BIT = 65_535
"""Besides 0, what 16-bit depth images hold where there is no depth."""
MIN_DEPTH_PIXELS = 3
"""A rigid motion needs three points."""

PLAUSIBLE_MEDIAN_M = (0.05, 100.0)


def decode_depth(msg: Any, *, depth_scale_m: float | None = None) -> DepthImage:
    """The depth image as (H, W) float32 metres, 0 where there is no depth.

    depth_scale_m: metres per unit; if not given, 0.001 for 16 bits and 1 for floats. No depth is what
    is 0, 65535 (16 bits), NaN, infinite, negative or beyond MAX_RANGE_M. Raises DataError.
    """
    header = read_header(msg.header)
    sample = depth_sample(msg.encoding)
    view, notes = pixel_rows(msg, (">" if msg.is_bigendian else "<") + sample)
    return depth_image(header, view[:, :, 0], depth_scale_m, notes)


def depth_image(
    header: Header, samples: NDArray[Any], depth_scale_m: float | None, notes: tuple[Note, ...] = ()
) -> DepthImage:
    """The observation of samples (H, W), of 16 bits or floats. Raises DataError if they hold no depth."""
    depth_m = metres(samples, depth_scale_m)
    valid = np.count_nonzero(depth_m)
    if valid < MIN_DEPTH_PIXELS:
        raise DataError(
            "NO_DEPTH", found=f"{valid} pixels with depth in an image of {depth_m.shape[1]}x{depth_m.shape[0]}",
            expected=f"at least {MIN_DEPTH_PIXELS}", remedy="check the depth camera, its range and depth_scale",
        )
    notes = header.notes + notes + _unit_notes(depth_m)
    return DepthImage(header.stamp_ns, header.frame_id, depth_m, notes)


def metres(samples: NDArray[Any], depth_scale_m: float | None) -> NDArray[np.float32]:
    """Samples (H, W) as float32 metres, 0 where they mean nothing."""
    is_integer = samples.dtype.kind == "u"
    if depth_scale_m is None:
        depth_scale_m = UNIT_16_BIT_M if is_integer else UNIT_FLOAT_M
    with np.errstate(over="ignore", invalid="ignore"):
        native = samples.astype(np.float32)
        depth_m = np.multiply(native, np.float32(depth_scale_m), out=native)
        # NaN compares false, so this one test leaves out everything that is not a distance.
        nothing = ~((depth_m > 0) & (depth_m <= MAX_RANGE_M))
    if is_integer:
        nothing |= samples == NO_RETURN_16_BIT
    depth_m[nothing] = 0
    return depth_m


def depth_sample(encoding: str) -> str:
    """The NumPy type of one sample, without byte order. Raises DataError for anything but depth."""
    if encoding in DEPTH_ENCODINGS:
        return DEPTH_ENCODINGS[encoding]
    raise DataError(
        "DEPTH_IS_COLOUR" if encoding in COLOUR_ENCODINGS else "DEPTH_ENCODING",
        found=f"encoding {shortened(encoding)} on the depth topic",
        expected=f"one of {', '.join(DEPTH_ENCODINGS)}",
        remedy="remap depth/image to the depth registered to the colour image",
    )


def _unit_notes(depth_m: NDArray[np.float32]) -> tuple[Note, ...]:
    # A few thousand pixels tell millimetres from metres as well as all of them.
    stride = max(1, int(np.sqrt(depth_m.size / 4_000)))
    sampled = depth_m[::stride, ::stride]
    sampled = sampled[sampled > 0]
    if not sampled.size:
        return ()
    median_m = float(np.median(sampled))
    if PLAUSIBLE_MEDIAN_M[0] <= median_m <= PLAUSIBLE_MEDIAN_M[1]:
        return ()
    return (
        Note(
            "DEPTH_UNIT", f"a median depth of {median_m:.4g} m",
            "taken as it is", "set depth_scale to the metres per unit of this camera",
        ),
    )
