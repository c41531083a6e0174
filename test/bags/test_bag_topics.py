# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which topics are taken, by the names that real cameras and data sets use; what is unclear is asked for."""

from pathlib import Path

import pytest

from vigg_ros.bags.reader import BagReader, Topic
from vigg_ros.bags.topics import TopicError, TopicRequest, choose_topics
from vigg_ros_testing.bag_samples import COLOUR, DEPTH, INFO, TRUTH, rgbd_entries, tf_static_entry, write_bag

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


def chosen(held: list[Topic], **options) -> dict[str, str]:
    """The names of the topics taken, by role."""
    encodings = options.pop("encodings", {})
    choice = choose_topics(held, TopicRequest(**options), encodings=encodings)
    roles = ("image", "camera_info", "depth", "points", "ground_truth", "tf_static")
    taken = {role: getattr(choice, role) for role in roles}
    return {role: topic.name for role, topic in taken.items() if topic is not None}


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
STEREO = topics(
    "image /stereo/left/image_raw",
    "info /stereo/left/camera_info",
    "image /stereo/right/image_raw",
    "info /stereo/right/camera_info",
    "points /points",
)
RGBD = ("image /c/rgb", "info /c/camera_info", "image /c/depth")


@pytest.mark.parametrize("held", [REALSENSE, REALSENSE[::-1]], ids=["as listed", "in another order"])
def test_realsense_takes_colour_and_the_depth_aligned_to_it(held) -> None:
    assert chosen(held) == {
        "image": "/camera/color/image_raw",
        "camera_info": "/camera/color/camera_info",
        "depth": "/camera/aligned_depth_to_color/image_raw",
        "tf_static": "/tf_static",
    }


def test_what_is_asked_for_is_taken() -> None:
    taken = chosen(REALSENSE, geometry="points")
    assert taken["points"] == "/camera/depth/color/points"
    assert "depth" not in taken
    # A leading slash may be left out; and naming the image names its calibration too.
    assert chosen(REALSENSE, depth="camera/depth/image_rect_raw")["depth"] == "/camera/depth/image_rect_raw"
    assert chosen(STEREO, image="/stereo/right/image_raw")["camera_info"] == "/stereo/right/camera_info"


OPENNI = ("/camera/rgb/image_rect_color", "/camera/rgb/camera_info", "/camera/depth_registered/image_raw")
OTHERS = {
    OPENNI: [*(f"image /camera/rgb/image_{name}" for name in ("raw", "rect_mono")), "image /camera/depth/image_raw"]
    + ["info /camera/depth_registered/camera_info"],
    ("/camera/rgb/image_color", "/camera/rgb/camera_info", "/camera/depth/image"): ["info /camera/depth/camera_info"],
    ("/rgb/image_raw", "/rgb/camera_info", "/depth_to_rgb/image_raw"): [],  # Azure Kinect
    ("/image", "/info", "/depth"): [],
    # Only one camera has depth.
    ("/front/color/image_raw", "/front/color/camera_info", "/front/depth/image_raw"): [
        *("image /rear/color/image_raw", "info /rear/color/camera_info")
    ],
}
"""Beside the image, its calibration and the depth that belong together."""


@pytest.mark.parametrize("expected", OTHERS)
def test_what_belongs_together_is_taken(expected: tuple[str, ...]) -> None:
    held = topics(*OTHERS[expected], *map(" ".join, zip(("image", "info", "image"), expected, strict=True)))
    assert tuple(chosen(held).values()) == expected


@pytest.mark.parametrize(
    "held",
    [
        {
            "image": "compressed /camera/color/image_raw/compressed",
            "camera_info": "info /camera/color/camera_info",
            "depth": "compressed /camera/aligned_depth_to_color/image_raw/compressedDepth",
        },
        {
            "image": "image /camera/color/image_rect_color",
            "camera_info": "info /camera/color/camera_info",
            "points": "points /velodyne_points",
            "ground_truth": "pose /ground_truth/pose",
            "tf_static": "tf /tf_static",
        },
    ],
    ids=["all compressed", "KITTI"],
)
def test_all_that_a_recorder_kept_is_taken(held: dict[str, str]) -> None:
    assert chosen(topics(*held.values())) == {role: line.split()[1] for role, line in held.items()}


