# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Topics that are missing, wrong or not clear: the candidates are listed with the option to give."""

from __future__ import annotations

import pytest

from vigg_ros.bags.topics import TopicError, TopicRequest, choose_topics
from vigg_ros.registration.errors import BagError
from vigg_ros_testing.topic_samples import REALSENSE, chosen, topics

TOPIC_ROW = pytest.mark.hostile("Bags: topic missing, wrong type or ambiguous: exit 2 with the candidates listed")


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
        TopicError, match=r"neither depth images \(--depth-topic\) nor clouds \(--points-topic\); .*: /c/rgb \(9\)"
    ):
        choose_topics(held)
    with pytest.raises(TopicError, match="found no topic for --depth-topic"):
        choose_topics(held, TopicRequest(geometry="depth"))


@TOPIC_ROW
@pytest.mark.parametrize("option", ["image", "camera_info", "depth", "points", "ground_truth"])
def test_a_named_topic_that_is_not_there_lists_the_candidates(option: str) -> None:
    held = [*REALSENSE, *topics("pose /mocap/pose")]
    with pytest.raises(TopicError, match=r"-topic /nowhere is not in the bag; the bag's topics of type .*: /"):
        choose_topics(held, TopicRequest(**{option: "/nowhere"}))


@TOPIC_ROW
def test_a_named_topic_of_the_wrong_type_says_which() -> None:
    with pytest.raises(TopicError, match=r"--depth-topic /camera/imu is of type sensor_msgs/msg/Imu; the bag"):
        choose_topics(REALSENSE, TopicRequest(depth="/camera/imu"))


@TOPIC_ROW
def test_an_empty_bag_says_so() -> None:
    with pytest.raises(TopicError, match="only: nothing"):
        choose_topics([])


def test_a_topic_error_is_a_bag_error() -> None:
    assert issubclass(TopicError, BagError)


@TOPIC_ROW
def test_two_truths_are_asked_for() -> None:
    held = topics("image /c/rgb", "info /c/camera_info", "image /c/depth", "pose /gt", "pose /mocap/pose")
    with pytest.raises(TopicError, match="/gt, /mocap/pose; choose one with --ground-truth-topic"):
        choose_topics(held)
