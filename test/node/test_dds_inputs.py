# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What publishers do to a node: go, come back, change, disagree, offer the wrong thing."""

import re
import time
from itertools import count

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus

from vigg_ros.bench.worlds import hall_of_columns, render_rgbd
from vigg_ros.bench.worlds.poses import look_at
from vigg_ros.messages.sensor_messages import encode_image, encode_points
from vigg_ros.node.ros_classes import ros
from vigg_ros_testing.registrar_process import depth_arguments, parameters
from vigg_ros_testing.rendered_frames import LARGER, SMALL, TYPES, frame, send, send_and_wait, stamp_of_frame
from vigg_ros_testing.ros_peer import Peer, values_of


def waiting(peer, code, timeout_s=15.0):
    """The text of the first WAITING that names this cause."""
    found: list[dict[str, str]] = peer.wait(
        lambda: [one for one in peer.statuses("WAITING") if code in one["codes"].split()], f"WAITING {code}", timeout_s
    )
    return found[0]["text"]


def errors(peer):
    """Names of the statuses in the newest /diagnostics that are errors."""
    newest = peer.heard["diagnostics"][-1] if peer.heard["diagnostics"] else None
    return [one.name for one in newest.status if one.level == DiagnosticStatus.ERROR] if newest else []


@pytest.mark.hostile("System: an input stops and comes back: ERROR within 5 s, recovers")
def test_an_input_that_stops_is_an_error_until_it_comes_back(node, peer):
    send_and_wait(peer, frame(0))
    sent = count(1)
    depth_stops_s = time.monotonic()
    while "registrar: /depth/image" not in errors(peer):
        send(peer, {topic: message for topic, message in frame(next(sent)).items() if topic != "/depth/image"})
        assert not peer.wait_briefly(lambda: time.monotonic() - depth_stops_s > 20.0, 0.1)
    assert "INPUT_STOPPED" in waiting(peer, "INPUT_STOPPED")
    print(f"/diagnostics said ERROR {time.monotonic() - depth_stops_s:.1f} s after the input had stopped")
    peer.clear()
    send(peer, frame(next(sent)))
    peer.wait(lambda: peer.statuses("TRACKING"), "a pose for the first pair")
    peer.wait(lambda: peer.heard["diagnostics"] and not errors(peer), "diagnostics without an error")


def refusals_in_diagnostics(peer, topic, code):
    """All that was said of how many messages of the topic were refused for this reason."""
    statuses = [one for array in list(peer.heard["diagnostics"]) for one in array.status if one.name.endswith(topic)]
    return [pair.value for one in statuses for pair in one.values if pair.key == f"refused_{code}"]


def test_two_publishers_are_told_and_their_late_stamps_refused_and_counted(node, peer):
    send_and_wait(peer, frame(10))
    second = peer.offer("/rgb/image", "sensor_msgs/msg/Image")
    assert "found 2 publishers" in node.wait_for("TWO_PUBLISHERS", 10.0)
    peer.wait(second.get_subscription_count, "the second publisher's subscription")
    second.publish(ros(frame(5)["/rgb/image"]))
    peer.wait(lambda: [one for one in peer.statuses("REFUSED") if one["reason"] == "STAMP_LATE"], "a refusal")
    peer.node.destroy_publisher(second)
    peer.wait(lambda: refusals_in_diagnostics(peer, "/rgb/image", "STAMP_LATE"), "the refusal among the diagnostics")
    assert send_and_wait(peer, frame(11))["state"] == "TRACKING"


@pytest.mark.hostile("CameraInfo: missing: WAITING")
def test_without_camera_info_and_with_a_qos_that_cannot_match_the_node_waits_and_says_so(start, node, peer):
    remaps = [word for topic in ("rgb/image", "rgb/camera_info") for word in ("-r", f"{topic}:=/lonely/{topic}")]
    lonely = start(*depth_arguments("-r", "__node:=lonely", *remaps, qos="reliable"))
    other = Peer("/lonely")
    try:
        lonely.wait_until_ready()
        other.offer("/lonely/rgb/image", "sensor_msgs/msg/Image", reliable=False)
        text = waiting(other, "QOS_INCOMPATIBLE")
        assert "/lonely/rgb/image: found publishers that offer best effort, expected reliable" in text
        assert "set qos to auto" in text
        assert "/lonely/rgb/camera_info: found no publisher, expected one of sensor_msgs/msg/CameraInfo" in text
        assert not other.heard["pose"]
    finally:
        lonely.stop()
        other.close()


@pytest.mark.hostile("Stamps: clocks that differ: WAITING, with the measured offset")
def test_clocks_that_differ_are_named_with_their_offset(node, peer):
    for number in range(200, 400):
        send(peer, frame(number, depth_later_ns=3_600_000_000_000))
        if peer.wait_briefly(lambda: any("STAMPS_APART" in one["codes"] for one in peer.statuses("WAITING")), 0.1):
            break
    text = waiting(peer, "STAMPS_APART")
    found = re.search(r"/rgb/image: found stamps \+(\d+\.\d+) s from those of /depth/image", text)
    assert found, text
    # Of the images that have come, each is compared with the nearest depth image: the first, some frames later at most.
    assert float(found[1]) == pytest.approx(3600, abs=10 / 15)
    assert "expected at most sync_slop, 0.02 s; synchronise the clocks" in text
    assert not peer.heard["pose"]


