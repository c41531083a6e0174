# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Render the bundled bags: python bags/render_bags.py [--into FOLDER] [room_rgbd] [street_lidar]

The same versions of NumPy and OpenCV give the same message bytes each time.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from driver_messages import compressed_depth, jpeg, lidar_cloud

from vigg_ros.bags.writer import BagWriter
from vigg_ros.bench.worlds import (
    STREET_DRIVE,
    HandheldLoop,
    ImageNoise,
    KinectNoise,
    LidarModel,
    render_depth,
    render_image,
    room,
    scan_lidar,
    stamps_ns,
    street,
)
from vigg_ros.bench.worlds.poses import T_BODY_OPTICAL, Pose, flat
from vigg_ros.messages.fields import Message
from vigg_ros.messages.pose_messages import encode_pose, encode_tf, encode_transform
from vigg_ros.messages.sensor_messages import encode_camera_info
from vigg_ros.registration.camera import Camera

START_NS = 1_772_013_245_123_456_789
"""An arbitrary instant in February 2026, with all its digits in use."""

MILLISECOND_NS = 1_000_000

ROOM_CAMERA = Camera(width_px=320, height_px=240, fx_px=277.0, fy_px=277.0, cx_px=159.5, cy_px=119.5)
ROOM_LOOP = HandheldLoop()

STREET_CAMERA = Camera(width_px=512, height_px=256, fx_px=320.0, fy_px=320.0, cx_px=255.5, cy_px=127.5)
STREET_LIDAR = LidarModel(beams=32, columns=400)
STREET_SCANS = 25
STREET_BEGIN_S = 1.55
"""When the bag begins in the drive: 2.7 m before the turn."""
T_BASE_LIDAR: Pose = flat((0.1, 0.0, 1.9), 2.0)
T_BASE_CAMERA: Pose = flat((0.7, 0.1, 1.5), -1.5) @ T_BODY_OPTICAL


class Entry(NamedTuple):
    """A message as it was received."""

    received_ns: int
    topic: str
    message: Message


def room_rgbd() -> Iterator[Entry]:
    """A handheld RGB-D camera (15 Hz) goes around a loop in a furnished room."""
    scene = room(seed=7)
    stamps = stamps_ns(round(15 * ROOM_LOOP.period_s) + 1, 15.0, START_NS)
    for index, stamp_ns in enumerate(stamps.tolist()):
        rng = np.random.default_rng((7, index))
        # Every seventh depth image is exposed a little later, as unsynchronised sensors do it.
        depth_ns = stamp_ns + (4_300_017 if index % 7 == 3 else 0)
        T_world_camera = ROOM_LOOP.T_world_camera((stamp_ns - START_NS) / 1e9)
        T_world_depth = ROOM_LOOP.T_world_camera((depth_ns - START_NS) / 1e9)
        image = _exposure(index).apply(render_image(scene, ROOM_CAMERA, T_world_camera), rng)
        depth_m = KinectNoise().apply(render_depth(scene, ROOM_CAMERA, T_world_depth), ROOM_CAMERA, rng)
        received_ns = stamp_ns + 21 * MILLISECOND_NS + int(rng.integers(3 * MILLISECOND_NS))
        at = {"stamp_ns": stamp_ns, "frame_id": "camera_color_optical_frame"}
        yield Entry(received_ns, "/camera/color/camera_info", encode_camera_info(ROOM_CAMERA, **at))
        yield Entry(received_ns, "/camera/color/image_raw/compressed", jpeg(image, quality=75, **at))
        yield Entry(
            received_ns + 5 * MILLISECOND_NS,
            "/camera/aligned_depth_to_color/image_raw/compressedDepth",
            compressed_depth(depth_m, **at | {"stamp_ns": depth_ns}),
        )
        yield _truth(stamp_ns, T_world_camera)


def street_lidar() -> Iterator[Entry]:
    """A car with a camera and a spinning LiDAR (10 Hz) goes straight, turns left, and goes straight."""
    scene = street(seed=3)
    yield Entry(START_NS, "/tf_static", _street_extrinsics())
    for index, stamp_ns in enumerate(stamps_ns(STREET_SCANS, 10.0, START_NS).tolist()):
        rng = np.random.default_rng((3, index))
        # Every fifth image is exposed a little after the beams point forward.
        image_ns = stamp_ns + (3_100_009 if index % 5 == 2 else 0)
        T_world_camera = _vehicle_at(image_ns) @ T_BASE_CAMERA
        image = _exposure(index).apply(render_image(scene, STREET_CAMERA, T_world_camera), rng)
        scan = scan_lidar(scene, _lidar_motion(stamp_ns), STREET_LIDAR, rng=rng)
        received_ns = stamp_ns + 52 * MILLISECOND_NS + int(rng.integers(3 * MILLISECOND_NS))
        at = {"stamp_ns": image_ns, "frame_id": "camera_optical_frame"}
        yield Entry(received_ns, "/camera/camera_info", encode_camera_info(STREET_CAMERA, **at))
        yield Entry(received_ns, "/camera/image_raw/compressed", jpeg(image, quality=72, **at))
        cloud = lidar_cloud(scan, grid_m=2**-7, stamp_ns=stamp_ns, frame_id="lidar")
        yield Entry(received_ns + 4 * MILLISECOND_NS, "/lidar/points", cloud)
        yield _truth(stamp_ns, _vehicle_at(stamp_ns) @ T_BASE_LIDAR)


def _exposure(index: int) -> ImageNoise:
    return ImageNoise(gain=1 + 0.06 * math.sin(index / 9), sigma=1.5)


def _truth(stamp_ns: int, T_world_frame: Pose) -> Entry:
    message = encode_pose(T_world_frame, stamp_ns=stamp_ns, frame_id="map")
    return Entry(stamp_ns + 20 * MILLISECOND_NS, "/ground_truth/pose", message)


def _vehicle_at(stamp_ns: int) -> Pose:
    return STREET_DRIVE.T_world_vehicle(STREET_BEGIN_S + (stamp_ns - START_NS) / 1e9)


def _lidar_motion(stamp_ns: int) -> Callable[[float], Pose]:
    return lambda time_s: _vehicle_at(stamp_ns + round(time_s * 1e9)) @ T_BASE_LIDAR


def _street_extrinsics() -> Message:
    mounts = (("lidar", T_BASE_LIDAR), ("camera_optical_frame", T_BASE_CAMERA))
    return encode_tf(
        [
            encode_transform(T_base_sensor, stamp_ns=START_NS, frame_id="base_link", child_frame_id=frame_id)
            for frame_id, T_base_sensor in mounts
        ]
    )


BAGS: dict[str, Callable[[], Iterator[Entry]]] = {"room_rgbd": room_rgbd, "street_lidar": street_lidar}


def write_bag(folder: Path, entries: Iterator[Entry]) -> None:
    """Write a new bag in the order of reception."""
    with BagWriter(folder, compression="chunk") as writer:
        for entry in sorted(entries, key=lambda entry: entry.received_ns):
            writer.write(entry.topic, entry.message, log_ns=entry.received_ns)


def main() -> int:
    """Render the bags that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(BAGS)}; default: all")
    parser.add_argument(
        "--into", type=Path, default=Path(__file__).parent, help="default: beside this script"
    )
    arguments = parser.parse_args()
    for name in arguments.names or BAGS:
        write_bag(arguments.into / name, BAGS[name]())
    return 0


if __name__ == "__main__":
    sys.exit(main())
