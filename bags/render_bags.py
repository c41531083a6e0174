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
import ros_messages as ros
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from vigg_ros.registration.camera import Camera
from vigg_ros.worlds import HandheldLoop, ImageNoise, KinectNoise, render_depth, render_image, room, stamps_ns

START_NS = 1_772_013_245_123_456_789
"""An arbitrary instant in February 2026, with all its digits in use."""

MILLISECOND_NS = 1_000_000


class Entry(NamedTuple):
    """A message as it was received."""

    received_ns: int
    topic: str
    message: ros.Message


def room_rgbd() -> Iterator[Entry]:
    """A handheld RGB-D camera (15 Hz) goes around a loop in a furnished room."""
    scene, path, noise = room(seed=7), HandheldLoop(), KinectNoise()
    camera = Camera(width_px=320, height_px=240, fx_px=277.0, fy_px=277.0, cx_px=159.5, cy_px=119.5)
    frame_id = "camera_color_optical_frame"
    stamps = stamps_ns(round(15 * path.period_s) + 1, 15.0, START_NS)
    for index, stamp_ns in enumerate(stamps.tolist()):
        rng = np.random.default_rng((7, index))
        # Every seventh depth image is exposed a little later, as unsynchronised sensors do it.
        depth_ns = stamp_ns + (4_300_017 if index % 7 == 3 else 0)
        T_world_camera = path.T_world_camera((stamp_ns - START_NS) / 1e9)
        T_world_depth = path.T_world_camera((depth_ns - START_NS) / 1e9)
        exposure = ImageNoise(gain=1 + 0.06 * math.sin(index / 9), sigma=1.5)
        image = exposure.apply(render_image(scene, camera, T_world_camera), rng)
        depth_m = noise.apply(render_depth(scene, camera, T_world_depth), camera, rng)
        received_ns = stamp_ns + 21 * MILLISECOND_NS + int(rng.integers(3 * MILLISECOND_NS))
        yield Entry(received_ns, "/camera/color/camera_info", ros.camera_info(stamp_ns, frame_id, camera))
        yield Entry(
            received_ns + 40_000,
            "/camera/color/image_raw/compressed",
            ros.jpeg(stamp_ns, frame_id, image, quality=75),
        )
        yield Entry(
            received_ns + 5 * MILLISECOND_NS,
            "/camera/aligned_depth_to_color/image_raw/compressedDepth",
            ros.compressed_depth(depth_ns, frame_id, depth_m),
        )
        yield Entry(received_ns, "/ground_truth/pose", ros.pose_stamped(stamp_ns, "map", T_world_camera))


BAGS: dict[str, Callable[[], Iterator[Entry]]] = {"room_rgbd": room_rgbd}


def write_bag(folder: Path, entries: Iterator[Entry]) -> None:
    """Write a new bag (MCAP, chunks compressed with zstd) in the order of reception."""
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    connections = {}
    with writer:
        for entry in sorted(entries, key=lambda entry: entry.received_ns):
            type_name = entry.message.__msgtype__
            if entry.topic not in connections:
                connections[entry.topic] = writer.add_connection(
                    entry.topic, type_name, typestore=ros.TYPESTORE
                )
            data = ros.TYPESTORE.serialize_cdr(entry.message, type_name)
            writer.write(connections[entry.topic], entry.received_ns, data)


def main() -> int:
    """Render the bags that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
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
