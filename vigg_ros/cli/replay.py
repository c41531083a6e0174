# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg replay``: a bag in, a folder of results out; see DESIGN section 5."""

from __future__ import annotations

import shlex
import sys
from argparse import ArgumentParser, Namespace
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import TopicChoice, TopicRequest, choose_topics
from vigg_ros.bags.trajectories import read_stamped_poses
from vigg_ros.cli.config_arguments import ChosenConfig, add_config_arguments, choose_config
from vigg_ros.cli.console import ExitCode, Progress, UsageError, add_examples, describe_machine
from vigg_ros.registration.config import Config
from vigg_ros.registration.errors import BagError
from vigg_ros.registration.rigid import inverse
from vigg_ros.report.accuracy import TrajectoryMetrics
from vigg_ros.report.files import write_frames, write_json, write_trajectory
from vigg_ros.report.gallery import Gallery
from vigg_ros.report.ground_truth import measure, truth_frame_note
from vigg_ros.report.page import write_report
from vigg_ros.report.recording import COLOUR_IMAGES, SCANS, FrameRecord, Recording
from vigg_ros.report.replay import Replay
from vigg_ros.report.result_bag import write_result_bag
from vigg_ros.report.source import BagSource, read_extrinsics
from vigg_ros.report.summary_table import summary_table
from vigg_ros.sensors.observation import StampedPose
from vigg_ros.tracking.extrinsics import Lookup, fixed

TOPICS = ("image", "camera_info", "depth", "points", "ground_truth")

MIN_FRAMES = 2
"""Below these there is no motion to find."""


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of ``vigg replay``."""
    parser.add_argument("bag", help="a rosbag2 folder, a lone .mcap or .db3 file, or a ROS 1 .bag")
    add_config_arguments(parser, default=None)
    parser.add_argument("--output", metavar="DIR", help="a new folder (default: vigg_replay_BAG_TIME)")
    parser.add_argument("--output-bag", action="store_true", help="also write the poses as a bag, for RViz or Foxglove")
    parser.add_argument("--ground-truth", metavar="FILE", help="poses in TUM format, instead of a topic")
    add_extrinsics_argument(parser)
    add_topic_arguments(parser)
    add_examples(
        parser,
        "vigg replay bags/street_lidar --output street",
        "vigg replay BAG --image-topic /left/image_raw --ground-truth truth.tum --set visual.detector=orb",
    )


def add_extrinsics_argument(parser: ArgumentParser, use: str = "instead of /tf_static") -> None:
    """--extrinsics, with what it is good for."""
    parser.add_argument(
        "--extrinsics",
        type=float,
        nargs=7,
        metavar=("X", "Y", "Z", "QX", "QY", "QZ", "QW"),
        help=f"where the camera (optical frame) stands in the frame of the points, {use}",
    )


def add_topic_arguments(parser: ArgumentParser) -> None:
    """--image-topic and its siblings."""
    for name in TOPICS:
        option = f"--{name.replace('_', '-')}-topic"
        parser.add_argument(option, metavar="TOPIC", help="where several could be meant")


def requested_topics(arguments: Namespace) -> TopicRequest:
    """What --image-topic and its siblings ask for."""
    return TopicRequest(**{name: getattr(arguments, f"{name}_topic") for name in TOPICS})


def run(arguments: Namespace) -> ExitCode:
    """Replay, write, and say where; raises the package's errors for what cannot be replayed."""
    bag = Path(arguments.bag)
    output = _output_folder(arguments.output, bag)
    truth = read_truth(Path(arguments.ground_truth)) if arguments.ground_truth else None
    with BagReader(bag) as reader:
        choice = choose_topics(reader.topics, requested_topics(arguments), encodings=reader.encodings())
        chosen = choose_config(arguments, reader, choice)
        gallery = Gallery(chosen.config)
        extrinsics = None if choice.points is None else find_extrinsics(arguments.extrinsics, reader, choice)
        source = BagSource(reader, choice, chosen.config.input)
        replay = Replay(chosen.config, gallery.offer, extrinsics=extrinsics)
        leader = choice.image if choice.points is None else choice.points
        records, interrupted = _collect(replay, source, leader.count)
        notes = [*chosen.notes, *reader.notes, *choice.notes, *source.notes.values(), *map(str, reader.losses)]
        damaged = reader.damaged
    recording = Recording(
        name=bag.name,
        frames=records,
        truth=replay.truth if truth is None else truth,
        refused=source.refused + replay.refused,
        notes=notes,
        frame_id=replay.frame_id,
        leaders=COLOUR_IMAGES if choice.points is None else SCANS,
    )
    if sum(record.state != "REFUSED" for record in records) < MIN_FRAMES and not interrupted:
        _say_nothing_paired(recording)
        return ExitCode.NOTHING_PAIRED
    _write(recording, gallery, chosen, output, with_bag=arguments.output_bag)
    if interrupted:
        return ExitCode.INTERRUPTED
    if len(recording.answered) < MIN_FRAMES:
        _say_nothing_answered(recording)
        return ExitCode.NOTHING_PAIRED
    return ExitCode.PARTLY_READABLE if damaged else ExitCode.OK


