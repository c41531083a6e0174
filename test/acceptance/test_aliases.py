# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where else shapes could fit: along the axes of a scene of planes, and about them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vigg_ros.acceptance.agreement import Pair
from vigg_ros.acceptance.aliases import REACH_VOXELS, aliases, scene_axes
from vigg_ros.registration import Config
from vigg_ros.registration.matches import no_matches
from vigg_ros.registration.rigid import angle_rad, transform
from vigg_ros_testing.registration_samples import looking


def test_the_axes_are_those_of_walls_and_floor_whichever_way_the_camera_looks():
    rng = np.random.default_rng(0)
    R = Rotation.random(random_state=1).as_matrix()
    planes = np.repeat(np.eye(3), (300, 200, 40), axis=0) + rng.normal(0, 0.03, (540, 3))
    planes *= rng.choice((-1, 1), (540, 1))  # opposite walls
    found = scene_axes((planes / np.linalg.norm(planes, axis=1, keepdims=True)) @ R.T)
    np.testing.assert_allclose(np.abs(found @ R), np.eye(3), atol=0.05)
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-9)


def test_one_plane_has_axes_too():
    found = scene_axes(np.tile((0.0, 0.0, 1.0), (50, 1)))
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(np.abs(found[0]), (0, 0, 1), atol=1e-9)


def test_an_answer_is_slid_as_far_as_said_and_turned_about_what_is_seen(studio):
    config = Config()
    pair = Pair(studio.features(looking(), 0), studio.features(looking(), 1), no_matches(), no_matches(), config)
    tried = aliases(pair, np.eye(4))
    slides = [T[:3, 3] for T in tried if np.allclose(T[:3, :3], np.eye(3))]
    reach_m = REACH_VOXELS * config.geometric.voxel_size_m
    assert max(np.linalg.norm(slide) for slide in slides) == pytest.approx(reach_m)
    np.testing.assert_allclose(np.sum(slides, axis=0), 0, atol=1e-9)
    middle = pair.source.patches.points.mean(axis=0)
    turns = [T for T in tried if not np.allclose(T[:3, :3], np.eye(3))]
    assert {round(np.rad2deg(angle_rad(T[:3, :3]))) for T in turns} == {90, 180}
    for T in turns:
        np.testing.assert_allclose(transform(T, middle[None])[0], middle, atol=1e-5)
