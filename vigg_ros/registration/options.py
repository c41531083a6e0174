# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every option: its default, unit, bounds, and when to touch it.

Files, command-line help and the tables of the docs are generated from these dataclasses, so a default is
written here and nowhere else.
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import Field, dataclass, field
from typing import Any

from vigg_ros.registration.errors import ConfigError

MAX_CELLS_PER_AXIS = 2**20
"""Bounds ranges against radii: three axes of this many cells fit one int64 key of the kernels, with a margin of one
cell on each side."""


def option(
    default: Any,
    doc: str,
    *,
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] = (),
) -> Any:
    """A dataclass field that knows its unit, bounds, and when to touch it."""
    meta = {"doc": doc, "unit": unit, "low": low, "high": high, "choices": choices}
    return field(default=default, metadata=meta)


def coerced(spec: Field[Any], value: Any) -> Any:
    """An integer is accepted for a real number, and the off of YAML, which is its word for false, for a choice of that
    name; nothing else is converted."""
    if value is False and "off" in spec.metadata["choices"]:
        return "off"
    if type(spec.default) is float and type(value) is int and spec.metadata["low"] <= value <= spec.metadata["high"]:
        return float(value)
    return value


def check_option(name: str, spec: Field[Any], value: Any) -> None:
    """Type, choices and bounds. Raises ConfigError."""
    meta, wanted = spec.metadata, type(spec.default)
    if type(value) is not wanted and not (wanted is float and type(value) is int):
        raise ConfigError(f"{name} is {value!r}, expected {wanted.__name__}")
    if meta["choices"] and value not in meta["choices"]:
        raise ConfigError(f"{name} is {value!r}, expected one of {', '.join(meta['choices'])}")
    if wanted in (bool, str):
        return
    if not meta["low"] <= value <= meta["high"]:  # nor does NaN pass
        raise ConfigError(f"{name} is {value}, expected {meta['low']} to {meta['high']} {meta['unit']}".rstrip())


def mask_boxes(text: str) -> tuple[tuple[int, int, int, int], ...]:
    """The boxes of ``input.mask_boxes``: x0, y0, x1, y1 in pixels, ends excluded. Raises ConfigError."""
    boxes = []
    for part in filter(str.strip, text.split(";")):
        numbers = [int(word) if word.isascii() and word.isdigit() else -1 for word in part.split()]
        if len(numbers) != 4 or min(numbers) < 0 or numbers[0] >= numbers[2] or numbers[1] >= numbers[3]:
            raise ConfigError(
                f"input.mask_boxes holds {part.strip()!r}, expected x0 y0 x1 y1 in whole pixels from 0 on, x0 below x1 "
                "and y0 below y1; boxes are parted by ;"
            )
        boxes.append((numbers[0], numbers[1], numbers[2], numbers[3]))
    return tuple(boxes)


def unknown_name(name: str, known: Sequence[str], *, what: str, otherwise: str) -> ConfigError:
    """The error for a name that is none of the known ones, with the nearest of them, or else what to do."""
    ends = {one.rpartition(".")[2]: one for one in known}  # top_k for visual.top_k
    close = difflib.get_close_matches(name, [*known, *ends], n=1, cutoff=0.5)
    hint = f"did you mean {ends.get(close[0], close[0])}?" if close else otherwise
    return ConfigError(f"unknown {what} {name!r}; {hint}")


@dataclass(frozen=True, slots=True)
class VisualConfig:
    """Visual matches (C_vis)."""

    detector: str = option(
        "sift", "orb where SIFT is too slow for the computer: it finds fewer matches", choices=("sift", "orb")
    )
    max_pixels: int = option(
        100_000, "the image is reduced to this at first, and searched in full only where that leaves doubt; "
        "higher for fine texture far away, lower for speed",
        unit="pixels", low=10_000, high=100_000_000,
    )
    max_keypoints: int = option(1500, "lower for speed, higher for large, textured images", low=50, high=20000)
    ratio: float = option(
        0.8, "squared-distance ratio of best to second-best match; lower where textures repeat", low=0.1, high=1.0
    )
    top_k: int = option(150, "matches kept, best first; more helps where many are wrong", low=3, high=2000)


@dataclass(frozen=True, slots=True)
class GeometricConfig:
    """The voxel cloud, its features, and global geometric matches (C_geo)."""

    voxel_size_m: float = option(
        0.025, "about the sensor's point spacing at working range", unit="m", low=0.001, high=10.0
    )
    min_range_m: float = option(0.0, "raise to drop returns from the robot itself", unit="m", low=0.0, high=100.0)
    max_range_m: float = option(8.0, "lower to drop returns too far to be precise", unit="m", low=0.1, high=1000.0)
    sample_k: int = option(5000, "source points matched and refined; lower for speed", low=100, high=100000)
    feature_grid_voxels: float = option(
        2.0, "spacing of points with features, in voxels; 1 is the paper's", unit="voxels", low=1.0, high=10.0
    )
    normal_radius_voxels: float = option(
        6.0, "surface patch behind a feature's normal; larger for noisier sensors", unit="voxels", low=1.5, high=50.0
    )
    feature_radius_voxels: float = option(
        14.0, "surface patch a feature describes; larger tells more apart, and fits less at borders",
        unit="voxels", low=2.0, high=100.0,
    )
    always: bool = option(
        False, "on to match globally even where the visual matches leave no doubt, as the paper does; slower"
    )
    mutual: bool = option(True, "off for the paper's one-directional global matches, which are mostly wrong")


