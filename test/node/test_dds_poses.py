# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node over DDS answers as the replay does."""

import time

import numpy as np
import pytest
from rclpy.serialization import deserialize_message

from vigg_ros.node.ros_classes import class_of
from vigg_ros.pipeline import Pipeline
from vigg_ros.registration.config import Config
from vigg_ros_testing.node_recordings import assert_equal, moments, play, publish, vector, vector_of
from vigg_ros_testing.pipeline_runs import replay_bag
from vigg_ros_testing.ros_peer import stamp_of
from vigg_ros_testing.short_recordings import CHEAP, ROOM

ROOM_TOPICS = {
    "/camera/color/camera_info": "/rgb/camera_info",
    "/camera/color/image_raw/compressed": "/rgb/image",
    "/camera/aligned_depth_to_color/image_raw/compressedDepth": "/depth/image",
}
CONFIG = Config.preset("rgbd").replace(CHEAP)
LOOP_FRAMES = 17
"""Over a second, so that the beginning of the next loop is a jump back that counts; the last pair has equal stamps."""


@pytest.fixture(scope="module")
def room():
    return moments(ROOM, ROOM_TOPICS, LOOP_FRAMES)


@pytest.fixture(scope="module")
def expected():
    return replay_bag(ROOM, CONFIG, frames=LOOP_FRAMES).frames


@pytest.mark.hostile("System: bag loop three times: the same result each time")
def test_poses_equal_the_replay_in_each_loop_of_a_bag(node, peer, room, expected):
    play(peer, [*room, *room, *room])
    assert [one for one in peer.answers() if one["state"] not in ("STARTED", "TRACKING")] == []
    sessions = [int(one["session"]) for one in peer.answers()]
    assert sessions == sorted(sessions)
    assert [sessions.count(one) for one in sorted(set(sessions))] == [LOOP_FRAMES] * 3
    for loop in range(3):
        assert_equal(peer.heard["pose"][loop * LOOP_FRAMES : (loop + 1) * LOOP_FRAMES], expected)


def test_the_other_outputs_say_the_same(node, peer, room, expected):
    peer.watch_matches()
    play(peer, room[:8])
    peer.wait(lambda: peer.heard["path"] and len(peer.heard["path"][-1].poses) >= 7, "a path of all poses")
    records = [one for one in expected[:8] if one.T_odom_frame is not None]
    assert_equal(peer.heard["path"][-1].poses, records[: len(peer.heard["path"][-1].poses)])
    by_stamp = {record.stamp_ns: record for record in records}
    for relative in peer.heard["relative_pose"]:
        record = by_stamp[stamp_of(relative)]
        np.testing.assert_allclose(vector_of(relative.pose), vector(record.outcome.T_target_source), rtol=0, atol=1e-9)
        assert relative.header.frame_id == f"keyframe_{record.keyframe_id}"
    for odom in peer.heard["odom"]:
        record = by_stamp[stamp_of(odom)]
        np.testing.assert_allclose(vector_of(odom.pose), vector(record.T_odom_frame), rtol=0, atol=1e-9)
        np.testing.assert_allclose(np.array(odom.pose.covariance).reshape(6, 6), record.covariance, rtol=1e-6)
        assert (odom.header.frame_id, odom.child_frame_id) == ("odom", "camera_color_optical_frame")
    assert [stamp_of(cloud) for cloud in peer.heard["keyframe_points"]][:1] == [records[0].stamp_ns]
    assert peer.heard["matches"], "pictures of the matches, as somebody looks at them"


def test_with_drops_the_poses_are_those_of_the_frames_that_were_processed(node, peer, room):
    for one in room[0]:
        peer.connect(one.topic, one.type)
    for moment in room:
        publish(peer, moment)
        time.sleep(0.02)  # faster than they can be registered, but not faster than the middleware keeps up
    peer.wait(lambda: len(peer.answers()) >= LOOP_FRAMES, "an answer to each frame")
    dropped = {int(one["stamp_ns"]) for one in peer.statuses("DROPPED")}
    assert dropped, "frames that come at once cannot all be registered"
    assert int(peer.answers()[-1]["frames_dropped"]) >= len(dropped)
    assert_equal(peer.heard["pose"], registered_without(room, dropped))


def registered_without(room, dropped):
    """The pipeline over the frames of the recording but those."""
    pipeline = Pipeline(CONFIG)
    roles = {"/rgb/image": "image", "/rgb/camera_info": "camera_info", "/depth/image": "depth"}
    records = []
    for one in (one for moment in room for one in moment):
        message = deserialize_message(one.data, class_of(one.type))
        found = pipeline.receive(roles[one.topic], message).found
        records += pipeline.finish(pair for pair in found if pair.stamp_ns not in dropped)
    return records
