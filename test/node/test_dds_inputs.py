# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What publishers do to a node: go, come back, change, disagree, offer the wrong thing."""

from __future__ import annotations

import re
import time

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus

from vigg_ros.messages.sensor_messages import encode_points
from vigg_ros.node.ros_classes import ros
from vigg_ros_testing.registrar_process import NodeProcess, Start, depth_arguments, parameters
from vigg_ros_testing.rendered_frames import LARGER, TYPES, frame, send, send_and_wait, stamp_of_frame
from vigg_ros_testing.ros_peer import Peer, values_of


def waiting(peer: Peer, code: str, timeout_s: float = 15.0) -> str:
    """The text of the first WAITING that names this cause."""
    found: list[dict[str, str]] = peer.wait(
        lambda: [one for one in peer.statuses("WAITING") if code in one["codes"].split()], f"WAITING {code}", timeout_s
    )
    return found[0]["text"]


def errors(peer: Peer) -> list[str]:
    """Names of the statuses in the newest /diagnostics that are errors."""
    newest = peer.heard["diagnostics"][-1] if peer.heard["diagnostics"] else None
    return [one.name for one in newest.status if one.level == DiagnosticStatus.ERROR] if newest else []


@pytest.mark.hostile("System: an input stops and comes back: ERROR within 5 s, recovers")
def test_an_input_that_stops_is_an_error_until_it_comes_back(node: NodeProcess, peer: Peer) -> None:
    send_and_wait(peer, frame(0))
    depth_stops_s = time.monotonic()
    number = 1
    while "registrar: /depth/image" not in errors(peer):
        only_colour = {topic: message for topic, message in frame(number).items() if topic != "/depth/image"}
        send(peer, only_colour)
        number += 1
        time.sleep(0.1)
        assert time.monotonic() - depth_stops_s < 20.0
    took_s = time.monotonic() - depth_stops_s
    assert "INPUT_STOPPED" in waiting(peer, "INPUT_STOPPED")
    print(f"/diagnostics said ERROR {took_s:.1f} s after the input had stopped")
    peer.clear()
    send(peer, frame(number))
    peer.wait(lambda: peer.statuses("TRACKING"), "a pose for the first pair")
    peer.wait(lambda: peer.heard["diagnostics"] and not errors(peer), "diagnostics without an error")


def test_two_publishers_are_told_and_their_late_stamps_refused(node: NodeProcess, peer: Peer) -> None:
    send_and_wait(peer, frame(10))
    second = peer.offer("/rgb/image", "sensor_msgs/msg/Image")
    assert "found 2 publishers" in node.wait_for("TWO_PUBLISHERS", 10.0)
    peer.wait(second.get_subscription_count, "the second publisher's subscription")
    second.publish(ros(frame(5)["/rgb/image"]))
    peer.wait(lambda: [one for one in peer.statuses("REFUSED") if one["reason"] == "STAMP_LATE"], "a refusal")
    peer.node.destroy_publisher(second)
    assert send_and_wait(peer, frame(11))["state"] == "TRACKING"


def test_a_late_image_counts_as_refused_and_is_logged_once(node: NodeProcess, peer: Peer) -> None:
    def log_lines() -> list[str]:
        return [line for line in node.log.splitlines() if "/rgb/image" in line and "STAMP_LATE" in line]

    before = len(log_lines())
    send_and_wait(peer, frame(5))
    assert send_and_wait(peer, frame(4))["reason"] == "STAMP_LATE"

    def counts() -> list[str]:
        arrays = list(peer.heard["diagnostics"])
        statuses = [one for array in arrays for one in array.status if one.name.endswith("/rgb/image")]
        return [pair.value for one in statuses for pair in one.values if pair.key == "refused_STAMP_LATE"]

    peer.wait(counts, "the refusal among the diagnostics")
    assert len(log_lines()) <= before + 1


