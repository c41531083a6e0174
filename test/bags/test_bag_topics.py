# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which topics are taken, by the names that real cameras and data sets use."""

from __future__ import annotations

from pathlib import Path

import pytest
from bag_samples import COLOUR, DEPTH, INFO, TRUTH, rgbd_entries, tf_static_entry, write_bag

from vigg_ros.bags.reader import BagReader, Topic
from vigg_ros.bags.topics import TopicError, TopicRequest, choose_topics
from vigg_ros.registration.errors import BagError

TOPIC_ROW = pytest.mark.hostile(
    "Bags: topic missing, wrong type or ambiguous: exit 2 with the candidates listed"
)
TYPES = {
    "image": "sensor_msgs/msg/Image",
    "compressed": "sensor_msgs/msg/CompressedImage",
    "info": "sensor_msgs/msg/CameraInfo",
    "points": "sensor_msgs/msg/PointCloud2",
    "pose": "geometry_msgs/msg/PoseStamped",
    "odometry": "nav_msgs/msg/Odometry",
    "tf": "tf2_msgs/msg/TFMessage",
    "imu": "sensor_msgs/msg/Imu",
}


def topics(*lines: str, count: int = 9) -> list[Topic]:
    """Topics of lines like "image /camera/image_raw"."""
    pairs = (line.split() for line in lines)
    return [Topic(name, TYPES[kind], count) for kind, name in pairs]


def chosen(held: list[Topic], **options) -> dict[str, str | None]:
    encodings = options.pop("encodings", {})
    choice = choose_topics(held, TopicRequest(**options), encodings=encodings)
    fields = ("image", "camera_info", "depth", "points", "ground_truth", "tf_static")
    taken = {field: getattr(choice, field) for field in fields}
    return {field: topic.name for field, topic in taken.items() if topic is not None}


REALSENSE = topics(
    "image /camera/color/image_raw",
    "compressed /camera/color/image_raw/compressed",
    "info /camera/color/camera_info",
    "image /camera/depth/image_rect_raw",
    "info /camera/depth/camera_info",
    "image /camera/aligned_depth_to_color/image_raw",
    "compressed /camera/aligned_depth_to_color/image_raw/compressedDepth",
    "info /camera/aligned_depth_to_color/camera_info",
    "image /camera/infra1/image_rect_raw",
    "info /camera/infra1/camera_info",
    "points /camera/depth/color/points",
    "imu /camera/imu",
    "tf /tf",
    "tf /tf_static",
)
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
            (
                "/camera/rgb/image_rect_color",
                "/camera/rgb/camera_info",
                "/camera/depth_registered/image_raw",
            ),
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
        pytest.param(
            topics("image /image", "info /info", "image /depth"), ("/image", "/info", "/depth"), id="bare"
        ),
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


@TOPIC_ROW
def test_two_cameras_are_asked_for_with_the_option() -> None:
    with pytest.raises(
        TopicError,
        match=r"several topics could be meant: /stereo/left/image_raw, /stereo/right/image_raw; "
        r"choose one with --image-topic",
    ):
        choose_topics(STEREO)


@TOPIC_ROW
def test_naming_the_image_names_its_calibration_too() -> None:
    taken = chosen(STEREO, image="/stereo/right/image_raw")
    assert taken["camera_info"] == "/stereo/right/camera_info"


@TOPIC_ROW
@pytest.mark.parametrize(
    ("extra", "option"),
    [
        ("image /c/depth2", "--depth-topic"),
        ("info /c/camera_info2", "--camera-info-topic"),
        ("image /c/rgb2", "--image-topic"),
    ],
)
def test_what_is_not_clear_is_asked_for(extra: str, option: str) -> None:
    held = topics("image /c/rgb", "info /c/camera_info", "image /c/depth", extra)
    with pytest.raises(TopicError, match=rf"could be meant: .*{extra.split()[1]}; choose one with {option}"):
        choose_topics(held)


@TOPIC_ROW
def test_two_clouds_are_asked_for() -> None:
    held = topics("image /c/rgb", "info /c/camera_info", "points /front", "points /rear")
    with pytest.raises(TopicError, match="/front, /rear; choose one with --points-topic"):
        choose_topics(held)


@TOPIC_ROW
@pytest.mark.parametrize(
    ("missing", "option", "listed"),
    [
        ("image /c/rgb", "--image-topic", r"topics of type .*: /c/depth \(9\)"),
        ("info /c/camera_info", "--camera-info-topic", "no topic of type sensor_msgs/msg/CameraInfo, only: "),
    ],
)
def test_a_missing_topic_lists_what_there_is(missing: str, option: str, listed: str) -> None:
    lines = ["image /c/rgb", "info /c/camera_info", "image /c/depth"]
    lines.remove(missing)
    with pytest.raises(TopicError, match=rf"found no topic for {option}; .*{listed}"):
        choose_topics(topics(*lines))


@TOPIC_ROW
def test_no_depth_of_either_kind_names_both_options() -> None:
    held = topics("image /c/rgb", "info /c/camera_info")
    with pytest.raises(
        TopicError,
        match=r"neither depth images \(--depth-topic\) nor clouds \(--points-topic\); .*: /c/rgb \(9\)",
    ):
        choose_topics(held)
    with pytest.raises(TopicError, match="found no topic for --depth-topic"):
        choose_topics(held, TopicRequest(geometry="depth"))


@TOPIC_ROW
@pytest.mark.parametrize("option", ["image", "camera_info", "depth", "points", "ground_truth"])
def test_a_named_topic_that_is_not_there_lists_the_candidates(option: str) -> None:
    held = [*REALSENSE, *topics("pose /mocap/pose")]
    with pytest.raises(
        TopicError, match=r"-topic /nowhere is not in the bag; the bag's topics of type .*: /"
    ):
        choose_topics(held, TopicRequest(**{option: "/nowhere"}))


@TOPIC_ROW
def test_a_named_topic_of_the_wrong_type_says_which() -> None:
    with pytest.raises(
        TopicError, match=r"--depth-topic /camera/imu is of type sensor_msgs/msg/Imu; the bag"
    ):
        choose_topics(REALSENSE, TopicRequest(depth="/camera/imu"))


@TOPIC_ROW
def test_an_empty_bag_says_so() -> None:
    with pytest.raises(TopicError, match="only: nothing"):
        choose_topics([])


def test_a_topic_error_is_a_bag_error() -> None:
    assert issubclass(TopicError, BagError)


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


@TOPIC_ROW
def test_two_truths_are_asked_for() -> None:
    held = topics("image /c/rgb", "info /c/camera_info", "image /c/depth", "pose /gt", "pose /mocap/pose")
    with pytest.raises(TopicError, match="/gt, /mocap/pose; choose one with --ground-truth-topic"):
        choose_topics(held)


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_topics_of_a_bag_are_chosen_by_what_it_holds(storage: str, tmp_path: Path) -> None:
    with BagReader(
        write_bag(tmp_path / "b", [tf_static_entry(), *rgbd_entries()], storage=storage)
    ) as reader:
        choice = choose_topics(reader.topics, encodings=reader.encodings())
    assert choice.names == (COLOUR, INFO, DEPTH, TRUTH, "/tf_static")
