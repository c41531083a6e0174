# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Services of the node, and the signals that end it."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import numpy as np
import pytest

from vigg_ros_testing.pose_comparison import vector_of
from vigg_ros_testing.registrar_process import NodeProcess, Start, depth_arguments, parameters
from vigg_ros_testing.rendered_frames import frame, send, send_and_wait, stamp_of_frame
from vigg_ros_testing.ros_peer import Peer, stamp_of

SLOW = parameters(
    geometry="depth", geometric__always=True, geometric__voxel_size_m=0.004, geometric__sample_k=50000,
    acceptance__candidates=50, local_match__iterations=20,
)  # fmt: skip
"""So that a registration of a small frame takes long enough to be interrupted."""


def test_reset_begins_a_new_session_at_the_origin(node: NodeProcess, peer: Peer) -> None:
    first = send_and_wait(peer, frame(0))
    assert send_and_wait(peer, frame(3))["state"] == "TRACKING"
    response, _ = peer.call("reset")
    assert response.success
    again = send_and_wait(peer, frame(1))
    assert (again["state"], again["stamp_ns"]) == ("STARTED", str(stamp_of_frame(1))), "stamps may begin anew too"
    assert int(again["session"]) > int(first["session"])
    peer.wait(lambda: len(peer.heard["pose"]) == 3, "three poses")
    np.testing.assert_array_equal(vector_of(peer.heard["pose"][-1]), [0, 0, 0, 0, 0, 0, 1])


def test_reset_takes_the_path_and_the_cloud_of_the_keyframe_away(node: NodeProcess, peer: Peer) -> None:
    send_and_wait(peer, frame(0))
    peer.wait(lambda: any(cloud.width for cloud in peer.heard["keyframe_points"]), "the cloud of the first frame")
    peer.wait(lambda: any(path.poses for path in peer.heard["path"]), "a path")
    peer.call("reset")
    peer.wait(lambda: peer.heard["keyframe_points"][-1].width == 0, "a cloud without points", 5.0)
    peer.wait(lambda: not peer.heard["path"][-1].poses, "a path without poses", 5.0)
    cloud = peer.heard["keyframe_points"][-1]
    assert (cloud.header.frame_id, stamp_of(cloud)) == ("odom", stamp_of_frame(0))


def test_new_keyframe_takes_the_next_frame_however_near(node: NodeProcess, peer: Peer) -> None:
    send_and_wait(peer, frame(0))
    assert send_and_wait(peer, frame(1))["new_keyframe"] == "False"
    peer.call("new_keyframe")
    assert send_and_wait(peer, frame(2))["new_keyframe"] == "True"
    assert send_and_wait(peer, frame(3))["keyframe"] == "1"


def test_pause_lets_frames_pass_and_keeps_the_keyframes(node: NodeProcess, peer: Peer) -> None:
    send_and_wait(peer, frame(0))
    peer.call("pause", data=True)
    assert send_and_wait(peer, frame(1))["state"] == "PAUSED"
    response, _ = peer.call("pause", data=False)
    assert response.message == "running"
    after = send_and_wait(peer, frame(2))
    assert (after["state"], after["keyframe"]) == ("TRACKING", "0")
    assert [stamp_of(pose) for pose in peer.heard["pose"]] == [stamp_of_frame(0), stamp_of_frame(2)]


def test_without_output_dir_nothing_is_saved(node: NodeProcess, peer: Peer) -> None:
    response, _ = peer.call("save_trajectory")
    assert not response.success
    assert "output_dir" in response.message


@pytest.mark.hostile("System: reset at 50 Hz")
def test_resets_at_50_hz_leave_the_node_well(node: NodeProcess, peer: Peer) -> None:
    for number in range(20):
        send(peer, frame(number))
        begun_s = time.monotonic()
        assert peer.call("reset")[0].success
        time.sleep(max(0.0, 0.02 - (time.monotonic() - begun_s)))
    peer.wait(lambda: len(peer.answers()) == 20, "one answer to each frame")
    assert {one["state"] for one in peer.answers()} <= {"STARTED", "DISCARDED", "DROPPED", "REFUSED"}
    assert send_and_wait(peer, frame(100))["state"] == "STARTED"
    assert send_and_wait(peer, frame(101))["state"] == "TRACKING"


@pytest.fixture(scope="module")
def slow_node(start: Start, shared_node: NodeProcess, tmp_path_factory: pytest.TempPathFactory) -> NodeProcess:
    shared_node.stop()  # two nodes of the same name would both answer
    folder = tmp_path_factory.mktemp("output")
    node = start(*SLOW, *parameters(output_dir=folder, save_at_exit=True)).wait_until_ready()
    node.folder = folder  # type: ignore[attr-defined]
    return node


def test_reset_during_a_registration_answers_at_once_and_discards_its_result(
    slow_node: NodeProcess, peer: Peer
) -> None:
    peer.withdraw()
    for attempt in range(30):
        peer.call("reset")
        peer.clear()
        send_and_wait(peer, frame(0))
        send(peer, frame(1))
        time.sleep(0.02 * (1 + attempt % 10))  # until it has arrived and is being registered
        response, took_s = peer.call("reset")
        assert response.success
        answered_before = len(peer.answers()) > 1
        peer.wait_briefly(lambda: len(peer.answers()) == 2, 10.0)
        if not answered_before and len(peer.answers()) == 2 and peer.answers()[1]["state"] == "DISCARDED":
            assert [stamp_of(pose) for pose in peer.heard["pose"]] == [stamp_of_frame(0)]
            assert send_and_wait(peer, frame(2))["state"] == "STARTED"
            print(f"reset answered after {1e3 * took_s:.1f} ms while a registration ran")
            return
        # What was answered after the reset belongs to the session that the reset began.
        assert answered_before or peer.answers()[-1]["state"] in ("STARTED", "REFUSED")
    raise AssertionError("no registration ran long enough to be caught in the act")


def test_the_trajectory_is_saved_under_a_new_name_each_time(slow_node: NodeProcess, peer: Peer) -> None:
    peer.call("reset")
    peer.clear()
    assert send_and_wait(peer, frame(2))["state"] == "STARTED"
    paths = [Path(peer.call("save_trajectory")[0].message) for _ in range(2)]
    assert paths[0] != paths[1]
    lines = paths[0].read_text().splitlines()
    assert lines[0].startswith("# session")
    seconds, nanoseconds = divmod(stamp_of_frame(2), 10**9)
    assert lines[1].startswith(f"{seconds}.{nanoseconds:09d} 0.000000000 0.000000000")


@pytest.mark.hostile("System: SIGINT, SIGTERM")
def test_sigterm_during_a_registration_ends_in_time_and_saves(slow_node: NodeProcess, peer: Peer) -> None:
    before = len(list(slow_node.folder.iterdir()))  # type: ignore[attr-defined]
    send(peer, frame(4))
    time.sleep(0.1)
    code, took_s = slow_node.stop(signal.SIGTERM)
    assert code == 0
    assert "Traceback" not in slow_node.log
    assert len(list(slow_node.folder.iterdir())) == before + 1  # type: ignore[attr-defined]
    print(f"ended {took_s:.2f} s after SIGTERM during a registration")


@pytest.mark.hostile("System: SIGINT, SIGTERM")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("after", ["start", "loading", "ready: "])
def test_a_signal_at_any_moment_ends_the_node_with_exit_code_0(start: Start, number: int, after: str) -> None:
    node = start(*depth_arguments())
    if after == "start":
        node.wait_until_it_catches(number)
    else:
        node.wait_for(after)
    code, _ = node.stop(number)
    assert code == 0
    assert "Traceback" not in node.log
