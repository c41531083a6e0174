#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the motions from keyframe to frame differ from the truth, beside what their covariance says of them.

usage: python tools/motion_errors.py REPLAY_FOLDER TRUTH.tum
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bags.trajectories import read_stamped_poses
from vigg_ros.cli.bag_input import read_truth
from vigg_ros.registration.rigid import angle_rad, inverse
from vigg_ros.report.recording import true_trajectory
from vigg_ros.report.trajectory import interpolate

COLUMNS = ("error (m)", "sigma (m)", "error (deg)", "sigma (deg)")


def motions(replay: Path, truth: Path) -> NDArray[np.float64]:
    """COLUMNS (N, 4) of the frames that were tracked and whose truth is known, as is that of their keyframes."""
    found = {pose.stamp_ns: pose.T_world_sensor for pose in read_stamped_poses(replay / "trajectory.tum")}
    stamps_ns = np.array(sorted(found), np.int64)
    poses, known = interpolate(true_trajectory(read_truth(truth)), stamps_ns)
    true = dict(zip(stamps_ns[known].tolist(), poses.T_world_sensor, strict=True))
    out = []
    with (replay / "frames.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["state"] != "TRACKING":
                continue
            keyframe_ns, frame_ns = int(row["keyframe_stamp_ns"]), int(row["stamp_ns"])
            if keyframe_ns in true and frame_ns in true:
                T_true = inverse(true[keyframe_ns]) @ true[frame_ns]
                T_error = inverse(T_true) @ inverse(found[keyframe_ns]) @ found[frame_ns]
                error_m, error_deg = np.linalg.norm(T_error[:3, 3]), np.rad2deg(angle_rad(T_error[:3, :3]))
                out.append((error_m, float(row["motion_sigma_m"]), error_deg, float(row["motion_sigma_deg"])))
    return np.array(out).reshape(-1, 4)


def main() -> None:
    """Print medians, maxima, and the share beyond three standard deviations."""
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    found = motions(Path(sys.argv[1]), Path(sys.argv[2]))
    if not len(found):
        sys.exit("no tracked frame has a true pose")
    print(f"{len(found)} frames")
    for name, column in zip(COLUMNS, found.T, strict=True):
        print(f"{name:12} median {np.median(column):.4f}, max {column.max():.4f}")
    for name, error, sigma in (("translations", *found.T[:2]), ("rotations", *found.T[2:])):
        print(f"{name} beyond three standard deviations: {np.mean(error > 3 * sigma):.0%}")


if __name__ == "__main__":
    main()
