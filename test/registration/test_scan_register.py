# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scans of a rendered street, and of a real road, registered against what is known of their motion."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from vigg_ros.acceptance import agreement
from vigg_ros.acceptance.limits import MAX_CONFLICT
from vigg_ros.bench.worlds import STREET_DRIVE, Scene
from vigg_ros.bench.worlds.patterns import asphalt
from vigg_ros.bench.worlds.poses import Pose, flat
from vigg_ros.bench.worlds.surfaces import Rectangle
from vigg_ros.bench.worlds.texture import Texture
from vigg_ros.registration import Frame, Registration, Rejection, extract, register
from vigg_ros.registration.features import Features
from vigg_ros.registration.matches import no_matches
from vigg_ros.registration.rigid import inverse
from vigg_ros_testing.registration_samples import answer, assert_near, normalised_error
from vigg_ros_testing.street_samples import (
    CAMERA,
    CONFIG,
    T_CAMERA_LIDAR,
    a_street,
    along,
    features_along,
    frame_along,
    is_wrong,
    lidar_motion,
    rigid_frame,
)

Pair = tuple[Features, Features, Pose]
"""Of a target and a source, with the exact T_target_source."""

MAX_TRANSLATION_M, MAX_ROTATION_DEG = 0.02, 0.1
"""One range is good for 2 cm, and thousands of them decide; beams are 1.3 deg apart, and 0.1 deg is 2 cm at 11 m."""


@cache
def features_in_turn(time_s: float) -> Features:
    T_world_base = STREET_DRIVE.T_world_vehicle(time_s)
    return extract(rigid_frame(T_world_base, seed=round(10 * time_s)), CONFIG)


def assert_registered(target: Features, source: Features, T_true: Pose, *, factor: float = 1) -> Registration:
    """An answer, wrong by less than ``factor`` times what a scan is good for."""
    outcome = answer(register(target, source, CONFIG))
    bounds = {"rotation_deg": factor * MAX_ROTATION_DEG, "translation_m": factor * MAX_TRANSLATION_M}
    assert_near(outcome.T_target_source, T_true, **bounds)
    return outcome


def straight(target_m: float, source_m: float) -> Pair:
    """Two places on the main street."""
    T_true = lidar_motion(along(target_m), along(source_m))
    return features_along(target_m), features_along(source_m), T_true


def turning(target_s: float, source_s: float) -> Pair:
    """By 10 to 49 deg within 2.4 to 7 m to the left; the widest pair shares next to nothing of its images."""
    T_true = lidar_motion(STREET_DRIVE.T_world_vehicle(target_s), STREET_DRIVE.T_world_vehicle(source_s))
    return features_in_turn(target_s), features_in_turn(source_s), T_true


DRIVES: list[tuple[Callable[[float, float], Pair], float, float]] = [
    *((straight, *places) for places in [(-10.0, -8.0), (0.0, 4.0), (4.0, 10.0), (0.0, 10.0), (-10.0, 0.0)]),
    *((turning, *times) for times in [(1.8, 2.2), (2.2, 2.6), (2.2, 3.0), (1.8, 3.0)]),
]


@cache
def drive(pair_of: Callable[[float, float], Pair], target: float, source: float) -> tuple[Registration, Pose]:
    """The answer for a drive, and its exact motion."""
    pair = pair_of(target, source)
    return assert_registered(*pair), pair[2]


@pytest.mark.parametrize("places", DRIVES)
def test_a_drive(places: tuple[Callable[[float, float], Pair], float, float]) -> None:
    drive(*places)


def test_errors_are_those_that_the_covariance_expects() -> None:
    squared = [normalised_error(*drive(*places)) for places in DRIVES]
    # Of chi-square with 9 x 6 degrees of freedom 99.9 % lie below 91. It may be too cautious, by a factor of
    # three in the deviations at most: then the sum is 54 / 9.
    assert 54 / 9 < sum(squared) < 91


def test_swapping_target_and_source_inverts_the_motion() -> None:
    target, source, T_true = turning(1.8, 2.2)
    forward = assert_registered(target, source, T_true)
    # The scans sample each other's surfaces differently: a quarter of what either may be off.
    assert_registered(source, target, inverse(forward.T_target_source), factor=0.25)


