# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Silence is explained by the first cause that blocks each input; a second parent on TF is noticed."""

from dataclasses import replace

import pytest

from vigg_ros.node.tf_parents import ParentWatch
from vigg_ros.node.watchdog import Facts, InputFacts, Offer, explain, patience_s

IMAGE = Offer("sensor_msgs/msg/Image", reliable=True)
INFO = Offer("sensor_msgs/msg/CameraInfo", reliable=True)

COLOUR = InputFacts("image", "/cam/rgb", IMAGE.type, True, (IMAGE,), 0.1, "", 50)
DEPTH = InputFacts("depth", "/cam/depth", IMAGE.type, True, (IMAGE,), 0.1, "", 50)
CALIBRATION = InputFacts("camera_info", "/cam/info", INFO.type, True, (INFO,), 0.1, "", 50)
WELL = Facts((COLOUR, DEPTH, CALIBRATION), 0.02, 0.0, "", "")


def with_input(one, **changes):
    """The facts with one input changed."""
    return replace(WELL, inputs=tuple(replace(o, **changes) if o is one else o for o in WELL.inputs))


@pytest.mark.parametrize(
    ("facts", "code", "words"),
    [
        (with_input(DEPTH, offers=()), "NO_PUBLISHER", "-r depth/image:=/its/topic"),
        (replace(with_input(DEPTH, offers=()), idle_topics=("/points",)), "NO_PUBLISHER", "set geometry to points"),
        (with_input(CALIBRATION, offers=()), "NO_CAMERA_INFO", "-r rgb/camera_info:=/its/topic"),
        (with_input(COLOUR, offers=(INFO,)), "WRONG_TYPE", "publishers of sensor_msgs/msg/CameraInfo, expected sensor"),
        (
            with_input(COLOUR, offers=(Offer("sensor_msgs/msg/CompressedImage", reliable=True),)),
            "WRONG_TYPE",
            "set image_transport to compressed",
        ),
        (with_input(DEPTH, offers=(replace(IMAGE, reliable=False),)), "QOS_INCOMPATIBLE", "set qos to auto"),
        (with_input(DEPTH, age_s=None, good=0), "NOTHING_ARRIVES", "fastdds_shm.xml"),
        (with_input(CALIBRATION, age_s=None, good=0), "NO_CAMERA_INFO", "1 publisher, but no message"),
        (with_input(DEPTH, age_s=7.3), "INPUT_STOPPED", "no message for 7.3 s"),
        (with_input(DEPTH, last_refusal="found x (BAD)"), "ALL_REFUSED", "found x (BAD)"),
        (replace(WELL, offset_s=0.033), "STAMPS_APART", "stamps +33.0 ms from those of /cam/depth"),
        (replace(WELL, offset_s=-7200.5), "STAMPS_APART", "stamps -7200.500 s"),
        (replace(WELL, last_reason="NO_TF", last_message="found no link"), "NO_TF", "found no link"),
        (replace(WELL, last_reason="NO_DEPTH", last_message="12 points"), "NO_DEPTH", "12 points"),
        (replace(WELL, last_reason="TOO_FEW_MATCHES", last_message="2"), "TOO_FEW_MATCHES", "frames without a pose"),
        (replace(WELL, busy=True), "BUSY", "lower geometric.sample_k"),
        (WELL, "NO_FRAME", "vigg doctor"),
    ],
)
def test_a_cause_is_named_with_its_remedy(facts, code, words):
    (finding,) = explain(facts)
    assert finding.code == code
    assert words in str(finding)


@pytest.mark.parametrize(("max_rate_hz", "expected_s"), [(0.0, 3.5), (30.0, 3.5), (0.5, 3.5), (0.1, 15.0)])
def test_a_low_limit_of_the_rate_is_waited_for(max_rate_hz, expected_s):
    assert patience_s(max_rate_hz) == pytest.approx(expected_s)


def test_each_input_has_its_own_cause():
    facts = replace(WELL, inputs=(replace(COLOUR, offers=()), replace(DEPTH, age_s=9.0), CALIBRATION))
    assert [(one.topic, one.code) for one in explain(facts)] == [
        ("/cam/rgb", "NO_PUBLISHER"),
        ("/cam/depth", "INPUT_STOPPED"),
    ]


def test_a_calibration_that_is_sent_once_is_enough():
    (finding,) = explain(with_input(CALIBRATION, age_s=3600.0))
    assert finding.code == "NO_FRAME"


def test_stamps_apart_do_not_hide_another_reason():
    (finding,) = explain(replace(WELL, offset_s=0.5, last_reason="NO_TEXTURE", last_message="dark"))
    assert finding.code == "NO_TEXTURE"


class Frames:
    """What tf2 tells; it never forgets a parent."""

    def __init__(self):
        self.text = "[]"  # as tf2 says it without any frames
        self.asked = 0

    def __call__(self):
        self.asked += 1
        return self.text

    def base_link_below(self, parent, newest_s):
        self.text = (
            f"base_link: \n  parent: '{parent}'\n  broadcaster: 'default_authority'\n  rate: 10.0\n"
            f"  most_recent_transform: {newest_s:.6f}\n  oldest_transform: 1.0\n  buffer_length: 9.0\n"
        )


def test_a_parent_that_comes_later_is_noticed_and_own_transforms_are_none():
    frames = Frames()
    watch = ParentWatch(frames)
    assert watch.other_parent("base_link", "odom", 100.0) is None
    frames.base_link_below("odom", 100.0)
    assert watch.other_parent("base_link", "odom", 101.0) is None
    frames.base_link_below("wheels", 101.5)
    assert watch.other_parent("base_link", "odom", 101.9) is None, "asked once a second"
    assert watch.other_parent("base_link", "odom", 102.0) == "wheels"
    assert watch.other_parent("base_link", "odom", 102.1) == "wheels"
    assert frames.asked == 3


def test_a_parent_that_is_no_longer_renewed_has_gone():
    frames = Frames()
    watch = ParentWatch(frames)
    found = []
    for second in range(20):
        if second < 5:
            frames.base_link_below("wheels", 1000.0 + second)
        found.append(watch.other_parent("base_link", "odom", float(second)))
    # Renewed for the last time at 4 s, and given 5 s more.
    assert found == ["wheels"] * 9 + [None] * 11
    frames.base_link_below("wheels", 2000.0)
    assert watch.other_parent("base_link", "odom", 20.0) == "wheels"


def test_a_static_parent_stays():
    frames = Frames()
    frames.base_link_below("map", 0.0)
    watch = ParentWatch(frames)
    assert {watch.other_parent("base_link", "odom", float(second)) for second in range(0, 100, 7)} == {"map"}


def test_each_base_is_asked_for():
    frames = Frames()
    frames.base_link_below("wheels", 1.0)
    watch = ParentWatch(frames)
    assert watch.other_parent("lidar", "odom", 0.0) is None
    assert watch.other_parent("base_link", "odom", 0.1) == "wheels"
