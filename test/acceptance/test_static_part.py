# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What moves with the camera, or by itself, is no veto as long as the larger part of the view speaks for an answer."""

import cv2
import numpy as np
import pytest

from vigg_ros.acceptance.agreement import Pair
from vigg_ros.acceptance.static_part import region_of
from vigg_ros.registration import Config, Registration, extract, register
from vigg_ros.registration.matches import no_matches
from vigg_ros_testing.registration_samples import CAMERA, answer, assert_near, looking, noisy, truth

CONFIG = Config()
BOARD_M = 0.5
POSES = looking(), looking((0.15, 0.15, 0), (0, 0.2, 0))


def behind_a_board(studio, pose, seed, *, share, shift_px=0):
    """A view with a printed board half a metre before the lens over a share of it, at the lower left."""
    image, depth_m = (array.copy() for array in studio.view(pose))
    height, width = (round(np.sqrt(share) * size) for size in depth_m.shape)
    print_ = np.kron(np.random.default_rng(7).integers(0, 255, (20, 27, 3)), np.ones((6, 6, 1)))
    print_ = cv2.GaussianBlur(print_.astype(np.float32), (0, 0), 1.2)
    place = np.s_[depth_m.shape[0] - height :, shift_px : shift_px + width]
    image[place] = print_[:height, :width]
    depth_m[place] = BOARD_M
    return extract(noisy(image, depth_m, seed=seed), CONFIG)


@pytest.mark.parametrize("shift_px", [0, round(0.1 * CAMERA.fx_px / BOARD_M)], ids=["fixed to the camera", "moving"])
def test_a_board_over_a_third_of_the_view_does_not_hide_the_motion(shift_px, studio):
    target = behind_a_board(studio, POSES[0], 1, share=0.3)
    source = behind_a_board(studio, POSES[1], 2, share=0.3, shift_px=shift_px)
    found = answer(register(target, source, CONFIG))
    assert_near(found.T_target_source, truth(*POSES), rotation_deg=1.0, translation_m=0.04)


def test_a_board_over_most_of_the_view_gives_no_wrong_answer(studio):
    """It moves by 10 cm; that motion is shown by most of what is seen, and is not the camera's."""
    shift_px = round(0.1 * CAMERA.fx_px / BOARD_M)
    target = behind_a_board(studio, POSES[0], 1, share=0.65)
    source = behind_a_board(studio, POSES[1], 2, share=0.65, shift_px=shift_px)
    outcome = register(target, source, CONFIG)
    if isinstance(outcome, Registration):
        assert_near(outcome.T_target_source, truth(*POSES), rotation_deg=1.0, translation_m=0.04)


def test_the_region_is_the_board(studio):
    """Under no motion the board coincides with itself, and next to nothing else; under the true one it contradicts."""
    features = [behind_a_board(studio, pose, seed, share=0.3) for seed, pose in enumerate(POSES)]
    pair = Pair(*features, no_matches(), no_matches(), CONFIG)
    for T, coinciding in ((np.eye(4), True), (truth(*POSES), False)):
        region = region_of(pair, T, coinciding=coinciding)
        height, width = region.source.shape
        on_board = region.source[height // 2 + 5 : -5, 5 : width // 2 - 5]
        assert on_board.mean() > 0.7
        assert 0.2 < region.share < 0.6
        without = region.removed_from(pair)
        assert np.count_nonzero(without[1].geometry.depth_m == BOARD_M) < 0.3 * 0.3 * without[1].geometry.depth_m.size
