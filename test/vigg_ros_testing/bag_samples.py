# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Small bags with nothing wrong, written by rosbags itself; the tests break one thing at a time."""

import shutil
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from vigg_ros.bags.reader import BagReader
from vigg_ros.messages.fields import Message
from vigg_ros.messages.pose_messages import encode_pose, encode_tf, encode_transform
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image
from vigg_ros.registration.camera import Camera
from vigg_ros.sensors.colour_image import decode_image
from vigg_ros_testing.real_messages import ROS_2, cdr

STORE = ROS_2
START_NS = 1_700_000_000_123_456_789
PERIOD_NS = 33_333_333
LATENCY_NS = 7_000_000
FRAMES = 12
CAMERA = Camera(width_px=8, height_px=6, fx_px=7.0, fy_px=7.0, cx_px=3.5, cy_px=2.5)

COLOUR, INFO = "/camera/color/image_raw", "/camera/color/camera_info"
DEPTH, TRUTH = "/camera/aligned_depth_to_color/image_raw", "/ground_truth/pose"


@dataclass(frozen=True)
class Entry:
    """One message as a recorder gets it, and as it is in a bag."""

    topic: str
    type: str
    log_ns: int
    data: bytes


def entry(topic: str, message: Message, log_ns: int) -> Entry:
    return Entry(topic, message.type, log_ns, cdr(message))


def colour_pixels(number: int) -> np.ndarray:
    return np.full((6, 8, 3), number % 256, dtype=np.uint8)


def rgbd_entries(frames: int = FRAMES) -> list[Entry]:
    """Frame k is an image of the value k, a calibration, depth of 1000 + k mm, and a pose at x = k."""
    found = []
    for number in range(frames):
        stamp_ns = START_NS + number * PERIOD_NS
        header = {"stamp_ns": stamp_ns, "frame_id": "camera"}
        T = np.eye(4)
        T[0, 3] = number
        for topic, message in (
            (COLOUR, encode_image(colour_pixels(number), **header)),
            (INFO, encode_camera_info(CAMERA, **header)),
            (DEPTH, encode_image(np.full((6, 8), 1000 + number, np.uint16), **header)),
            (TRUTH, encode_pose(T, stamp_ns=stamp_ns, frame_id="map")),
        ):
            found.append(entry(topic, message, stamp_ns + LATENCY_NS))
    return found


def tf_static_entry(stamp_ns: int = START_NS) -> Entry:
    transform = encode_transform(np.eye(4), stamp_ns=stamp_ns, frame_id="a", child_frame_id="b")
    return entry("/tf_static", encode_tf([transform]), stamp_ns)


def write_bag(
    path: Path,
    entries: Iterable[Entry],
    *,
    storage: str = "mcap",
    compression: str = "NONE",
    topics: Iterable[tuple[str, str]] = (),
    definitions: dict[str, str] | None = None,
) -> Path:
    """A rosbag2 folder; ``topics`` are declared without messages, ``definitions`` replace a type's own."""
    writer = rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin[storage.upper()])
    writer.set_compression(rosbag2.CompressionMode[compression], rosbag2.CompressionFormat.ZSTD)
    connections = {}
    with writer:
        for topic, type_name in dict.fromkeys([*((one.topic, one.type) for one in entries), *topics]):
            own = (definitions or {}).get(type_name)
            connections[topic, type_name] = writer.add_connection(
                topic, type_name, typestore=STORE, msgdef=own, rihs01="RIHS01_0" if own else None
            )
        for one in entries:
            writer.write(connections[one.topic, one.type], one.log_ns, one.data)
    return path


def write_ros1_bag(path: Path, entries: Iterable[Entry], *, compress: bool = False) -> Path:
    """A ROS 1 .bag of the same messages."""
    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
    writer = rosbag1.Writer(path)
    if compress:
        writer.set_compression(rosbag1.Writer.CompressionFormat.LZ4)
    connections = {}
    with writer:
        for one in entries:
            if one.topic not in connections:
                connections[one.topic] = writer.add_connection(one.topic, one.type, typestore=store)
            writer.write(connections[one.topic], one.log_ns, STORE.cdr_to_ros1(one.data, one.type))
    return path


def write_split_bag(path: Path, entries: list[Entry], *, storage: str = "mcap", parts: int = 3) -> Path:
    """A bag in several files, with one metadata.yaml for all, as rosbag2 splits them."""
    path.mkdir()
    documents, size = [], len(entries) // parts
    for part in range(parts):
        last = part == parts - 1
        single = path.parent / f"{path.name}_{part}"
        write_bag(single, entries[part * size : None if last else (part + 1) * size], storage=storage)
        shutil.move(storage_file(single), path)
        documents.append(yaml.safe_load((single / "metadata.yaml").read_text()))
        shutil.rmtree(single)
    merged = documents[0]["rosbag2_bagfile_information"]
    others = [document["rosbag2_bagfile_information"] for document in documents[1:]]
    for other in others:
        merged["relative_file_paths"] += other["relative_file_paths"]
        merged["message_count"] += other["message_count"]
        for mine, theirs in zip(merged["topics_with_message_count"], other["topics_with_message_count"], strict=True):
            mine["message_count"] += theirs["message_count"]
    (path / "metadata.yaml").write_text(yaml.safe_dump(documents[0]))
    return path


def storage_file(bag: Path) -> Path:
    (found,) = (path for path in bag.iterdir() if path.name != "metadata.yaml")
    return found


def noise_entries(count: int, *, topic: str = COLOUR) -> list[Entry]:
    """Images of 270 kB that cannot be compressed, so that a bag of them has several chunks."""
    rng = np.random.default_rng(1)
    found = []
    for number in range(count):
        stamp_ns = START_NS + number * PERIOD_NS
        pixels = rng.integers(0, 256, (300, 300, 3), dtype=np.uint8)
        found.append(entry(topic, encode_image(pixels, stamp_ns=stamp_ns, frame_id="camera"), stamp_ns))
    return found


def flip(path: Path, position: int, count: int = 1) -> None:
    """Invert the bits of some bytes of a file; a negative position counts from its end."""
    data = bytearray(path.read_bytes())
    position %= len(data)
    for index in range(position, position + count):
        data[index] ^= 0xFF
    path.write_bytes(data)


def cut(path: Path, share: float) -> None:
    """Keep only the first part of a file."""
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])


def opened(path: Path) -> None:
    with BagReader(path):
        pass


def read(path: Path) -> tuple[list[int], BagReader]:
    """Header stamps of the colour images, and the reader after reading everything."""
    with BagReader(path) as reader:
        stamps = [decode_image(one.message).stamp_ns for one in reader.messages() if one.topic == COLOUR]
    return stamps, reader
