# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A wrong pose is worse than none: what cannot be registered is refused, by name, with its evidence."""

import os
from collections import Counter
from dataclasses import replace
from functools import partial
from itertools import combinations, permutations

import numpy as np
import pytest

from vigg_ros.acceptance.agreement import Pair
from vigg_ros.bench.worlds import HALL_PERIOD_M, Scene, bare_room, blank_plane, render_depth
from vigg_ros.bench.worlds.patterns import poster
from vigg_ros.bench.worlds.poses import Pose, flat, look_at
from vigg_ros.bench.worlds.surfaces import box
from vigg_ros.registration import (
    Camera,
    Config,
    Evidence,
    Frame,
    Outcome,
    Reason,
    Registration,
    Rejection,
    extract,
    register,
)
from vigg_ros.registration.geometric import match_global
from vigg_ros.registration.matches import Matches
from vigg_ros.registration.vigg import align_by_all, align_by_images
from vigg_ros.registration.visual import match_visual
from vigg_ros_testing.registration_samples import (
    CAMERA,
    CLUTTER_VIEW,
    Studio,
    answer,
    assert_near,
    clutter,
    errors,
    looking,
    measured,
    noisy,
    truth,
)

CONFIG = Config()


def rejected(outcome: Outcome, *reasons: Reason) -> Rejection:
    """The outcome, which must be a rejection for one of these reasons; a wrong answer is shown whole."""
    assert isinstance(outcome, Rejection), outcome
    assert not hasattr(outcome, "T_target_source")
    assert outcome.message
    assert outcome.reason in reasons
    return outcome


def flat_frame(shape: tuple[int, int], grey: int | None, depth_m: float = 2.0) -> Frame:
    """An image of one grey level, or of noise, with the same depth everywhere."""
    height, width = shape
    camera = Camera(width, height, 0.9 * width, 0.9 * width, (width - 1) / 2, (height - 1) / 2)
    noise = np.random.default_rng(0).integers(0, 256, (height, width, 3))
    image = noise if grey is None else np.full((height, width, 3), grey)
    return Frame.from_depth(image.astype(np.uint8), np.full(shape, depth_m, np.float32), camera)


@pytest.mark.hostile("Image: constant, black, saturated, 1x1, 8x8: NO_TEXTURE")
@pytest.mark.parametrize("detector", ["sift", "orb"])
@pytest.mark.parametrize(
    ("shape", "grey"), [*(((120, 160), grey) for grey in (128, 0, 255)), ((1, 1), None), ((8, 8), None)], ids=str
)
def test_an_image_without_texture(shape: tuple[int, int], grey: int | None, detector: str, studio: Studio) -> None:
    frame = flat_frame(shape, grey)
    config = CONFIG.replace({"visual.detector": detector})
    blind, sound = extract(frame, config), extract(studio.frame(looking(), 1), config)
    for target, source, name in ((blind, sound, "target"), (sound, blind, "source"), (blind, blind, "target")):
        found = rejected(register(target, source, config), Reason.NO_TEXTURE)
        assert f"the {name}" in found.message
        assert found.evidence.keypoints == len(source.keypoints)


@pytest.mark.hostile("Image: depth of 0, NaN, Inf, negative, 65535: no point there; too few left: NO_DEPTH")
@pytest.mark.parametrize("depth_m", [0.0, np.nan, np.inf, -1.0, 65.535, 1e30])
def test_an_image_without_depth_in_range(depth_m: float, studio: Studio) -> None:
    image, exact_m = studio.view(looking())
    blind = extract(Frame.from_depth(image, np.full_like(exact_m, depth_m), CAMERA), CONFIG)
    sound = studio.features(looking(), 1)
    for target, source, name in ((blind, sound, "target"), (sound, blind, "source")):
        assert f"the {name}" in rejected(register(target, source, CONFIG), Reason.NO_DEPTH).message


