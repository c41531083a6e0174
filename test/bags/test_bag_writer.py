# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is written is read back, is never written over something, and is the same each time."""

import sqlite3
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
import yaml
from rosbags import rosbag2
from rosbags.interfaces import QosDurability, QosHistory, QosReliability

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.writer import BagWriter
from vigg_ros.messages.diagnostic_messages import encode_diagnostic_array, encode_diagnostic_status
from vigg_ros.messages.fields import Message
from vigg_ros.messages.pose_messages import (
    encode_odometry,
    encode_path,
    encode_pose,
    encode_pose_with_covariance,
    encode_tf,
    encode_transform,
)
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image, encode_points
from vigg_ros.registration.errors import BagError
from vigg_ros_testing.bag_samples import CAMERA, START_NS
from vigg_ros_testing.real_messages import cdr

HEADER = {"stamp_ns": START_NS, "frame_id": "camera"}
STATUS = encode_diagnostic_status(1, "registrar", "lost", values={"inliers": 3})
SIX = np.arange(36.0).reshape(6, 6)

MESSAGES: dict[str, Message] = {
    "/image": encode_image(np.arange(48, dtype=np.uint8).reshape(4, 4, 3), **HEADER),
    "/depth": encode_image(np.arange(16, dtype=np.uint16).reshape(4, 4), **HEADER),
    "/depth_m": encode_image(np.arange(16, dtype=np.float32).reshape(4, 4), **HEADER),
    "/info": encode_camera_info(CAMERA, **HEADER),
    "/points": encode_points(np.eye(3), **HEADER),
    "/pose": encode_pose(np.eye(4), **HEADER),
    "/covariance": encode_pose_with_covariance(np.eye(4), SIX, **HEADER),
    "/odom": encode_odometry(np.eye(4), SIX, np.arange(6.0), SIX, **HEADER, child_frame_id="base"),
    "/path": encode_path([(START_NS, np.eye(4)), (START_NS + 1, np.eye(4))], **HEADER),
    "/tf_static": encode_tf([encode_transform(np.eye(4), **HEADER, child_frame_id="base")]),
    "/diagnostics": encode_diagnostic_array([STATUS], stamp_ns=START_NS),
    "/status": STATUS,
}
DISK_ROW = pytest.mark.hostile(
    "System: disk full, read-only folder, existing path, symlink: an error, never overwritten or deleted"
)

WAYS = [("mcap", name) for name in ("none", "chunk", "message", "file")]
WAYS += [("sqlite3", name) for name in ("none", "message", "file")]


def write(path: Path, **options: str) -> Path:
    with BagWriter(path, **options) as writer:
        for number, (topic, message) in enumerate(MESSAGES.items()):
            writer.write(topic, message, log_ns=START_NS + number)
    return path


@pytest.mark.parametrize(("storage", "compression"), WAYS)
def test_every_message_comes_back_as_it_was_and_the_bytes_are_the_same_each_time(
    storage: str, compression: str, tmp_path: Path
) -> None:
    bags = [write(tmp_path / at / "bag", storage=storage, compression=compression) for at in "ab"]
    with BagReader(bags[0]) as reader:
        read = [(one.topic, one.type, one.log_ns, one.data) for one in reader.serialised()]
        assert not reader.damaged
    assert read == [
        (topic, message.type, START_NS + number, cdr(message))
        for number, (topic, message) in enumerate(MESSAGES.items())
    ]
    first, second = ({file.name: file.read_bytes() for file in bag.iterdir()} for bag in bags)
    assert len(first) == 2
    assert first == second


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_the_metadata_is_what_ros2_jazzy_reads_and_tf_static_marked_as_latched(storage: str, tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", storage=storage)
    information = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert (information["version"], information["message_count"]) == (9, len(MESSAGES))
    assert information["starting_time"]["nanoseconds_since_epoch"] == START_NS
    with rosbag2.Reader(bag) as reader:
        profiles = {one.topic: one.ext.offered_qos_profiles for one in reader.connections}
    (latched,) = profiles.pop("/tf_static")
    assert (latched.durability, latched.reliability) == (QosDurability.TRANSIENT_LOCAL, QosReliability.RELIABLE)
    assert (latched.history, latched.depth) == (QosHistory.KEEP_LAST, 1)
    assert all(not others for others in profiles.values())
    with BagReader(bag) as ours:
        assert ours.latched() == {"/tf_static"}


@DISK_ROW
def test_an_existing_path_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    (tmp_path / "folder").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    for name in ("file", "folder", "link"):
        with pytest.raises(BagError, match="exists already and is not overwritten"):
            BagWriter(tmp_path / name)
    assert (tmp_path / "file").read_text() == "mine"
    assert list((tmp_path / "folder").iterdir()) == []
    assert (tmp_path / "link").is_symlink()
    assert not (tmp_path / "nowhere").exists()


def test_a_path_that_comes_into_being_meanwhile_or_is_in_no_folder_is_an_error(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    (tmp_path / "bag").mkdir()
    (tmp_path / "file").write_text("")
    for one in (writer, BagWriter(tmp_path / "file" / "bag")):
        with pytest.raises(BagError, match=r"bag cannot be written: .*give another path"):
            one.__enter__()


@DISK_ROW
@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), sqlite3.OperationalError("full")])
def test_a_full_disk_is_an_error_with_the_remedy(error, tmp_path: Path, monkeypatch) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        with monkeypatch.context() as patched:
            patched.setattr(writer._writer, "write", Mock(side_effect=error))
            with pytest.raises(BagError, match=r"cannot be written: .*free space"):
                writer.write("/pose", MESSAGES["/pose"], log_ns=1)
        writer.write("/pose", MESSAGES["/pose"], log_ns=1)


@pytest.mark.parametrize("fault", ["a full disk at the end", "an error in between"])
def test_a_bag_that_is_not_finished_looks_unfinished(fault: str, tmp_path: Path, monkeypatch) -> None:
    def write_and_fail() -> None:
        with BagWriter(tmp_path / "bag") as writer:
            writer.write("/pose", MESSAGES["/pose"], log_ns=1)
            if fault == "an error in between":
                raise KeyboardInterrupt
            monkeypatch.setattr(writer._writer, "close", Mock(side_effect=OSError(28, "No space left on device")))

    with pytest.raises((BagError, KeyboardInterrupt)) as caught:
        write_and_fail()
    assert isinstance(caught.value, KeyboardInterrupt) or "No space left" in str(caught.value)
    assert not (tmp_path / "bag" / "metadata.yaml").exists()


@pytest.mark.parametrize("name", ["a?b", "a#b", "a%20b"])
def test_sqlite_is_not_led_astray_by_its_own_addresses_and_has_no_chunks(name: str, tmp_path: Path) -> None:
    with pytest.raises(BagError, match="chunk needs the storage mcap"):
        BagWriter(tmp_path / "bag", storage="sqlite3", compression="chunk")
    with pytest.raises(BagError, match="use mcap"):
        BagWriter(tmp_path / name, storage="sqlite3")
    with BagReader(write(tmp_path / name)) as reader:
        assert len(list(reader.messages())) == len(MESSAGES)
