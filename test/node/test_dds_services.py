# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Topics and services of the node are those of docs/node.md; what the services do, and the signals that end it."""

import re
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from vigg_ros_testing.node_recordings import vector_of
from vigg_ros_testing.registrar_process import ROOT, depth_arguments, parameters
from vigg_ros_testing.rendered_frames import frame, send, send_and_wait, stamp_of_frame
from vigg_ros_testing.ros_peer import stamp_of

SLOW = parameters(
    geometry="depth", geometric__always=True, geometric__voxel_size_m=0.004, geometric__sample_k=50000,
    acceptance__candidates=50, local_match__iterations=20,
)  # fmt: skip
"""So that a registration of a small frame takes long enough to be interrupted."""

OF_EVERY_NODE = {"/rosout": "rcl_interfaces/Log", "/parameter_events": "rcl_interfaces/ParameterEvent"}


def documented(section):
    """Names of a table of docs/node.md with the two cells behind them."""
    page = (ROOT / "docs" / "node.md").read_text()
    (found,) = re.findall(rf"{section}\n\|---.*?\n((?:\|.*\n)+)", page)
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in found.splitlines()]
    return {row[0].strip("`"): (row[1], row[2]) for row in rows}


def full(name):
    """The name as the graph has it."""
    return name.replace("~", "/registrar") if name.startswith(("~", "/")) else f"/{name}"


def types_by_name(peer, role, node_name):
    """What a node publishes, subscribes to or offers as a service, as far as it is discovered."""
    found = getattr(peer.node, f"get_{role}_names_and_types_by_node")(node_name, "/")
    return {name: types[0].replace("/msg/", "/").replace("/srv/", "/") for name, types in found}


def test_published_topics_have_the_documented_types_and_qos(node, peer):
    table = documented(r"\| topic \| type \| QoS \| meaning \|")
    expected = {full(name): kind for name, (kind, _) in table.items() if name != "/tf"} | OF_EVERY_NODE
    peer.wait(lambda: types_by_name(peer, "publisher", "registrar") == expected, f"the topics {expected}")
    for name, (_, qos) in table.items():
        for info in peer.node.get_publishers_info_by_topic(full(name)):
            said = "best effort" if info.qos_profile.reliability.name == "BEST_EFFORT" else "reliable"
            said = "transient local" if info.qos_profile.durability.name == "TRANSIENT_LOCAL" else said
            assert qos.startswith(said)


def test_services_are_documented(node, peer):
    table = documented(r"\| service \| type \| what it does \|")
    expected = {full(name): kind for name, (kind, _) in table.items()}

    def offered():
        found = types_by_name(peer, "service", "registrar")
        return {name: kind for name, kind in found.items() if kind.startswith("std_srvs/")}

    peer.wait(lambda: offered() == expected, f"the services {expected}")


def test_subscribed_topics_are_documented(start, node, peer):
    table = documented(r"\| topic \| type \| notes \|")
    for name, (kinds, _) in table.items():
        if name != "points":
            kind = peer.wait(lambda n=name: types_by_name(peer, "subscriber", "registrar").get(full(n)), name)
            assert kind in kinds
    cloud = start(*parameters(extrinsics="0 0 0 0 0 0 1"), "-r", "__node:=cloud").wait_until_ready()
    peer.wait(lambda: "cloud" in peer.node.get_node_names(), "the other node")
    points = peer.wait(lambda: types_by_name(peer, "subscriber", "cloud").get("/points"), "a subscription of points")
    assert points == table["points"][0]
    assert "/depth/image" not in types_by_name(peer, "subscriber", "cloud")
    assert cloud.stop()[0] == 0


def test_reset_begins_a_new_session_at_the_origin(node, peer):
    first = send_and_wait(peer, frame(0))
    assert send_and_wait(peer, frame(3))["state"] == "TRACKING"
    response = peer.call("reset")
    assert response.success
    again = send_and_wait(peer, frame(1))
    assert (again["state"], again["stamp_ns"]) == ("STARTED", str(stamp_of_frame(1))), "stamps may begin anew too"
    assert int(again["session"]) > int(first["session"])
    peer.wait(lambda: len(peer.heard["pose"]) == 3, "three poses")
    np.testing.assert_array_equal(vector_of(peer.heard["pose"][-1]), [0, 0, 0, 0, 0, 0, 1])


