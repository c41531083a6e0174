# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Chains of static transforms."""

from __future__ import annotations

import numpy as np
import pytest

from vigg_ros.bench.worlds.poses import T_BODY_OPTICAL, Pose, flat
from vigg_ros.registration.rigid import inverse
from vigg_ros.tracking.extrinsics import StaticTree, fixed

T_BASE_LIDAR = flat((0.1, 0.0, 1.9), 2.0)
T_BASE_MAST = flat((0.5, 0.2, 1.0), 30.0)
T_MAST_CAMERA = flat((0.0, 0.0, 0.4), -31.0)


def car() -> StaticTree:
    """base_link holds lidar and mast, the mast a camera, the camera its optical frame."""
    tree = StaticTree()
    tree.add("camera", "optical", T_BODY_OPTICAL)
    tree.add("base_link", "lidar", T_BASE_LIDAR)
    tree.add("mast", "camera", T_MAST_CAMERA)
    tree.add("base_link", "mast", T_BASE_MAST)
    return tree


def assert_same(actual: Pose | None, expected: Pose) -> None:
    assert actual is not None
    # A product of four rotations keeps all but the last digits.
    np.testing.assert_allclose(actual, expected, atol=1e-14)


def test_a_link_is_found_both_ways() -> None:
    assert_same(car().lookup("base_link", "lidar"), T_BASE_LIDAR)
    assert_same(car().lookup("lidar", "base_link"), inverse(T_BASE_LIDAR))


def test_a_chain_goes_up_and_down_the_tree() -> None:
    T_base_optical = T_BASE_MAST @ T_MAST_CAMERA @ T_BODY_OPTICAL
    assert_same(car().lookup("optical", "lidar"), inverse(T_base_optical) @ T_BASE_LIDAR)


def test_a_known_point_is_seen_where_it_stands() -> None:
    """3 m before and 0.1 m above a camera that looks along the car's x axis, 1.4 m high."""
    tree = StaticTree()
    tree.add("base_link", "optical", flat((0.5, 0.0, 1.4)) @ T_BODY_OPTICAL)
    T_optical_base = tree.lookup("optical", "base_link")
    assert T_optical_base is not None
    np.testing.assert_allclose(T_optical_base @ (3.5, 0.0, 1.5, 1.0), (0.0, -0.1, 3.0, 1.0), atol=1e-15)


def test_frames_that_nothing_connects_have_no_transform() -> None:
    tree = car()
    tree.add("trailer", "rear_lidar", T_BASE_LIDAR)
    assert tree.lookup("optical", "rear_lidar") is None
    assert tree.lookup("optical", "unheard_of") is None
    assert tree.lookup("unheard_of", "optical") is None
    assert StaticTree().lookup("a", "b") is None


@pytest.mark.parametrize("name", ["lidar", "unheard_of"])
def test_a_frame_is_where_it_is_itself(name: str) -> None:
    """Also one that no link names: a driver may publish the points in the camera's frame."""
    assert_same(car().lookup(name, name), np.eye(4))


def test_the_latest_of_two_transforms_for_a_link_holds() -> None:
    tree = car()
    tree.add("base_link", "lidar", flat((9.0, 0.0, 0.0)))
    assert_same(tree.lookup("base_link", "lidar"), flat((9.0, 0.0, 0.0)))
    assert_same(tree.lookup("lidar", "base_link"), flat((-9.0, 0.0, 0.0)))


def test_a_loop_of_links_ends_with_the_shortest_chain() -> None:
    tree = car()
    tree.add("lidar", "optical", flat((1.0, 2.0, 3.0)))
    assert_same(tree.lookup("lidar", "optical"), flat((1.0, 2.0, 3.0)))
    assert tree.lookup("lidar", "unheard_of") is None


def test_frames_are_listed_once() -> None:
    assert car().frame_ids == ["base_link", "camera", "lidar", "mast", "optical"]


def test_a_transform_given_by_the_user_answers_whatever_the_frames_are_called() -> None:
    lookup = fixed(T_BASE_LIDAR)
    assert_same(lookup("camera", "lidar"), T_BASE_LIDAR)
    assert_same(lookup("", ""), T_BASE_LIDAR)
