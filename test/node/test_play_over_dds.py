# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg play`` over real DDS: what a subscriber gets is what the bag holds."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: source Jazzy, or pip install 'vigg_ros[ros]'")

from rclpy.serialization import serialize_message
from rosbags.rosbag1 import Writer as Ros1Writer
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image

from vigg_ros.bags.decoding import message_types
from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.writer import BagWriter
from vigg_ros.cli import node_command
from vigg_ros.cli.main import main
from vigg_ros.messages.pose_messages import encode_tf, encode_transform
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image
from vigg_ros.node.player.dds_profile import VARIABLE
from vigg_ros.registration.camera import Camera
from vigg_ros_testing.dds_listener import DOMAIN_ID, Listener, listening, wait_until

START_NS = 1_700_000_000_123_456_789
PERIOD_NS = 20_000_000
FRAMES = 25
CAMERA = Camera(width_px=8, height_px=6, fx_px=7.0, fy_px=7.0, cx_px=3.5, cy_px=2.5)
STAMPS_NS = [START_NS + k * PERIOD_NS for k in range(FRAMES)]
LATENCY_NS = 7_000_000
HAS_TF2 = find_spec("tf2_msgs") is not None


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Half a second of images of the value k, a calibration for each, and a static transform."""
    path = tmp_path_factory.mktemp("play") / "bag"
    with BagWriter(path) as writer:
        transform = encode_transform(np.eye(4), stamp_ns=START_NS, frame_id="a", child_frame_id="b")
        writer.write("/tf_static", encode_tf([transform]), log_ns=START_NS)
        for k, stamp_ns in enumerate(STAMPS_NS):
            header = {"stamp_ns": stamp_ns, "frame_id": "camera"}
            log_ns = stamp_ns + LATENCY_NS
            writer.write("/image", encode_image(np.full((6, 8, 3), k, np.uint8), **header), log_ns=log_ns)
            writer.write("/camera_info", encode_camera_info(CAMERA, **header), log_ns=log_ns)
    return path


@pytest.fixture(autouse=True)
def own_domain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN_ID))
    monkeypatch.setenv(VARIABLE, os.environ.get(VARIABLE, ""))  # the command sets it, and here it is taken back


@pytest.fixture
def listener() -> Iterator[Listener]:
    with listening() as listener:
        listener.subscribe(Image, "/image")
        yield listener


def complete(listener: Listener, count: int = FRAMES) -> bool:
    return wait_until(lambda: len(listener.received["/image"]) >= count)


def test_every_message_arrives_as_it_was_recorded(bag: Path, listener: Listener) -> None:
    listener.subscribe(CameraInfo, "/camera_info")
    assert main(["play", str(bag)]) == 0
    assert complete(listener)
    assert wait_until(lambda: len(listener.received["/camera_info"]) >= FRAMES)
    for topic, found in listener.received.items():
        with BagReader(bag) as reader:
            recorded = list(reader.serialised([topic]))
        arrived = [canonical(serialize_message(message), recorded[0].type) for message in found]
        assert arrived == [canonical(one.data, one.type) for one in recorded]


def canonical(data: bytes, kind: str) -> bytes:
    """CDR with zeros between the fields, where rclpy leaves what happened to lie there."""
    store = message_types()
    return bytes(store.serialize_cdr(store.deserialize_cdr(data, kind), kind))


def test_why_there_is_no_command_for_the_node_is_a_note(
    bag: Path, listener: Listener, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["play", str(bag)]) == 0
    shown = capsys.readouterr()
    assert "note: no command starts the node for this bag: found neither depth images" in shown.err
    (last,) = shown.out.splitlines()
    assert last == f"played {2 * FRAMES + HAS_TF2} messages, 0.0 MB, 0.5 s of the recording"


def test_the_first_line_is_the_bare_command_for_the_node(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(node_command.shutil, "which", lambda name: None)
    room = Path(__file__).parents[2] / "bags" / "room_rgbd"
    assert main(["play", str(room), "--wait", "0", "--duration", "0.2"]) == 0
    first = shlex.split(capsys.readouterr().out.splitlines()[0])
    assert first[:3] == ["registrar", "--ros-args", "-r"]
    assert "config:=rgbd" in first


def test_types_that_are_not_installed_are_left_out_with_one_note(
    bag: Path, listener: Listener, capsys: pytest.CaptureFixture[str]
) -> None:
    if HAS_TF2:
        pytest.skip("tf2_msgs is installed here, so that the transforms are played")
    assert main(["play", str(bag)]) == 0
    notes = [line for line in capsys.readouterr().err.splitlines() if "not installed" in line]
    assert len(notes) == 1
    assert notes[0].endswith("these message types are not installed here: tf2_msgs/msg/TFMessage (/tf_static)")


def test_now_moves_all_stamps_by_the_same_amount_to_the_present(bag: Path, listener: Listener) -> None:
    listener.subscribe(CameraInfo, "/camera_info")
    before_ns = time.time_ns()
    assert main(["play", str(bag), "--now"]) == 0
    assert complete(listener)
    assert wait_until(lambda: len(listener.received["/camera_info"]) >= FRAMES)
    images_ns, infos_ns = (listener.stamps_ns(topic) for topic in ("/image", "/camera_info"))
    assert images_ns == infos_ns
    assert [stamp_ns - images_ns[0] for stamp_ns in images_ns] == [stamp_ns - START_NS for stamp_ns in STAMPS_NS]
    assert before_ns <= images_ns[0] <= time.time_ns()


@pytest.mark.parametrize("moved", [False, True])
def test_a_loop_repeats_the_stamps_or_goes_on_with_new_ones(bag: Path, listener: Listener, moved: bool) -> None:
    assert main(["play", str(bag), "--loop", "3", "--rate", "4", *(["--now"] if moved else [])]) == 0
    assert complete(listener, 3 * FRAMES)
    stamps_ns = listener.stamps_ns("/image")
    if moved:
        assert stamps_ns == sorted(set(stamps_ns))
    else:
        assert stamps_ns == 3 * STAMPS_NS


def test_only_the_topics_and_the_time_asked_for_are_played(bag: Path, listener: Listener) -> None:
    listener.subscribe(CameraInfo, "/camera_info")
    start_s, length_s = 5 * PERIOD_NS / 1e9, 10 * PERIOD_NS / 1e9
    excerpt = ["--start", str(start_s), "--duration", str(length_s)]
    assert main(["play", str(bag), "--topics", "image", *excerpt]) == 0
    assert complete(listener, 11)
    assert listener.stamps_ns("/image") == STAMPS_NS[5:16]
    assert listener.received["/camera_info"] == []


def test_the_clock_runs_with_the_recording(bag: Path, listener: Listener) -> None:
    listener.subscribe(Clock, "/clock")
    assert main(["play", str(bag), "--clock", "--rate", "2", "--topics", "/image"]) == 0
    assert complete(listener)
    times = [message.clock for message in listener.received["/clock"]]
    times_ns = [time.sec * 10**9 + time.nanosec for time in times]
    assert times_ns == sorted(times_ns)
    assert times_ns[0] == START_NS + LATENCY_NS
    assert times_ns[-1] == STAMPS_NS[-1] + LATENCY_NS
    assert len(times_ns) > FRAMES, "it ticks between the messages too"


def test_a_bag_of_ros_1_is_played_as_ros_2(tmp_path: Path, listener: Listener) -> None:
    store, name = message_types(), "sensor_msgs/msg/Image"
    time_class, header_class = (store.types[kind] for kind in ("builtin_interfaces/msg/Time", "std_msgs/msg/Header"))
    with Ros1Writer(tmp_path / "old.bag") as writer:
        connection = writer.add_connection("/image", name, typestore=store)
        for k in range(3):
            header = header_class(stamp=time_class(sec=1_700_000_000 + k, nanosec=5), frame_id="camera")
            pixels = np.full(4, k, np.uint8)
            image = store.types[name](
                header=header, height=2, width=2, encoding="mono8", is_bigendian=0, step=2, data=pixels
            )
            writer.write(connection, 10**18 + k, store.cdr_to_ros1(store.serialize_cdr(image, name), name))
    assert main(["play", str(tmp_path / "old.bag")]) == 0
    assert complete(listener, 3)
    assert listener.stamps_ns("/image") == [(1_700_000_000 + k) * 10**9 + 5 for k in range(3)]
    assert [bytes(message.data) for message in listener.received["/image"]] == [bytes([k] * 4) for k in range(3)]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("ignored", [False, True], ids=["from a terminal", "started with & from a script"])
def test_signals_end_it_with_130_and_without_a_traceback(bag: Path, number: int, ignored: bool) -> None:
    command = [sys.executable, "-m", "vigg_ros.cli", "play", str(bag), "--loop", "--wait", "0"]
    command = ["sh", "-c", "trap '' INT; exec \"$@\"", "sh", *command] if ignored else command
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    assert "no command starts the node" in process.stderr.readline()
    process.send_signal(number)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert errors.splitlines()[-1] == "vigg play: interrupted"
    assert "Traceback" not in errors