@pytest.mark.hostile("CameraInfo: missing: WAITING")
def test_without_camera_info_the_node_waits_and_says_so(start: Start, peer: Peer, node: NodeProcess) -> None:
    fresh = start(*depth_arguments("-r", "__node:=fresh", "-r", "rgb/camera_info:=/fresh/camera_info"))
    other = Peer("/fresh")
    try:
        fresh.wait_until_ready()
        text = waiting(other, "NO_CAMERA_INFO")
        assert "/fresh/camera_info: found no publisher, expected one of sensor_msgs/msg/CameraInfo" in text
        assert not other.heard["pose"]
    finally:
        fresh.stop()
        other.close()


@pytest.mark.hostile("Stamps: clocks that differ: WAITING, with the measured offset")
def test_clocks_that_differ_are_named_with_their_offset(node: NodeProcess, peer: Peer) -> None:
    number = 200
    while not any("STAMPS_APART" in one["codes"] for one in peer.statuses("WAITING")):
        send(peer, frame(number, depth_later_ns=3_600_000_000_000))
        number += 1
        time.sleep(0.1)
        assert number < 400, "no word of it in 20 s"
    text = waiting(peer, "STAMPS_APART")
    found = re.search(r"/rgb/image: found stamps \+(\d+\.\d+) s from those of /depth/image", text)
    assert found, text
    # Of the images that have come, each is compared with the nearest depth image: the first, some frames later at most.
    assert float(found[1]) == pytest.approx(3600, abs=10 / 15)
    assert "expected at most sync_slop, 0.02 s; synchronise the clocks" in text
    assert not peer.heard["pose"]


def test_a_wrong_type_is_named(node: NodeProcess, peer: Peer) -> None:
    wrong = peer.offer("/depth/image", "sensor_msgs/msg/PointCloud2")
    points = np.ones((10, 3), np.float32)
    wrong.publish(ros(encode_points(points, stamp_ns=stamp_of_frame(0), frame_id="cam")))
    text = waiting(peer, "WRONG_TYPE")
    assert "found publishers of sensor_msgs/msg/PointCloud2, expected sensor_msgs/msg/Image" in text
    peer.node.destroy_publisher(wrong)


def test_best_effort_publishers_are_followed(node: NodeProcess, peer: Peer) -> None:
    for topic, kind in TYPES.items():
        peer.connect(topic, f"sensor_msgs/msg/{kind}", reliable=False)
    for number in range(20):
        send(peer, frame(300 + number), reliable=False)
        if peer.wait_briefly(lambda: peer.heard["pose"], 1.0):
            return
    raise AssertionError("no pose from small best-effort frames")


def test_a_qos_that_cannot_match_is_named(start: Start, peer: Peer) -> None:
    strict = start(*depth_arguments("-r", "__node:=strict", "-r", "rgb/image:=/strict/image", qos="reliable"))
    other = Peer("/strict")
    try:
        strict.wait_until_ready()
        other.offer("/strict/image", "sensor_msgs/msg/Image", reliable=False)
        text = waiting(other, "QOS_INCOMPATIBLE")
        assert "/strict/image: found publishers that offer best effort, expected reliable" in text
        assert "set qos to auto" in text
    finally:
        strict.stop()
        other.close()


@pytest.mark.hostile("Frames and TF: Empty frame_id N with extrinsics by parameter, else R")
def test_an_empty_frame_id_is_accepted_where_tf_is_not_asked(node: NodeProcess, peer: Peer) -> None:
    assert send_and_wait(peer, frame(400, frame_id=""))["state"] == "STARTED"
    assert "found an empty frame_id, accepted" in node.wait_for("FRAME_ID_EMPTY", 5.0)


@pytest.mark.hostile("System: burst of 1,000 frames: memory flat")
def test_a_burst_of_frames_leaves_the_memory_flat(node: NodeProcess, peer: Peer) -> None:
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


@pytest.mark.hostile("System: publisher restarts with another resolution A")
@pytest.mark.hostile("CameraInfo: changes mid-run: drop keyframes, N")
def test_a_publisher_that_restarts_with_another_resolution_begins_a_session(node: NodeProcess, peer: Peer) -> None:
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
def test_use_sim_time_without_a_clock_warns_and_goes_on(start: Start, node: NodeProcess, peer: Peer) -> None:
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