def test_the_same_scans_give_the_same_bytes() -> None:
    first, again = (answer(register(features_along(-10.0), features_along(0.0), CONFIG)) for _ in range(2))
    assert first.T_target_source.tobytes() == again.T_target_source.tobytes()
    assert first.covariance.tobytes() == again.covariance.tobytes()


@pytest.mark.parametrize(
    ("target_m", "source_m"),
    [(-30.0, -10.0), (-20.0, 0.0), (-10.0, 10.0), (-30.0, -8.0), (-20.0, 4.0), (10.0, -10.0)],
)
@pytest.mark.hostile("Scene: LiDAR rings on flat ground that look like no motion at all")
def test_twenty_metres_along_a_flat_street_are_never_taken_for_none(target_m: float, source_m: float) -> None:
    """Rings on the ground look alike from everywhere; at this distance most of the rest hides or changes."""
    target, source, T_true = straight(target_m, source_m)
    assert not is_wrong(register(target, source, CONFIG), T_true)


@pytest.mark.parametrize(("target_m", "source_m"), [(-30.0, -10.0), (-20.0, 0.0), (-10.0, 10.0)])
def test_free_space_tells_no_motion_from_twenty_metres(target_m: float, source_m: float) -> None:
    """The reason behind the test above: overlap and what is hidden are about the same for both."""
    target, source, T_true = straight(target_m, source_m)
    pair = agreement.Pair(target, source, no_matches(), no_matches(), CONFIG)
    right = agreement.assess(pair, T_true).agreement
    wrong = agreement.assess(pair, np.eye(4)).agreement
    assert right.overlap < 1.5 * wrong.overlap
    # Well to either side of the bound, so that noise does not decide.
    assert right.conflict < MAX_CONFLICT.value / 1.5
    assert wrong.conflict > MAX_CONFLICT.value * 1.5


@cache
def on_plain(x_m: float, *, seed: int, painted: bool = True) -> Features:
    """Features of a place with nothing but ground, of asphalt or grey."""
    grey = np.full((16, 16, 3), 128, np.uint8)
    paint = asphalt(np.random.default_rng(3), (120, 110)) if painted else Texture.of(grey, texel_m=10.0)
    scene = Scene((Rectangle(flat((10, 15, 0)), (120, 110), paint),), a_street().light, (235, 215, 190))
    return extract(rigid_frame(along(x_m), seed=seed, scene=scene), CONFIG)


def test_an_empty_plain_without_texture_is_refused() -> None:
    target, source = (on_plain(x, seed=int(x), painted=False) for x in (0.0, 5.0))
    assert isinstance(register(target, source, CONFIG), Rejection)


@pytest.mark.hostile("Scene: LiDAR rings on flat ground that look like no motion at all")
@pytest.mark.parametrize(
    ("apart_m", "noise"), [(0.6, 10), (1.0, 10), (2.0, 10), (4.0, 10), (2.0, 9), (4.0, 9), (8.0, 9), (20.0, 9)]
)
def test_an_empty_plain_is_answered_by_its_texture_or_not_at_all(apart_m: float, noise: int) -> None:
    """Rings on a plain are where they were, whatever the motion; with the same noise (9) to the last bit."""
    outcome = register(on_plain(0.0, seed=9), on_plain(apart_m, seed=noise), CONFIG)
    assert not is_wrong(outcome, lidar_motion(along(0.0), along(apart_m)))


def test_a_view_clipped_to_the_camera_still_answers() -> None:
    """The paper's unified field of view: less surface, so three times the error is allowed."""
    clipped = []
    for frame in (frame_along(0.0), frame_along(4.0)):
        seen = Frame.from_points(frame.image, frame.points(), CAMERA, T_CAMERA_LIDAR, within_view=True)
        assert len(seen.points()) < 0.4 * len(frame.points())
        clipped.append(extract(seen, CONFIG))
    assert_registered(*clipped, lidar_motion(along(0.0), along(4.0)), factor=3)