def test_a_wrong_type_is_named(node, peer):
    wrong = peer.offer("/depth/image", "sensor_msgs/msg/PointCloud2")
    points = np.ones((10, 3), np.float32)
    wrong.publish(ros(encode_points(points, stamp_ns=stamp_of_frame(0), frame_id="cam")))
    text = waiting(peer, "WRONG_TYPE")
    assert "found publishers of sensor_msgs/msg/PointCloud2, expected sensor_msgs/msg/Image" in text
    peer.node.destroy_publisher(wrong)


def test_best_effort_publishers_are_followed(node, peer):
    for topic, kind in TYPES.items():
        peer.connect(topic, f"sensor_msgs/msg/{kind}", reliable=False)
    for number in range(20):
        send(peer, frame(300 + number), reliable=False)
        if peer.wait_briefly(lambda: peer.heard["pose"], 1.0):
            return
    raise AssertionError("no pose from small best-effort frames")


@pytest.mark.hostile("Frames and TF: Empty frame_id N with extrinsics by parameter, else R")
def test_an_empty_frame_id_is_accepted_where_tf_is_not_asked(node, peer):
    assert send_and_wait(peer, frame(400, frame_id=""))["state"] == "STARTED"
    assert "found an empty frame_id, accepted" in node.wait_for("FRAME_ID_EMPTY", 5.0)


@pytest.mark.hostile("System: burst of 1,000 frames: memory flat")
def test_a_burst_of_frames_leaves_the_memory_flat(node, peer):
    begun = 1000
    for number in range(200):
        send(peer, frame(begun + number))
    before_mb = node.memory_mb()
    for number in range(200, 1200):
        send(peer, frame(begun + number))
    after_mb = node.memory_mb()
    peer.wait_briefly(lambda: False, 0.5)
    assert send_and_wait(peer, frame(begun + 1300))["state"] == "TRACKING"
    print(f"memory {before_mb:.0f} MB, after 1,000 frames at once {after_mb:.0f} MB")
    # A thousand frames are 134 MB of pixels; the middleware holds ten messages of each topic.
    assert after_mb - before_mb < 30


def elsewhere(stamp_ns):
    """A frame of another world."""
    image, depth_m = render_rgbd(hall_of_columns(seed=2), SMALL, look_at((0, 0.3, 1.4), (2, 0.1, 1.2)))
    at = {"stamp_ns": stamp_ns, "frame_id": "cam"}
    seen = {"/rgb/image": encode_image(image, **at), "/depth/image": encode_image(depth_m, **at)}
    return frame(0, stamp_ns=stamp_ns) | seen


def test_a_camera_carried_away_begins_a_session_by_itself_and_the_log_says_why(node, peer):
    """As in a replay; stamps say how long it was lost, not the clock."""
    before = send_and_wait(peer, frame(40))
    answers = [send_and_wait(peer, elsewhere(stamp_of_frame(40) + k * 10**9)) for k in (1, 2, 3, 4)]
    assert [one["state"] for one in answers] == ["LOST", "LOST", "STARTED", "TRACKING"]
    begun = int(before["session"]) + 1
    assert [int(one["session"]) for one in answers] == [begun - 1, begun - 1, begun, begun]
    assert "STARTED: lost for 3.0 s: a new session starts" in answers[2]["text"]
    node.wait_for(f"session {begun} started: lost for 3.0 s: a new session starts; cam at this frame", 5.0)
    assert "LOST_TIMEOUT" in node.wait_for("found no pose for 3.0 s, a new session began", 5.0)


@pytest.mark.hostile("System: publisher restarts with another resolution A")
@pytest.mark.hostile("CameraInfo: changes mid-run: drop keyframes, N")
def test_a_publisher_that_restarts_with_another_resolution_begins_a_session(node, peer):
    before = send_and_wait(peer, frame(0))
    peer.withdraw()
    after = send_and_wait(peer, frame(2, camera=LARGER))
    if after["state"] == "REFUSED":  # topics are not ordered: the image was here before its CameraInfo
        assert after["reason"] == "CALIBRATION_SIZE"
        after = send_and_wait(peer, frame(2, camera=LARGER, stamp_ns=stamp_of_frame(2) + 1_000_000))
    assert after["state"] == "STARTED"
    assert int(after["session"]) == int(before["session"]) + 1
    assert send_and_wait(peer, frame(3, camera=LARGER))["state"] == "TRACKING"
    assert "keyframes were dropped" in node.wait_for("CALIBRATION_CHANGED", 5.0)


@pytest.mark.hostile("System: use_sim_time without /clock: output goes on, with a warning")
def test_use_sim_time_without_a_clock_warns_and_goes_on(start, node, peer):
    node.stop()
    simulated = start(*depth_arguments(), *parameters(use_sim_time=True)).wait_until_ready()
    peer.clear()
    peer.withdraw()
    assert send_and_wait(peer, frame(0))["state"] == "STARTED"
    assert send_and_wait(peer, frame(1))["state"] == "TRACKING"
    assert "use_sim_time" in simulated.wait_for("NO_CLOCK", 15.0)
    assert send_and_wait(peer, frame(2))["state"] == "TRACKING"
    peer.wait(lambda: peer.heard["diagnostics"], "diagnostics")
    assert values_of(peer.heard["diagnostics"][-1].status[0])["received"] != "0"
    assert simulated.stop()[0] == 0