@pytest.mark.parametrize("kept", ["a corner", "a row", "a column", "a dozen pixels"])
def test_a_little_depth_is_not_enough(kept: str, studio: Studio) -> None:
    """Depth on a line, a spot or scattered pixels makes no surface, or one that fixes nothing."""
    image, exact_m = studio.view(looking())
    is_kept = np.zeros(exact_m.shape, bool)
    if kept == "a dozen pixels":
        is_kept[tuple(np.random.default_rng(0).integers((0, 0), exact_m.shape, (12, 2)).T)] = True
    else:
        is_kept[{"a corner": np.s_[:8, :8], "a row": np.s_[60], "a column": np.s_[:, 80]}[kept]] = True
    depth_m = np.where(is_kept, exact_m, 0)
    blind = extract(Frame.from_depth(image, depth_m, CAMERA), CONFIG)
    for pair in ((blind, studio.features(looking(), 1)), (blind, blind)):
        rejected(register(*pair, CONFIG), Reason.NO_DEPTH, Reason.NO_TEXTURE)


def test_keypoints_where_there_is_no_depth_are_no_texture(studio: Studio) -> None:
    """The lower half has depth and is painted grey; all keypoints are in the upper half."""
    image, depth_m = studio.view(looking())
    image, depth_m = image.copy(), depth_m.copy()
    image[50:], depth_m[:60] = 128, 0
    blind = extract(Frame.from_depth(image, depth_m, CAMERA), CONFIG)
    assert blind.keypoints.detected > 20
    rejected(register(blind, blind, CONFIG), Reason.NO_TEXTURE)


@pytest.mark.parametrize("scene", [bare_room(seed=2), blank_plane(seed=2)], ids=["bare room", "blank wall"])
def test_rooms_without_paint_are_refused(scene: Scene) -> None:
    pair = Studio(scene).pair([looking(eye, (0.5, 0, 0.4)) for eye in ((0.8, 0, 0), (0.9, 0, 0))])
    rejected(register(*pair, CONFIG), Reason.NO_TEXTURE, Reason.DEGENERATE)


def test_more_by_chance_than_is_allowed(studio: Studio) -> None:
    pair = studio.pair((looking(), looking((0, 0.5, 0), (0, 1, 0))))
    config = CONFIG.replace({"acceptance.max_false_alarms": 1e-300})
    found = rejected(register(*pair, config), Reason.TOO_FEW_INLIERS)
    assert "expected at most 10^-300" in found.message
    assert -300 < found.evidence.log10_nfa < -3


def test_less_overlap_than_asked_for(studio: Studio) -> None:
    pair = studio.pair((looking(), looking((0, 0.5, 0), (0, 1, 0))))
    found = rejected(register(*pair, CONFIG.replace({"acceptance.min_overlap": 0.9})), Reason.LOW_OVERLAP)
    assert 0.1 < found.evidence.overlap < 0.9
    answer(register(*pair, CONFIG))


def test_a_surface_where_the_other_frame_saw_through_is_a_conflict(studio: Studio) -> None:
    """The images agree. The depth of one is cut off by a screen at 1 m in front of two thirds of the view."""
    target = studio.features(looking(), 1)
    image, depth_m = studio.view(looking((0.05, 0, 0)))
    screened_m = depth_m.copy()
    screened_m[:, 53:] = np.minimum(screened_m[:, 53:], 1.0)
    free, screened = (extract(noisy(image, metres, seed=2), CONFIG) for metres in (depth_m, screened_m))
    for pair in ((target, screened), (screened, target)):
        rejected(register(*pair, CONFIG), Reason.CONFLICT, Reason.TOO_FEW_INLIERS, Reason.LOW_OVERLAP)
    answer(register(target, free, CONFIG))


def assert_not_wrong(outcome: Outcome, T_true: Pose) -> None:
    """Refused, or within the 10 cm and 5 deg beyond which the method itself calls a motion undetermined."""
    if isinstance(outcome, Registration):
        threshold_m = CONFIG.cliques.inlier_threshold_m
        assert_near(outcome.T_target_source, T_true, rotation_deg=5, translation_m=threshold_m)


def in_the_hall(x: float) -> Pose:
    """A pose in the hall of columns, x along it."""
    return look_at((x, 0.3, 1.4), (x + 2, 0.1, 1.2))