@pytest.mark.hostile("Bags: no tf_static: ask for `--extrinsics`")
def test_a_missing_tf_static_is_none_and_no_error() -> None:
    held = topics("image /cam/image_raw", "info /cam/camera_info", "points /points", "tf /tf")
    assert choose_topics(held).tf_static is None


@pytest.mark.parametrize(
    ("encodings", "image", "depth"),
    [
        ({"/a/left": "32FC1", "/a/right": "rgb8"}, "/a/right", "/a/left"),
        ({"/a/left": "mono8", "/a/right": "16UC1"}, "/a/left", "/a/right"),
        ({"/depth_camera/rgb": "bgr8", "/depth_camera/z": "16UC1"}, "/depth_camera/rgb", "/depth_camera/z"),
    ],
)
def test_the_encoding_tells_depth_where_the_name_does_not(encodings, image, depth) -> None:
    held = topics(*(f"image {name}" for name in encodings), "info /a/camera_info")
    taken = chosen(held, encodings=encodings)
    assert (taken["image"], taken["depth"]) == (image, depth)


def test_topics_without_messages_are_not_taken_unless_there_are_no_others() -> None:
    held = [*topics("image /a/depth", count=0), *topics("image /b/depth", "image /c/rgb", "info /c/info")]
    assert chosen(held)["depth"] == "/b/depth"
    assert chosen(topics(*RGBD, count=0))["image"] == "/c/rgb"


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
    choice = choose_topics(topics(*RGBD, *poses))
    assert (choice.ground_truth.name if choice.ground_truth else None) == truth
    assert bool(choice.notes) == bool(noted)
    assert not noted or noted in choice.notes[0]


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_topics_of_a_bag_are_chosen_by_what_it_holds(storage: str, tmp_path: Path) -> None:
    with BagReader(write_bag(tmp_path / "b", [tf_static_entry(), *rgbd_entries()], storage=storage)) as reader:
        choice = choose_topics(reader.topics, encodings=reader.encodings())
    assert choice.names == (COLOUR, INFO, DEPTH, TRUTH, "/tf_static")


def without(line: str) -> list[Topic]:
    return topics(*(one for one in RGBD if one != line))


@pytest.mark.hostile("Bags: topic missing, wrong type or ambiguous: exit 2 with the candidates listed")
@pytest.mark.parametrize(
    ("held", "asked", "says"),
    [
        (STEREO, {}, "could be meant: /stereo/left/image_raw, /stereo/right/image_raw; choose one with --image-topic"),
        (topics(*RGBD, "image /c/depth2"), {}, "could be meant: /c/depth, /c/depth2; choose one with --depth-topic"),
        (topics(*RGBD, "info /c/info2"), {}, "/c/camera_info, /c/info2; choose one with --camera-info-topic"),
        (topics(*RGBD, "image /c/rgb2"), {}, "could be meant: /c/rgb, /c/rgb2; choose one with --image-topic"),
        (topics(*RGBD[:2], "points /front", "points /rear"), {}, "/front, /rear; choose one with --points-topic"),
        (topics(*RGBD, "pose /gt", "pose /mocap/pose"), {}, "/gt, /mocap/pose; choose one with --ground-truth-topic"),
        (without(RGBD[0]), {}, "found no topic for --image-topic; the bag's topics of type"),
        (without(RGBD[1]), {}, "found no topic for --camera-info-topic; the bag has no topic of type"),
        (without(RGBD[2]), {}, "found neither depth images (--depth-topic) nor clouds (--points-topic)"),
        (without(RGBD[2]), {"geometry": "depth"}, "found no topic for --depth-topic; the bag's topics of type"),
        (REALSENSE, {"depth": "/camera/imu"}, "--depth-topic /camera/imu is of type sensor_msgs/msg/Imu; the bag's"),
        ([], {}, "only: nothing"),
        *(
            ([*REALSENSE, *topics("pose /p")], {role: "/nowhere"}, "-topic /nowhere is not in the bag; the bag's")
            for role in ("image", "camera_info", "depth", "points", "ground_truth")
        ),
    ],
)
def test_what_is_missing_wrong_or_unclear_is_asked_for_with_the_candidates(held, asked, says) -> None:
    with pytest.raises(TopicError) as caught:
        choose_topics(held, TopicRequest(**asked))
    assert says in str(caught.value)
    # Of the right type if there are any, else all of them.
    assert not held or any(topic.name in str(caught.value) for topic in held)
