# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot's own body in view: found where it is, and nowhere else. Worlds are rendered, so all of it is known."""

from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from vigg_ros.bench.worlds import HandheldLoop, render_rgbd
from vigg_ros.bench.worlds.poses import Pose, look_at
from vigg_ros.registration import Camera, Config, Frame
from vigg_ros.tracking import FrameResult, Registrar, State
from vigg_ros.tracking.own_body import MAX_VIEWS, NEEDED_VIEWS, OwnBody
from vigg_ros_testing.registration_samples import CAMERA, Studio, measured, noisy
from vigg_ros_testing.simple_scenes import scene_of, wall

PATH = [HandheldLoop().T_world_camera(0.1 * k) for k in range(50)]
"""A hand that goes around a loop of 5 s, seen at 10 Hz."""

BOARD = np.s_[54:, 36:124]
"""30 % of the view."""


def with_board(studio: Studio, pose: Pose, seed: int) -> Frame:
    """What the camera sees beside a painted board that is fixed to it, half a metre ahead."""
    image, depth_m = (values.copy() for values in studio.view(pose))
    paint = np.random.default_rng(0).integers(0, 255, (12, 16, 3)).astype(np.uint8)
    image[BOARD] = cv2.resize(paint, (88, 66), interpolation=cv2.INTER_CUBIC)
    depth_m[BOARD] = 0.5
    return noisy(image, depth_m, seed=seed)


def watched(views: Iterable[tuple[Frame, Pose]]) -> list[NDArray[np.bool_] | None]:
    """The mask after each view, whose pose is known."""
    body, masks = OwnBody(), []
    for frame, pose in views:
        body.watch(frame, pose)
        masks.append(body.mask)
    return masks