@pytest.mark.parametrize("orders", [combinations, pytest.param(permutations, marks=pytest.mark.slow)])
def test_other_places_are_never_registered(orders, studio: Studio, wall: Studio, hall: Studio) -> None:
    """Of different kinds, and alike but for what stands in them: things between walls of their own.

    All orders of all are left to `make test-all`, to keep `make test` short.
    """
    seeds = (0, 1) if orders is combinations else (0, 2, 5, 7)
    heaps = [Studio(clutter(seed)).features(CLUTTER_VIEW, seed) for seed in seeds]
    kinds = [studio.features(looking(), 1), wall.features(looking((0.8, 0, 0)), 1), hall.features(in_the_hall(0), 1)]
    pairs = [*orders([*kinds, heaps[1]], 2), *orders(heaps, 2)]
    outcomes = [register(target, source, CONFIG) for target, source in pairs]
    assert len(outcomes) == (7 if orders is combinations else 24)
    assert not [outcome for outcome in outcomes if not isinstance(outcome, Rejection)]
    assert len({outcome.reason for outcome in outcomes}) > 1


REPEATED_ROW = pytest.mark.hostile("Scene: repeated texture and repeated structure: reject rather than choose wrongly")


def step_in_the_hall(hall: Studio, step_m: float) -> tuple[Outcome, Pose]:
    """The outcome of a step along the hall, and its exact motion."""
    poses = in_the_hall(0), in_the_hall(step_m)
    return register(*hall.pair(poses), CONFIG), truth(*poses)


@REPEATED_ROW
@pytest.mark.parametrize("step_m", [0.05, 0.15, 0.3])
def test_small_steps_between_equal_columns_are_found(step_m: float, hall: Studio) -> None:
    """Far less than half a period: the nearest answer is the right one, and it is asked for at sensor rate."""
    outcome, T_true = step_in_the_hall(hall, step_m)
    # Floor, ceiling and walls leave the position along the hall to round columns and to paint.
    assert_near(answer(outcome).T_target_source, T_true, rotation_deg=0.5, translation_m=0.03)


@REPEATED_ROW
@pytest.mark.parametrize(
    "periods",
    [
        0.5,  # the columns of one view stand between those of the other; walls and floor fit all the same
        *(
            pytest.param(
                periods,
                marks=pytest.mark.xfail(
                    reason="A step of a whole period gives equal images, and the answer is no motion, to a millimetre. "
                    "No match points elsewhere, so no other hypothesis is ever followed; only the frame's similarity "
                    "to itself could tell."
                ),
            )
            for periods in (1, 2)
        ),
    ],
)
def test_steps_among_equal_columns_are_not_answered_wrongly(periods: float, hall: Studio) -> None:
    assert_not_wrong(*step_in_the_hall(hall, periods * HALL_PERIOD_M))


MOVING_ROW = pytest.mark.hostile("Scene: a moving object over half the view")
MOVER_HIDES = 0.4
"""Share of the view that the moving box covers; with its edges, where noise leaves no depth, nearly half."""


def with_mover(studio: Studio, x: float, y: float, yaw_deg: float) -> Scene:
    """The room with a painted box of the height of a wardrobe in front of the camera."""
    paint = partial(poster, np.random.default_rng(5), shapes=60)
    return Scene(studio.scene.surfaces + box(flat((x, y, 0.05), yaw_deg), (0.5, 1.1, 2.2), paint), studio.scene.light)


def look_past_mover(
    studio: Studio, moved: tuple[float, float, float], step: tuple[float, float, float]
) -> tuple[Outcome, Pose]:
    """The camera makes a step while the box moves by x, y and a turn; and the camera's true motion."""
    poses = looking(), looking(step, step)
    boxes = (0.5, 0.7, 10.0), tuple(np.add((0.5, 0.7, 10.0), moved))
    places = [Studio(with_mover(studio, *place)) for place in boxes]
    hidden = np.abs(places[0].view(poses[0])[1] - render_depth(studio.scene, CAMERA, poses[0])) > 0.01
    assert hidden.mean() > MOVER_HIDES
    target, source = (place.features(pose, seed) for seed, (place, pose) in enumerate(zip(places, poses, strict=True)))
    return register(target, source, CONFIG), truth(*poses)


