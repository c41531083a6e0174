# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The bundled bags hold what their README says, and the script that rendered them is the one beside them."""

from __future__ import annotations

import struct
from itertools import islice
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.spatial import KDTree

from vigg_ros.bench.worlds import KinectNoise, render_depth, render_image, room, scan_lidar, street
from vigg_ros.sensors.header import stamp_ns
from vigg_ros.sensors.stamped_pose import decode_pose, decode_transform
from vigg_ros_testing.dataset_samples import messages_of

BAGS = Path(__file__).parents[2] / "bags"
COLOUR = "/camera/color/image_raw/compressed"
DEPTH = "/camera/aligned_depth_to_color/image_raw/compressedDepth"
TRUTH = "/ground_truth/pose"

Messages = dict[str, list[Any]]


def seconds(message: Any, script: ModuleType) -> float:
    """Of a message's stamp, from the beginning of the bags."""
    return (stamp_ns(message.header.stamp) - script.START_NS) / 1e9


@pytest.fixture(scope="module")
def script() -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BAGS))
        import render_bags  # type: ignore[import-not-found]

        return render_bags


@pytest.fixture(scope="module")
def room_bag() -> Messages:
    return messages_of(BAGS / "room_rgbd")


@pytest.fixture(scope="module")
def street_bag() -> Messages:
    return messages_of(BAGS / "street_lidar")


@pytest.mark.parametrize("name", ["room_rgbd", "street_lidar"])
def test_a_bag_is_small(name: str) -> None:
    assert sum(path.stat().st_size for path in (BAGS / name).iterdir()) < 3_000_000


def test_the_room_is_seen_often_enough_and_from_where_the_truth_says(room_bag: Messages, script: ModuleType) -> None:
    assert len(room_bag[TRUTH]) == len(room_bag[DEPTH]) == len(room_bag[COLOUR]) >= 60
    for message in room_bag[TRUTH]:
        T_world_camera = script.ROOM_LOOP.T_world_camera(seconds(message, script))
        np.testing.assert_allclose(decode_pose(message).T_frame_child, T_world_camera, atol=1e-12)


def test_room_images_and_depth_show_the_room(room_bag: Messages, script: ModuleType) -> None:
    scene, camera = room(seed=7), script.ROOM_CAMERA
    colour, depth = room_bag[COLOUR][10], room_bag[DEPTH][10]
    assert stamp_ns(depth.header.stamp) - stamp_ns(colour.header.stamp) == 4_300_017
    at_colour, at_depth = (script.ROOM_LOOP.T_world_camera(seconds(one, script)) for one in (colour, depth))
    image = cv2.imdecode(colour.data, cv2.IMREAD_COLOR)
    # JPEG at quality 75, 6 % of gain and noise of 1.5: 28 dB is an error of 10 grey levels.
    assert cv2.PSNR(image, render_image(scene, camera, at_colour)) > 25
    assert depth.format == "16UC1; compressedDepth png"
    assert struct.unpack("<iff", depth.data[:12].tobytes()) == (0, 0.0, 0.0)
    measured_m = cv2.imdecode(depth.data[12:], cv2.IMREAD_UNCHANGED) / 1000
    errors_m = (measured_m - render_depth(scene, camera, at_depth))[measured_m > 0]
    # A step of 1/8 px at 4 m is 46 mm: the rounding stays below 23 mm, the noise below 5 sigma.
    assert np.abs(errors_m).max() < 0.023 + 5 * KinectNoise().sigma_m(np.float64(4.1))
    assert np.mean(measured_m > 0) > 0.85


def test_street_truth_is_the_drive(street_bag: Messages, script: ModuleType) -> None:
    found = {one.child_frame_id: one for one in map(decode_transform, street_bag["/tf_static"][0].transforms)}
    np.testing.assert_allclose(found["lidar"].T_frame_child, script.T_BASE_LIDAR, atol=1e-12)
    np.testing.assert_allclose(found["camera_optical_frame"].T_frame_child, script.T_BASE_CAMERA, atol=1e-12)
    assert 20 <= len(street_bag[TRUTH]) == len(street_bag["/lidar/points"])
    for message in street_bag[TRUTH]:
        T_world_base = script.STREET_DRIVE.T_world_vehicle(script.STREET_BEGIN_S + seconds(message, script))
        np.testing.assert_allclose(decode_pose(message).T_frame_child, T_world_base @ script.T_BASE_LIDAR, atol=1e-9)


def test_street_clouds_show_the_street(street_bag: Messages, script: ModuleType) -> None:
    cloud = street_bag["/lidar/points"][12]
    rows = cloud.data.view("<f4").reshape(-1, 5)
    begin_s = script.STREET_BEGIN_S + seconds(cloud, script)

    def T_world_lidar(time_s: float) -> Any:
        return script.STREET_DRIVE.T_world_vehicle(begin_s + time_s) @ script.T_BASE_LIDAR

    exact = scan_lidar(street(seed=3), T_world_lidar, script.STREET_LIDAR)
    distances_m, nearest = KDTree(exact.points).query(rows[:, :3])
    # 2 cm of noise along the ray and half a grid step of 8 mm along each axis.
    assert np.quantile(distances_m, 0.99) < 4 * 0.02
    np.testing.assert_allclose(rows[:, 4], exact.times_s[nearest], atol=6e-4)
    assert np.abs(rows[:, 4]).max() < 0.05


def test_rendering_again_gives_the_same_messages(script: ModuleType) -> None:
    first, again = (list(islice(script.room_rgbd(), 4)) for _ in range(2))
    for one, other in zip(first, again, strict=True):
        assert one.received_ns == other.received_ns
        np.testing.assert_equal(other.message.fields, one.message.fields)