def test_a_board_fixed_to_the_camera_is_masked_and_nothing_else_but_a_margin(studio: Studio) -> None:
    masks = watched((with_board(studio, pose, k), pose) for k, pose in enumerate(PATH))
    first = next(k for k, mask in enumerate(masks) if mask is not None)
    assert NEEDED_VIEWS < first < 15
    board = np.zeros((120, 160), bool)
    board[BOARD] = True
    allowed = cv2.dilate(board.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0  # two cells of 2 px
    for mask in masks[first:]:
        assert not (mask & ~allowed).any()
    assert masks[-1][BOARD].mean() > 0.95


def test_a_room_without_a_body_is_never_masked(studio: Studio) -> None:
    body = OwnBody()
    for k, pose in enumerate(PATH):
        body.watch(studio.frame(pose, 100 + k), pose)
        assert body.mask is None
        assert (body._scores >= NEEDED_VIEWS).mean() < 0.001, "by chance a cell, never a region"


def test_a_camera_that_stands_tells_nothing(studio: Studio) -> None:
    """The world stays where it is as well; poses are as noisy as they are."""
    rng = np.random.default_rng(1)
    for pose in (PATH[0], PATH[20]):
        shaken = [pose @ small_motion(rng.normal(0, 0.005, 3)) for _ in range(40)]
        assert watched((with_board(studio, pose, k), T) for k, T in enumerate(shaken))[-1] is None


def small_motion(translation_m: NDArray[np.float64] | tuple[float, float, float]) -> Pose:
    T = np.eye(4)
    T[:3, 3] = translation_m
    return T


ALONG = [look_at((0, 0.05 * k, 0), (1, 0.05 * k, 0)) for k in range(20)]
TOWARDS = [look_at((0.05 * k, 0, 0), (100, 0, 0)) for k in range(20)]
ROLLING = [look_at((0, 0, 0), (1, 0, 0), 3.0 * k) for k in range(20)]
TURNING = [look_at((0, 0, 0), (1, np.tan(np.deg2rad(2 * k - 20)), 0)) for k in range(20)]


@pytest.mark.parametrize("path", [ALONG, TOWARDS, ROLLING, TURNING], ids=["along", "towards", "rolling", "turning"])
@pytest.mark.parametrize("distance_m", [1.5, 7.5])
def test_a_plain_wall_is_no_body_although_it_may_look_the_same_for_ever(path: list[Pose], distance_m: float) -> None:
    scene = scene_of(wall(distance_m, (60, 60)))
    views = ((noisy(*render_rgbd(scene, CAMERA, pose), seed=k), pose) for k, pose in enumerate(path))
    assert watched(views)[-1] is None


def test_where_nothing_moves_in_the_image_the_poses_are_wrong_and_nothing_is_masked(studio: Studio) -> None:
    """The poses are those of something that moved before a camera that stood still."""
    frames = [studio.frame(PATH[0], k) for k in range(20)]
    claimed = [PATH[0] @ small_motion((0.05 * k, 0, 0)) for k in range(20)]
    assert watched(zip(frames, claimed, strict=True))[-1] is None


def test_a_body_that_is_gone_is_released(studio: Studio) -> None:
    there = [(with_board(studio, pose, k), pose) for k, pose in enumerate(PATH[:25])]
    gone = [(studio.frame(pose, k), pose) for k, pose in enumerate(PATH[25:])]
    masks = watched([*there, *gone])
    assert masks[24] is not None
    assert masks[-1] is None


def test_another_camera_begins_anew(studio: Studio) -> None:
    body = OwnBody()
    for k, pose in enumerate(PATH[:20]):
        body.watch(with_board(studio, pose, k), pose)
    assert body.mask is not None
    other = Camera(80, 45, 70.0, 70.0, 39.5, 22.0)  # fewer pixels than there are rows of cells
    for k in range(20):
        image, depth_m = np.zeros((45, 80), np.uint8), np.full((45, 80), 1 + 0.1 * k, np.float32)
        body.watch(Frame.from_depth(image, depth_m, other), PATH[k])
        assert body.mask is None


def test_a_camera_that_sways_for_ever_fills_no_memory(studio: Studio) -> None:
    body, frame = OwnBody(), studio.frame(PATH[0], 1)
    for k in range(3 * MAX_VIEWS):
        body.watch(frame, small_motion((0.05 * (k % 2), 0, 0)))
    assert len(body._views) == MAX_VIEWS


def tracked(studio: Studio, config: Config) -> tuple[Registrar, list[FrameResult]]:
    registrar = Registrar(config)
    return registrar, [registrar.step(with_board(studio, pose, k)) for k, pose in enumerate(PATH[:20])]


def test_a_body_found_while_tracking_is_told_once_and_left_out_from_then_on(studio: Studio) -> None:
    registrar, results = tracked(studio, Config())
    assert {result.state for result in results[1:]} == {State.TRACKING}
    told = [k for k, result in enumerate(results) if result.notes]
    assert len(told) == 1
    (note,) = results[told[0]].notes
    assert note.code == "OWN_BODY"
    assert "input.mask_boxes" in note.remedy
    mask = registrar._own_body.mask
    assert mask is not None
    assert mask[BOARD].mean() > 0.4  # it grows further
    left_out = []
    for result in results[1:]:
        assert result.compared is not None
        assert len(result.compared.features.keypoints) > 50
        left_out.append((result.compared.frame.geometry.depth_m[BOARD] == 0).mean())
    # The sensor's own holes before, the first cells at once, most of the board in the end.
    before, after = left_out[: told[0]], left_out[told[0] :]
    assert max(before) < 0.06
    assert min(after) > 1.5 * max(before)
    assert after[-1] > 0.5


def test_nothing_is_looked_for_where_it_is_switched_off(studio: Studio) -> None:
    registrar, results = tracked(studio, Config().replace({"input.own_body": "off"}))
    assert registrar._own_body.mask is None
    assert not any(result.notes or "own body" in result.timings_ms for result in results)


def test_the_body_is_known_on_in_a_session_that_begins_by_itself(studio: Studio, hall: Studio) -> None:
    """It is the same robot; a reset forgets it."""
    registrar, results = tracked(studio, Config().replace({"keyframes.lost_timeout_s": 1e-9}))
    view = look_at((0.1, 0.3, 1.4), (2, 0.1, 1.2))
    image, depth_m = measured(*hall.view(view), seed=1)
    moved = Frame.from_depth(image, depth_m, CAMERA, stamp_ns=10)
    assert registrar.step(moved).session == results[-1].session + 1
    assert registrar._own_body.mask is not None
    registrar.reset()
    assert registrar._own_body.mask is None


KITCHEN = Path(__file__).parents[2].parent / "shared" / "data" / "redkitchen"


@pytest.mark.skipif(not KITCHEN.is_dir(), reason=f"no data folder {KITCHEN.name}")
def test_nothing_is_masked_in_a_real_kitchen() -> None:
    """A hand-held camera without a body in view, at its recorded poses."""
    body, K = OwnBody(), np.loadtxt(KITCHEN / "camera-intrinsics.txt")
    camera = Camera(640, 480, K[0, 0], K[1, 1], K[0, 2], K[1, 2])
    for number in range(0, 300, 3):
        name = str(KITCHEN / f"frame-{number:06d}")
        raw = cv2.imread(f"{name}.depth.png", cv2.IMREAD_UNCHANGED)
        depth_m = np.where(raw == 65535, 0, raw).astype(np.float32) / 1000
        frame = Frame.from_depth(cv2.imread(f"{name}.color.jpg"), depth_m, camera)
        body.watch(frame, np.loadtxt(f"{name}.pose.txt"))
        assert body.mask is None