def find_extrinsics(given: list[float] | None, reader: BagReader, choice: TopicChoice) -> Lookup:
    """Where the scan's points are in the camera's frame: as given, or by the bag. Raises UsageError."""
    if given is not None:
        return fixed(given_extrinsics(given))
    tree = read_extrinsics(reader, choice)
    if tree is None:
        raise UsageError(
            "the bag has no /tf_static that says where the camera stands; give it with --extrinsics X Y Z QX QY QZ QW"
        )
    return tree.lookup


def given_extrinsics(given: list[float]) -> NDArray[np.float64]:
    """T_camera_points (4, 4) of the seven numbers of --extrinsics. Raises UsageError."""
    x, y, z, *quaternion = given
    if not np.isfinite(given).all():
        raise UsageError(f"--extrinsics: found {given}, expected finite numbers")
    try:
        return inverse(pose_matrix((x, y, z), tuple(quaternion)))
    except ValueError as error:
        raise UsageError(f"--extrinsics: {error}") from error


def pose_matrix(position: tuple[float, ...], quaternion: tuple[float, ...]) -> NDArray[np.float64]:
    """T_parent_child (4, 4) of metres and a quaternion x y z w. Raises ValueError for a quaternion of norm 0."""
    T_parent_child = np.eye(4)
    T_parent_child[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
    T_parent_child[:3, 3] = position
    return T_parent_child


def read_truth(path: Path) -> list[StampedPose]:
    """The poses of a TUM file. Raises UsageError."""
    try:
        poses = read_stamped_poses(path)
    except (OSError, BagError) as error:
        raise UsageError(f"--ground-truth {path} cannot be read: {error}") from error
    return [StampedPose(pose.stamp_ns, "", "", pose.T_world_sensor) for pose in poses]


def _collect(replay: Replay, source: BagSource, expected: int) -> tuple[list[FrameRecord], bool]:
    """All records, or those until the user interrupted."""
    records: list[FrameRecord] = []
    try:
        with Progress("frames", expected) as progress:
            for record in replay.run(source):
                records.append(record)
                progress.step()
    except KeyboardInterrupt:
        return records, True
    return records, False


def _output_folder(asked: str | None, bag: Path) -> Path:
    name = asked or f"vigg_replay_{bag.stem}_{datetime.now():%Y%m%d_%H%M%S}"
    output = Path(name)
    if output.exists() or output.is_symlink():
        raise UsageError(f"{output} exists already and is not overwritten; give another --output")
    return output


def _say_nothing_paired(recording: Recording) -> None:
    reasons = ", ".join(f"{code} {count}" for code, count in recording.refused.most_common())
    _print_notes(recording)
    print(
        f"vigg replay: {len(recording.frames)} {recording.leaders}, but fewer than {MIN_FRAMES} frames could be made "
        f"of them (refused: {reasons or 'none'}); `vigg doctor` says what is missing",
        file=sys.stderr,
    )


def _say_nothing_answered(recording: Recording) -> None:
    print(
        f"vigg replay: {len(recording.answered)} of {len(recording.frames)} {recording.leaders} got a pose, "
        f"fewer than the {MIN_FRAMES} of a motion; frames.csv and the report say why",
        file=sys.stderr,
    )


def _write(
    recording: Recording, gallery: Gallery, chosen: ChosenConfig, output: Path, *, with_bag: bool
) -> None:
    metrics = measure(recording)
    run_info = {
        "command": shlex.join(["vigg", *sys.argv[1:]]),
        "configuration": chosen.source,
        "finished": datetime.now().astimezone().isoformat(timespec="seconds"),
        **describe_machine(),
    }
    try:
        output.mkdir(parents=True)
        _write_files(recording, metrics, chosen.config, run_info, output)
        write_report(recording, metrics, gallery, run_info, output / "report.html")
    except OSError as error:
        raise UsageError(f"{output} cannot be written: {error}; give another --output") from error
    if with_bag:
        write_result_bag(recording.frames, recording.frame_id, output / "results_bag")
    _print_notes(recording)
    print(summary_table(recording, metrics, configuration=chosen.source))
    print(f"report: {output / 'report.html'}")


def _write_files(
    recording: Recording,
    metrics: TrajectoryMetrics | None,
    config: Config,
    run_info: dict[str, object],
    output: Path,
) -> None:
    write_trajectory(recording.frames, output / "trajectory.tum")
    write_frames(recording.frames, output / "frames.csv")
    coverage = {
        "frames_received": len(recording.frames),
        "frames_answered": len(recording.answered),
        "coverage": recording.coverage,
        "refused": dict(recording.refused),
    }
    write_json(coverage | ({} if metrics is None else metrics.as_dict()), output / "metrics.json")
    (output / "config.yaml").write_text(config.to_yaml(), encoding="utf-8")
    write_json(run_info, output / "run.json")


def _print_notes(recording: Recording) -> None:
    for note in filter(None, [*recording.notes, truth_frame_note(recording)]):
        print(f"note: {note}", file=sys.stderr)