def test_reset_takes_the_path_and_the_cloud_of_the_keyframe_away(node, peer):
    send_and_wait(peer, frame(0))
    peer.wait(lambda: any(cloud.width for cloud in peer.heard["keyframe_points"]), "the cloud of the first frame")
    peer.wait(lambda: any(path.poses for path in peer.heard["path"]), "a path")
    peer.call("reset")
    peer.wait(lambda: peer.heard["keyframe_points"][-1].width == 0, "a cloud without points", 5.0)
    peer.wait(lambda: not peer.heard["path"][-1].poses, "a path without poses", 5.0)
    cloud = peer.heard["keyframe_points"][-1]
    assert (cloud.header.frame_id, stamp_of(cloud)) == ("odom", stamp_of_frame(0))


def test_pause_lets_frames_pass_and_the_next_frame_is_a_keyframe_on_request(node, peer):
    send_and_wait(peer, frame(0))
    peer.call("pause", data=True)
    assert send_and_wait(peer, frame(1))["state"] == "PAUSED"
    response = peer.call("pause", data=False)
    assert response.message == "running"
    after = send_and_wait(peer, frame(2))
    assert (after["state"], after["keyframe"], after["new_keyframe"]) == ("TRACKING", "0", "False")
    peer.call("new_keyframe")
    assert send_and_wait(peer, frame(3))["new_keyframe"] == "True"
    assert send_and_wait(peer, frame(4))["keyframe"] == "1"
    assert [stamp_of(pose) for pose in peer.heard["pose"]] == [stamp_of_frame(number) for number in (0, 2, 3, 4)]


@pytest.mark.hostile("System: reset at 50 Hz")
def test_resets_at_50_hz_leave_the_node_well(node, peer):
    for number in range(20):
        send(peer, frame(number))
        begun_s = time.monotonic()
        assert peer.call("reset").success
        time.sleep(max(0.0, 0.02 - (time.monotonic() - begun_s)))
    peer.wait(lambda: len(peer.answers()) == 20, "one answer to each frame")
    assert {one["state"] for one in peer.answers()} <= {"STARTED", "DISCARDED", "DROPPED", "REFUSED"}
    assert send_and_wait(peer, frame(100))["state"] == "STARTED"
    assert send_and_wait(peer, frame(101))["state"] == "TRACKING"


@pytest.mark.hostile("System: SIGINT, SIGTERM")
def test_the_trajectory_is_saved_on_request_and_at_a_sigterm_during_a_registration(start, node, peer, tmp_path):
    refused = peer.call("save_trajectory")
    assert not refused.success
    assert "output_dir" in refused.message
    node.stop()  # two nodes of the same name would both answer
    peer.withdraw()
    slow_node = start(*SLOW, *parameters(output_dir=tmp_path, save_at_exit=True)).wait_until_ready()
    assert send_and_wait(peer, frame(2))["state"] == "STARTED"
    paths = [Path(peer.call("save_trajectory").message) for _ in range(2)]
    assert paths[0] != paths[1]
    title, line = paths[0].read_text().splitlines()
    assert title.startswith("# session")
    seconds, nanoseconds = divmod(stamp_of_frame(2), 10**9)
    assert line.startswith(f"{seconds}.{nanoseconds:09d} 0.000000000 0.000000000")
    send(peer, frame(4))
    time.sleep(0.1)
    code, took_s = slow_node.stop(signal.SIGTERM)
    assert code == 0
    assert "Traceback" not in slow_node.log
    assert len(list(tmp_path.iterdir())) == 3
    print(f"ended {took_s:.2f} s after SIGTERM during a registration")


@pytest.mark.hostile("System: SIGINT, SIGTERM")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("after", ["start", pytest.param("loading", marks=pytest.mark.slow)])
def test_a_signal_before_it_is_ready_ends_the_node_with_exit_code_0(start, number, after):
    node = start(*depth_arguments())
    if after == "start":
        node.wait_until_it_catches(number)
    else:
        node.wait_for(after)
    code, _ = node.stop(number)
    assert code == 0
    assert "Traceback" not in node.log
