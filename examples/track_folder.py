#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tracks the frames of an RGB-D folder one by one, without bags and without ROS, and writes a TUM trajectory.

    python examples/track_folder.py FOLDER --output trajectory.tum

FOLDER is laid out as 7-Scenes is: frame-000000.color.png, frame-000000.depth.png, ... While tracking is LOST there is
no pose, and the reason is printed instead.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from vigg_ros.bench.datasets.convert import open_dataset
from vigg_ros.messages.tum_lines import tum_line
from vigg_ros.registration import Config, Frame
from vigg_ros.tracking import Registrar


def frames_of(folder: Path) -> Iterator[Frame]:
    """Each colour image with its depth image."""
    for found in open_dataset("7scenes", folder).frames():
        yield Frame.from_depth(found.image(), found.depth_m(), found.camera, stamp_ns=found.stamp_ns)


def main() -> None:
    """One step per frame, one line per pose."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--output", type=Path, default=Path("trajectory.tum"))
    arguments = parser.parse_args()
    registrar, lines, received = Registrar(Config.preset("rgbd")), [], 0
    for frame in frames_of(arguments.folder):
        result = registrar.step(frame)
        received += 1
        if result.T_odom_frame is None:
            print(f"{result.stamp_ns}: {result.state.value}, {result.reason}: {result.message}")
        else:
            lines.append(f"{tum_line(result.stamp_ns, result.T_odom_frame)}\n")
    arguments.output.write_text("".join(lines), encoding="utf-8")
    print(f"{len(lines)} of {received} frames got a pose: {arguments.output}")


if __name__ == "__main__":
    main()
