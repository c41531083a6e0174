# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scans with images over DDS; transforms from a stand-in for tf2_ros, which the wheels on PyPI do not have."""

import json
from pathlib import Path

import numpy as np
import pytest

from vigg_ros.node.settings import Settings
from vigg_ros.registration.rigid import inverse
from vigg_ros.tracking.extrinsics import fixed
from vigg_ros_testing.node_recordings import assert_equal, moments, play, publish, vector_of
from vigg_ros_testing.pipeline_runs import replay_bag
from vigg_ros_testing.registrar_process import parameters
from vigg_ros_testing.ros_peer import stamp_of
from vigg_ros_testing.short_recordings import STREET

TOPICS = {
    "/camera/camera_info": "/rgb/camera_info",
    "/camera/image_raw/compressed": "/rgb/image",
    "/lidar/points": "/points",
}
OPTIONS = {"geometric.sample_k": 2000}
EXTRINSICS = "0.6 0.1 -0.4 -0.5149 0.4846 -0.4846 0.5149"
"""Near those of the bag; what matters is that node and replay get the same."""

T_BASE_LIDAR = np.array([[0.0, -1, 0, 0.1], [1, 0, 0, 0], [0, 0, 1, 1.9], [0, 0, 0, 1]])

FAKE_TF2 = Path(__file__).parents[1] / "vigg_ros_testing" / "fake_tf2"
FRAMES = 5


@pytest.fixture(scope="module")
def street():
    return moments(STREET, TOPICS, FRAMES)


@pytest.fixture(scope="module")
def expected():
    settings = Settings.resolve({"config": "lidar", "extrinsics": EXTRINSICS, **OPTIONS})
    return replay_bag(STREET, settings.config, frames=FRAMES, lookup=fixed(settings.T_camera_points)).frames


def lidar_arguments(**values):
    return parameters(config="lidar", geometry="points", geometric__sample_k=2000, **values)


def test_poses_equal_the_replay(start, peer, street, expected):
    node = start(*lidar_arguments(extrinsics=EXTRINSICS)).wait_until_ready()
    play(peer, street)
    assert sum(record.has_pose for record in expected) == FRAMES
    peer.wait(lambda: len(peer.answers()) >= FRAMES - 1, "answers to all but a last pair that is not certain")
    assert_equal(peer.heard["pose"], expected[: len(peer.answers())])
    assert {odom.child_frame_id for odom in peer.heard["odom"]} == {"lidar"}
    assert node.stop()[0] == 0


@pytest.mark.hostile("Frames and TF: a link that never comes: NO_TF, never identity")
def test_scans_wait_for_tf_and_poses_are_those_of_the_base(start, peer, street, tmp_path, expected):
    links = tmp_path / "links.json"
    links.write_text("{}")
    environment = {"PYTHONPATH": f"{FAKE_TF2}:{FAKE_TF2.parents[2]}", "FAKE_TF": str(links)}
    arguments = lidar_arguments(base_frame="base_link", publish_tf=True, tf_timeout=0.05)
    node = start(*arguments, environment=environment).wait_until_ready()
    peer.withdraw()
    peer.clear()
    for moment in street[:2]:
        publish(peer, moment)
        peer.wait_briefly(lambda: len(peer.answers()) == 2, 2.0)
    assert {(one["state"], one["reason"]) for one in peer.answers()} == {("REFUSED", "NO_TF")}
    assert "no transform from 'lidar' to 'camera_optical_frame'" in node.wait_for("NO_TF")
    assert not peer.heard["pose"]
    T_base_camera = T_BASE_LIDAR @ Settings.resolve({"extrinsics": EXTRINSICS}).T_parent_camera
    links.write_text(json.dumps({"lidar": T_BASE_LIDAR.tolist(), "camera_optical_frame": T_base_camera.tolist()}))
    peer.call("reset")
    peer.clear()
    play(peer, street[2:])  # what was refused has used up its stamps
    peer.wait(lambda: len(peer.heard["odom"]) >= 1, "odometry of the second frame")
    check_poses_of_the_base(peer, expected)
    assert [one.child_frame_id for one in peer.heard["tf"]] == ["base_link"] * len(peer.heard["pose"])
    assert node.stop()[0] == 0


def check_poses_of_the_base(peer, expected):
    """The motion of the scanner between two frames, carried to the base by hand."""
    first, second = peer.heard["pose"][:2]
    by_stamp = {record.stamp_ns: record.T_odom_frame for record in expected}
    T_start_now = inverse(by_stamp[stamp_of(first)]) @ by_stamp[stamp_of(second)]
    T_odom_base = T_BASE_LIDAR @ T_start_now @ inverse(T_BASE_LIDAR)
    np.testing.assert_allclose(vector_of(first), [0, 0, 0, 0, 0, 0, 1], atol=1e-9)
    # Another keyframe than in the replay from the beginning: the same motion to the precision of a registration.
    np.testing.assert_allclose(vector_of(second)[:3], T_odom_base[:3, 3], atol=0.05)
    assert {odom.child_frame_id for odom in peer.heard["odom"]} <= {"base_link"}


def test_without_tf2_the_node_says_where_to_get_it(start):
    node = start(*lidar_arguments())
    assert node.exit_code() == 2
    assert "tf2_ros, which is missing" in node.log
    assert "extrinsics as x y z qx qy qz qw" in node.log
    assert "Traceback" not in node.log