STEP = (0.1, 0.1, 0.0)


TWO_MOTIONS = pytest.mark.xfail(
    reason="The box's motion is a second answer, within three thresholds and 15 deg of the right one: matches of both "
    "are pooled, no other hypothesis is seen, and the answer lies between them, off by far more than its covariance."
)


@MOVING_ROW
@pytest.mark.parametrize(
    ("moved", "step"),
    [
        ((0.05, -0.1, 0), STEP),
        ((0.1, -0.2, 8), STEP),
        ((-0.3, 0, -20), STEP),
        pytest.param((0.1, 0.1, 0), STEP, marks=TWO_MOTIONS, id="with the camera"),
        pytest.param((0, -0.25, 0), (0.3, 0.1, 0), id="across a step"),
    ],
)
def test_a_moving_box_does_not_take_the_camera_with_it(moved, step, studio) -> None:
    assert_not_wrong(*look_past_mover(studio, moved, step))


def shuffled(matches: Matches, rng: np.random.Generator) -> Matches:
    """Every source point with the target point of another match."""
    rows = rng.permutation(len(matches))
    rows[rows == np.arange(len(rows))] -= 1
    other = matches.select(rows)
    return replace(matches, target=other.target, target_row=other.target_row)


def pair_at_half_size(studio: Studio) -> tuple[Pair, Pose]:
    """Two frames of the room at 80x60, as measured, and their matches: quick enough for many trials."""
    config = CONFIG.replace({"geometric.voxel_size_m": 0.05, "geometric.sample_k": 500, "visual.top_k": 60})
    poses = looking(), looking((0.1, 0.1, 0))
    features = []
    for seed, pose in enumerate(poses):
        image, depth_m = measured(*studio.view(pose), seed=seed)
        camera = Camera(80, 60, CAMERA.fx_px / 2, CAMERA.fy_px / 2, CAMERA.cx_px / 2, CAMERA.cy_px / 2)
        features.append(extract(Frame.from_depth(image[::2, ::2], depth_m[::2, ::2], camera), config))
    target, source = features
    visual = match_visual(target.keypoints, source.keypoints, config.visual)
    geometric = match_global(target.landmarks, source.landmarks, config.geometric)
    return Pair(target, source, visual, geometric, config), truth(*poses)


FIRST, END = (int(number) for number in os.environ.get("VIGG_TRIALS", "0:12").split(":"))
"""Trials by their seeds: what some seconds allow; `make trials` runs 0:10000."""


@pytest.mark.hostile("Scene: all matches outliers: under 0.1 % false accepts in 10,000 trials")
def test_matches_that_are_all_wrong_are_no_answer(studio: Studio) -> None:
    """Both frames show the same room, so surfaces do coincide here and there; only the matches are wrong."""
    pair, T_true = pair_at_half_size(studio)
    assert isinstance(align_by_all(pair, Evidence()), Registration), "with its own matches the pair is registered"
    outcomes: Counter[str] = Counter()
    for trial in range(FIRST, END):
        rng = np.random.default_rng(trial)
        shuffled_pair = replace(pair, visual=shuffled(pair.visual, rng), geometric=shuffled(pair.geometric, rng))
        outcome = align_by_images(shuffled_pair, Evidence()) or align_by_all(shuffled_pair, Evidence())
        if isinstance(outcome, Rejection):
            outcomes[outcome.reason.name] += 1
        else:
            # Chance may hit the truth: that is an answer, and a right one.
            is_right = np.less(errors(outcome.T_target_source, T_true), (5, CONFIG.cliques.inlier_threshold_m)).all()
            outcomes["right" if is_right else "wrong"] += 1
    print(f"trials {FIRST} to {END - 1}: {dict(outcomes)}")
    assert outcomes["wrong"] < max(1, 0.001 * (END - FIRST)), outcomes
    assert outcomes.total() - outcomes["right"] > 0.9 * (END - FIRST)
