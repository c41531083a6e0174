# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which topics are taken, by the names that real cameras and data sets use."""

from __future__ import annotations

from pathlib import Path

import pytest

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import choose_topics
from vigg_ros_testing.bag_samples import COLOUR, DEPTH, INFO, TRUTH, rgbd_entries, tf_static_entry, write_bag
from vigg_ros_testing.topic_samples import REALSENSE, chosen, topics

TOPIC_ROW = pytest.mark.hostile("Bags: topic missing, wrong type or ambiguous: exit 2 with the candidates listed")


REALSENSE_TAKEN = {
    "image": "/camera/color/image_raw",
    "camera_info": "/camera/color/camera_info",
    "depth": "/camera/aligned_depth_to_color/image_raw",
    "tf_static": "/tf_static",
}


def test_realsense_takes_colour_and_the_depth_aligned_to_it() -> None:
    assert chosen(REALSENSE) == REALSENSE_TAKEN


def test_the_order_of_the_topics_does_not_matter() -> None:
    assert chosen(REALSENSE[::-1]) == REALSENSE_TAKEN


def test_points_are_taken_when_they_are_asked_for() -> None:
    taken = chosen(REALSENSE, geometry="points")
    assert taken["points"] == "/camera/depth/color/points"
    assert "depth" not in taken


@pytest.mark.parametrize(
    ("held", "expected"),
    [
        pytest.param(
            topics(
                "image /camera/rgb/image_color",
                "info /camera/rgb/camera_info",
                "image /camera/depth/image",
                "info /camera/depth/camera_info",
            ),
            ("/camera/rgb/image_color", "/camera/rgb/camera_info", "/camera/depth/image"),
            id="TUM",
        ),
        pytest.param(
            topics(
                "image /camera/rgb/image_raw",
                "image /camera/rgb/image_rect_color",
                "image /camera/rgb/image_rect_mono",
                "info /camera/rgb/camera_info",
                "image /camera/depth/image_raw",
                "image /camera/depth_registered/image_raw",
                "info /camera/depth_registered/camera_info",
            ),
            ("/camera/rgb/image_rect_color", "/camera/rgb/camera_info", "/camera/depth_registered/image_raw"),
            id="openni",
        ),
        pytest.param(
            topics(
                "compressed /camera/color/image_raw/compressed",
                "info /camera/color/camera_info",
                "compressed /camera/aligned_depth_to_color/image_raw/compressedDepth",
            ),
            (
                "/camera/color/image_raw/compressed",
                "/camera/color/camera_info",
                "/camera/aligned_depth_to_color/image_raw/compressedDepth",
            ),
            id="all compressed",
        ),
        pytest.param(
            topics("image /rgb/image_raw", "info /rgb/camera_info", "image /depth_to_rgb/image_raw"),
            ("/rgb/image_raw", "/rgb/camera_info", "/depth_to_rgb/image_raw"),
            id="Azure Kinect",
        ),
        pytest.param(topics("image /image", "info /info", "image /depth"), ("/image", "/info", "/depth"), id="bare"),
        pytest.param(
            topics(
                "image /front/color/image_raw",
                "info /front/color/camera_info",
                "image /front/depth/image_raw",
                "image /rear/color/image_raw",
                "info /rear/color/camera_info",
            ),
            ("/front/color/image_raw", "/front/color/camera_info", "/front/depth/image_raw"),
            id="only one camera has depth",
        ),
    ],
)
def test_what_belongs_together_is_taken(held, expected) -> None:
    taken = chosen(held)
    assert (taken["image"], taken["camera_info"], taken["depth"]) == expected


def test_kitti_takes_the_cloud() -> None:
    held = topics(
        "image /camera/color/image_rect_color",
        "info /camera/color/camera_info",
        "points /velodyne_points",
        "pose /ground_truth/pose",
        "tf /tf_static",
    )
    assert chosen(held) == {
        "image": "/camera/color/image_rect_color",
        "camera_info": "/camera/color/camera_info",
        "points": "/velodyne_points",
        "ground_truth": "/ground_truth/pose",
        "tf_static": "/tf_static",
    }


@pytest.mark.hostile("Bags: no tf_static: ask for `--extrinsics`")
def test_a_missing_tf_static_is_none_and_no_error() -> None:
    held = topics("image /cam/image_raw", "info /cam/camera_info", "points /points", "tf /tf")
    assert choose_topics(held).tf_static is None


def test_the_encoding_tells_depth_where_the_name_does_not() -> None:
    held = topics("image /a/left", "image /a/right", "info /a/camera_info")
    assert chosen(held, encodings={"/a/left": "32FC1", "/a/right": "rgb8"})["depth"] == "/a/left"
    assert chosen(held, encodings={"/a/left": "mono8", "/a/right": "16UC1"})["depth"] == "/a/right"


def test_the_name_does_not_make_a_colour_image_depth() -> None:
    held = topics("image /depth_camera/rgb", "info /depth_camera/info", "image /depth_camera/z")
    taken = chosen(held, encodings={"/depth_camera/rgb": "bgr8", "/depth_camera/z": "16UC1"})
    assert (taken["image"], taken["depth"]) == ("/depth_camera/rgb", "/depth_camera/z")


def test_topics_without_messages_are_not_taken() -> None:
    held = [*topics("image /a/depth", count=0), *topics("image /b/depth", "image /c/rgb", "info /c/info")]
    assert chosen(held)["depth"] == "/b/depth"


def test_a_bag_without_messages_still_has_topics() -> None:
    held = topics("image /c/depth", "image /c/rgb", "info /c/info", count=0)
    assert chosen(held)["image"] == "/c/rgb"


STEREO = topics(
    "image /stereo/left/image_raw",
    "info /stereo/left/camera_info",
    "image /stereo/right/image_raw",
    "info /stereo/right/camera_info",
    "points /points",
)


def test_a_leading_slash_may_be_left_out() -> None:
    assert chosen(REALSENSE, depth="camera/depth/image_rect_raw")["depth"] == "/camera/depth/image_rect_raw"


@pytest.mark.parametrize(
    ("poses", "truth", "noted"),
    [
        ([], None, None),
        (["pose /ground_truth/pose", "odometry /odom", "pose /goal"], "/ground_truth/pose", None),
        (["odometry /vicon/robot/odom", "odometry /odom"], "/vicon/robot/odom", None),
        (["pose /robot/gt"], "/robot/gt", None),
        (["odometry /odom"], "/odom", "taken for the ground truth, as the only topic with poses"),
        (["odometry /odom", "pose /goal"], None, "give --ground-truth-topic, one of: /odom, /goal"),
    ],
)
def test_ground_truth_is_what_is_called_so(poses, truth, noted) -> None:
    held = topics("image /c/rgb", "info /c/camera_info", "image /c/depth", *poses)
    choice = choose_topics(held)
    assert (choice.ground_truth.name if choice.ground_truth else None) == truth
    assert bool(choice.notes) == bool(noted)
    assert not noted or noted in choice.notes[0]


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_topics_of_a_bag_are_chosen_by_what_it_holds(storage: str, tmp_path: Path) -> None:
    with BagReader(write_bag(tmp_path / "b", [tf_static_entry(), *rgbd_entries()], storage=storage)) as reader:
        choice = choose_topics(reader.topics, encodings=reader.encodings())
    assert choice.names == (COLOUR, INFO, DEPTH, TRUTH, "/tf_static")
