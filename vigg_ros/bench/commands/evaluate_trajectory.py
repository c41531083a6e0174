# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg evaluate trajectory``: ATE and RPE, with coverage and alignment beside them."""

from __future__ import annotations

import csv
import json
from argparse import ArgumentParser, Namespace
from pathlib import Path

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import GROUND_TRUTH_TYPES, TopicError
from vigg_ros.bags.trajectories import read_stamped_poses
from vigg_ros.bench.trajectory_comparison import TrajectoryComparison, compare_trajectories
from vigg_ros.cli.console import ExitCode, UsageError, positive_float, positive_int, table
from vigg_ros.registration import BagError
from vigg_ros.report.bag_messages import read_poses
from vigg_ros.report.recording import true_trajectory
from vigg_ros.report.trajectory import Trajectory
from vigg_ros.report.trajectory_errors import Spread

FRAMES_FILE = "frames.csv"
"""What a replay writes beside its trajectory: a row for each frame received."""


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("estimate", help="a TUM file (stamp x y z qx qy qz qw), or a bag with poses")
    parser.add_argument("reference", help="the truth: a TUM file, or a bag with poses")
    parser.add_argument("--topic", help="of the estimate's bag, where it holds several topics with poses")
    parser.add_argument("--reference-topic", metavar="TOPIC", help="of the reference's bag")
    parser.add_argument("--slop", type=positive_float, default=0.02, help="between stamps, in s (default: %(default)s)")
    parser.add_argument("--delta", type=positive_int, default=1, help="frames that RPE spans (default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", help="write the figures there too")


def run(arguments: Namespace) -> ExitCode:
    """Compare and print one table; no figure without its coverage and its alignment."""
    estimate = read_trajectory(Path(arguments.estimate), arguments.topic, "--topic")
    reference = read_trajectory(Path(arguments.reference), arguments.reference_topic, "--reference-topic")
    errors = compare_trajectories(estimate, reference, slop_s=arguments.slop, delta_frames=arguments.delta)
    received = frames_received(Path(arguments.estimate))
    print(coverage_line(errors, received))
    print(f"ATE after {errors.alignment}; RPE over {errors.rpe_over}, without alignment")
    rows = [
        ("", "median", "p95", "max", "rmse"),
        ("ATE (cm)", *_cells(errors.ate_m, 100)),
        (f"RPE (cm per {errors.rpe_over})", *_cells(errors.rpe_m, 100)),
        (f"RPE (deg per {errors.rpe_over})", *_cells(errors.rpe_deg, 1)),
    ]
    print(table(rows))
    if arguments.json:
        _write(errors, received, Path(arguments.json))
    return ExitCode.OK


def read_trajectory(path: Path, topic: str | None, option: str) -> Trajectory:
    """The poses of a TUM file, or of a topic of a bag. Raises BagError."""
    if path.is_file() and path.suffix in (".tum", ".txt", ".csv"):
        poses = read_stamped_poses(path)
        return Trajectory.of([pose.stamp_ns for pose in poses], [pose.T_world_sensor for pose in poses])
    if not path.exists():
        raise BagError(f"{path} does not exist; give a TUM file (.tum or .txt) or a bag")
    with BagReader(path) as reader:
        return true_trajectory(read_poses(reader, _pose_topic(reader, topic, option)))


def _pose_topic(reader: BagReader, name: str | None, option: str) -> str:
    """The topic with poses: the one named, or the only one."""
    names = sorted({topic.name for topic in reader.topics if topic.type in GROUND_TRUTH_TYPES and topic.count})
    if name is not None and name not in names:
        raise TopicError(f"{option} {name} has no poses; those of {reader.path} are: {', '.join(names) or 'none'}")
    if name is None and len(names) > 1:
        raise UsageError(f"{reader.path} has poses on {', '.join(names)}; choose one with {option}")
    if not names:
        raise TopicError(f"{reader.path} has no topic of {' or '.join(GROUND_TRUTH_TYPES)}")
    return name or names[0]


def frames_received(estimate: Path) -> int | None:
    """How many frames the replay received that wrote this trajectory; None if that is not beside it."""
    beside = estimate.parent / FRAMES_FILE
    if estimate.name != "trajectory.tum" or not beside.is_file():
        return None
    with beside.open(newline="", encoding="utf-8") as file:
        return sum(1 for _ in csv.DictReader(file))


def coverage_line(errors: TrajectoryComparison, received: int | None) -> str:
    """What the figures are about."""
    frames = "" if received is None else f" of {received} frames received"
    return (
        f"coverage: {errors.poses} poses{frames}, {errors.compared} of them compared; "
        f"they cover {errors.covered:.1%} of the reference's time"
    )


def _cells(spread: Spread, scale: float) -> list[str]:
    return [f"{scale * value:.3g}" for value in (spread.median, spread.p95, spread.maximum, spread.rmse)]


def _write(errors: TrajectoryComparison, received: int | None, path: Path) -> None:
    content = {"frames_received": received, **errors.as_dict()}
    try:
        path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise UsageError(f"--json {path} cannot be written: {error}") from error
