# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The bundled bags hold what their README says, and the script that rendered them is the one beside them."""

from __future__ import annotations

import struct
from collections import defaultdict
from itertools import islice
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from vigg_ros.bench.worlds import KinectNoise, Scene, render_depth, render_image, room, scan_lidar

BAGS = Path(__file__).parents[2] / "bags"
DEPTH = "/camera/aligned_depth_to_color/image_raw/compressedDepth"


def messages(name: str) -> dict[str, list[Any]]:
    by_topic = defaultdict(list)
    with AnyReader([BAGS / name], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, _, data in reader.messages():
            by_topic[connection.topic].append(reader.deserialize(data, connection.msgtype))
    return by_topic


def stamp_ns(message: Any) -> int:
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def rigid(position: Any, orientation: Any) -> NDArray[np.float64]:
    T_frame_child = np.eye(4)
    q = orientation
    T_frame_child[:3, :3] = Rotation.from_quat((q.x, q.y, q.z, q.w)).as_matrix()
    T_frame_child[:3, 3] = (position.x, position.y, position.z)
    return T_frame_child


@pytest.fixture(scope="module")
def script() -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BAGS))
        import render_bags  # type: ignore[import-not-found]

        return render_bags


@pytest.fixture(scope="module")
def room_bag() -> dict[str, list[Any]]:
    return messages("room_rgbd")


@pytest.fixture(scope="module")
def street_bag() -> dict[str, list[Any]]:
    return messages("street_lidar")


@pytest.mark.parametrize("name", ["room_rgbd", "street_lidar"])
def test_a_bag_is_small(name: str) -> None:
    assert sum(path.stat().st_size for path in (BAGS / name).iterdir()) < 3_000_000


def test_the_room_is_seen_often_enough_and_from_where_the_truth_says(
    room_bag: dict[str, list[Any]], script: ModuleType
) -> None:
    truth = room_bag["/ground_truth/pose"]
    assert len(truth) == len(room_bag[DEPTH]) == len(room_bag["/camera/color/image_raw/compressed"]) >= 60
    for message in truth:
        T_world_camera = script.ROOM_LOOP.T_world_camera((stamp_ns(message) - script.START_NS) / 1e9)
        seen = rigid(message.pose.position, message.pose.orientation)
        np.testing.assert_allclose(seen, T_world_camera, atol=1e-12)


def test_room_images_and_depth_show_the_room(room_bag: dict[str, list[Any]], script: ModuleType) -> None:
    scene, camera = room(seed=7), script.ROOM_CAMERA
    colour, depth = room_bag["/camera/color/image_raw/compressed"][10], room_bag[DEPTH][10]
    assert stamp_ns(depth) - stamp_ns(colour) == 4_300_017
    at_colour = script.ROOM_LOOP.T_world_camera((stamp_ns(colour) - script.START_NS) / 1e9)
    at_depth = script.ROOM_LOOP.T_world_camera((stamp_ns(depth) - script.START_NS) / 1e9)
    image = cv2.imdecode(colour.data, cv2.IMREAD_COLOR)
    # JPEG at quality 75, 6 % of gain and noise of 1.5: 28 dB is an error of 10 grey levels.
    assert cv2.PSNR(image, render_image(scene, camera, at_colour)) > 25
    assert depth.format == "16UC1; compressedDepth png"
    assert struct.unpack("<iff", depth.data[:12].tobytes()) == (0, 0.0, 0.0)
    measured_m = cv2.imdecode(depth.data[12:], cv2.IMREAD_UNCHANGED) / 1000
    exact_m = render_depth(scene, camera, at_depth)
    errors_m = (measured_m - exact_m)[measured_m > 0]
    # A step of 1/8 px at 4 m is 46 mm: the rounding stays below 23 mm, the noise below 5 sigma.
    assert np.abs(errors_m).max() < 0.023 + 5 * KinectNoise().sigma_m(np.float64(4.1))
    assert np.mean(measured_m > 0) > 0.85


def test_street_truth_is_the_drive(street_bag: dict[str, list[Any]], script: ModuleType) -> None:
    transforms = {t.child_frame_id: t.transform for t in street_bag["/tf_static"][0].transforms}
    lidar, camera = transforms["lidar"], transforms["camera_optical_frame"]
    T_base_lidar = rigid(lidar.translation, lidar.rotation)
    np.testing.assert_allclose(T_base_lidar, script.T_BASE_LIDAR, atol=1e-12)
    np.testing.assert_allclose(rigid(camera.translation, camera.rotation), script.T_BASE_CAMERA, atol=1e-12)
    assert 20 <= len(street_bag["/ground_truth/pose"]) == len(street_bag["/lidar/points"])
    for message in street_bag["/ground_truth/pose"]:
        time_s = script.STREET_BEGIN_S + (stamp_ns(message) - script.START_NS) / 1e9
        T_world_lidar = script.STREET_DRIVE.T_world_vehicle(time_s) @ T_base_lidar
        seen = rigid(message.pose.position, message.pose.orientation)
        np.testing.assert_allclose(seen, T_world_lidar, atol=1e-9)


def test_street_clouds_show_the_street(street_bag: dict[str, list[Any]], a_street: Scene, script: ModuleType) -> None:
    cloud = street_bag["/lidar/points"][12]
    rows = cloud.data.view("<f4").reshape(-1, 5)
    begin_s = script.STREET_BEGIN_S + (stamp_ns(cloud) - script.START_NS) / 1e9
    exact = scan_lidar(
        a_street,
        lambda time_s: script.STREET_DRIVE.T_world_vehicle(begin_s + time_s) @ script.T_BASE_LIDAR,
        script.STREET_LIDAR,
    )
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
