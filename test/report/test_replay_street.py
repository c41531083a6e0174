# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The bundled bag of a camera and a LiDAR, replayed against its ground truth."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import TopicRequest, choose_topics
from vigg_ros.bench.worlds.poses import T_BODY_OPTICAL, flat
from vigg_ros.registration import Config
from vigg_ros.registration.rigid import inverse
from vigg_ros.report.bag_messages import read_extrinsics
from vigg_ros.report.recording import measure
from vigg_ros.tracking.extrinsics import StaticTree, fixed
from vigg_ros_testing.pipeline_runs import replay_bag

BAG = Path(__file__).parents[2] / "bags" / "street_lidar"
SCANS = 25
CONFIG = Config.preset("lidar")

JERKS = (5, 23)
"""The frames just after the car starts and stops turning, at once: the mean motion since the last frame,
by which their scans are de-skewed, is half that of the scan itself."""


replay = partial(replay_bag, BAG, CONFIG)


@pytest.fixture(scope="module")
def recording():
    return replay()


@pytest.fixture(scope="module")
def accuracy(recording):
    return measure(recording).pooled


def test_every_scan_is_answered(recording):
    assert [record.state for record in recording.frames] == ["STARTED"] + ["TRACKING"] * (SCANS - 1)
    assert recording.coverage == 1
    assert not recording.refused
    assert recording.frame_id == "lidar"
    assert [record.stamp_ns for record in recording.frames] == [pose.stamp_ns for pose in recording.truth]


def test_poses_are_within_the_range_noise(accuracy):
    errors_m = accuracy.absolute.translation_m
    steady = ~np.isin(np.arange(SCANS), JERKS)
    # Ranges are good for 2 cm, and so is a pose; the three keyframes before the last one add up less than that.
    assert errors_m[steady].max() < 0.02
    # At a jerk the scan keeps the skew of a turn of 0.43 rad/s: over 50 ms, and at 6 m of range, 13 cm
    # at its ends; the mean over the scan is less.
    assert errors_m.max() < 0.13
    # 3 cm at 10 m, and half the beam spacing of 0.9 deg between columns at the jerks.
    assert np.median(accuracy.absolute.rotation_deg) < 0.1
    assert accuracy.absolute.rotation_deg.max() < 0.45


def test_errors_at_the_start_do_not_stay(accuracy):
    """The first scan is de-skewed once the motion is known: without that, 14 cm remain at the end."""
    assert accuracy.path_m == pytest.approx(14.4, abs=0.1)
    assert accuracy.end_error_m < 0.03
    assert accuracy.drift_percent < 0.2


def test_motion_from_frame_to_frame_is_within_the_range_noise(accuracy):
    # Two poses, each within 2 cm; those beside the jerks apart.
    beside = [index for jerk in JERKS for index in (jerk - 1, jerk)]
    steady = ~np.isin(np.arange(SCANS - 1), beside)
    assert accuracy.consecutive.translation_m[steady].max() < 0.02
    assert accuracy.consecutive.rotation_deg[steady].max() < 0.1


def test_without_transforms_every_scan_is_refused_and_none_lost():
    refused = replay(lookup=StaticTree().lookup)
    assert [record.reason for record in refused.frames] == ["NO_TF"] * SCANS
    assert refused.refused == {"NO_TF": SCANS}


def test_extrinsics_as_transforms_of_the_bag_or_by_hand_are_the_same():
    """The mounts that the script of the bag names; quaternions of the bag are good for the last digits."""
    T_base_lidar, T_base_camera = flat((0.1, 0.0, 1.9), 2.0), flat((0.7, 0.1, 1.5), -1.5) @ T_BODY_OPTICAL
    with BagReader(BAG) as reader:
        choice = choose_topics(reader.topics, TopicRequest(), encodings=reader.encodings())
        tree = read_extrinsics(reader, choice)
    by_hand = fixed(inverse(T_base_camera) @ T_base_lidar)("camera_optical_frame", "lidar")
    by_bag = tree.lookup("camera_optical_frame", "lidar")
    np.testing.assert_allclose(by_bag, by_hand, atol=1e-12)