@dataclass(frozen=True, slots=True)
class NoiseConfig:
    """How far a measured point may be off along its line of sight."""

    model: str = option(
        "auto", "the kind of depth sensor; auto measures a depth image's noise on its flat parts, and takes a scan for "
        "a lidar's; none for the paper's method, to which all points are equal",
        choices=("auto", "none", "structured_light", "stereo", "time_of_flight", "lidar"),
    )
    sigma_m: float = option(0.0, "a constant part of your own; 0 for the model's", unit="m", low=0.0, high=10.0)
    sigma_per_m: float = option(
        0.0, "a part that grows with the distance; 0 for the model's", unit="m/m", low=0.0, high=1.0
    )
    sigma_per_m2: float = option(
        0.0, "a part that grows with its square, for stereo the error of the disparity (px) over focal length (px) "
        "times baseline (m); 0 for the model's",
        unit="m/m^2", low=0.0, high=1.0,
    )


@dataclass(frozen=True, slots=True)
class CliqueConfig:
    """Hypotheses from cliques of compatible matches, and their choice (GVCA, paper 3.2)."""

    inlier_threshold_m: float = option(
        0.10, "t: how far two matched points may lie apart; two to four voxels", unit="m", low=0.001, high=20.0
    )
    score_threshold: float = option(
        0.9, "compatibility below which two matches are not connected", low=0.0, high=0.9999
    )
    geometric_guidance: bool = option(True, "off for the paper's ablation: choose by the visual matches alone")
    geometric_hypotheses: bool = option(
        True, "off for the paper's method, which has no answer where the images share no view"
    )


@dataclass(frozen=True, slots=True)
class LocalMatchConfig:
    """Point-wise matching inside the search zone (VGM, paper 3.3)."""

    gamma_squared: float = option(10.0, "search zone in squared standard deviations (eq. 10)", low=0.1, high=100.0)
    iterations: int = option(3, "rounds of match and fit; 0 for the paper's ablation", low=0, high=20)
    fixed_zone_m: float = option(
        0.0, "a search zone of this radius in every round, for the paper's ablation; 0 follows the matches' errors",
        unit="m", low=0.0, high=20.0,
    )
    geometric_prior: bool = option(True, "off for the paper's zone, from visual matches alone; it needs a shared view")


@dataclass(frozen=True, slots=True)
class RefinementConfig:
    """The last step towards the sensor's own limit."""

    iterations: int = option(10, "rounds of surface alignment at most; 0 to stop where the paper does", low=0, high=50)


@dataclass(frozen=True, slots=True)
class AcceptanceConfig:
    """What an answer must show before it is given."""

    enabled: bool = option(True, "off for the paper's method, which answers whenever a motion is determined")
    candidates: int = option(20, "different hypotheses tried until one is supported; lower for speed", low=1, high=50)
    min_overlap: float = option(
        0.10, "share of the surface that must coincide; raise to demand closer views", low=0.0, high=1.0
    )
    min_consistency: float = option(
        0.6, "coinciding share of the surface that both sensors should see; lower where things move", low=0.0, high=1.0
    )
    max_false_alarms: float = option(
        1e-5,
        "false alarms per registration: how often chance may show as much as speaks for an answer; 1e-5 is one an hour "
        "at 30 Hz; lower to be surer, higher for more answers",
        low=1e-300, high=1.0,
    )


@dataclass(frozen=True, slots=True)
class KeyframeConfig:
    """When the reference changes, and what is remembered."""

    min_overlap: float = option(0.5, "overlap with the reference below which a new one is taken", low=0.05, high=1.0)
    min_inliers: int = option(30, "visual inliers below which a new reference is taken", low=3, high=1000)
    max_translation_m: float = option(
        0.4, "distance from the reference at which a new one is taken", unit="m", low=0.01, high=100.0
    )
    max_rotation_deg: float = option(
        20.0, "angle from the reference at which a new one is taken", unit="deg", low=1.0, high=180.0
    )
    buffer_size: int = option(20, "keyframes remembered for relocalisation; bounds memory", low=1, high=1000)
    retries: int = option(3, "other keyframes tried before a frame counts as lost", low=0, high=100)
    lost_timeout_s: float = option(
        3.0, "time without a pose after which the first good frame begins a new session; 0 for never: then only a "
        "place seen before, or a reset, ends it",
        unit="s", low=0.0, high=86400.0,
    )


@dataclass(frozen=True, slots=True)
class PairingConfig:
    """Which colour and depth belong together."""

    sync_slop_s: float = option(
        0.02, "largest difference of stamps in a pair, inclusive; at most half a frame", unit="s", low=0.0, high=1.0
    )
    queue_size: int = option(30, "unpaired messages kept for each topic", low=2, high=10000)
    reuse_depth: bool = option(
        False,
        "on where depth comes at a lower rate than images: an image that has no depth image of its own (a scan that "
        "has no image) takes the nearest within sync_slop_s although another has it too",
    )


@dataclass(frozen=True, slots=True)
class InputConfig:
    """How messages are read."""

    rectify: str = option(
        "auto",
        "assume_rectified where images are rectified although their topic does not say rect; undistort where they are "
        "raw although it does",
        choices=("auto", "assume_rectified", "undistort"),
    )
    own_body: str = option(
        "auto", "off where nothing of the robot is ever in view; auto masks what stays where it is in depth images "
        "while the camera moves",
        choices=("auto", "off"),
    )
    mask_image: str = option(
        "", "an 8-bit image of the camera's size that is not 0 where the robot's own body is; of the rectified image"
    )
    mask_boxes: str = option(
        "", "the same as boxes x0 y0 x1 y1 in pixels, ends excluded, such as 0 400 640 480; 0 0 100 100"
    )
    deskew: bool = option(True, "off where scans with times for each point are corrected for motion already")
    depth_scale_m: float = option(
        0.0, "metres per depth unit; 0 means 0.001 for 16-bit and 1 for float images", unit="m", low=0.0, high=10.0
    )
