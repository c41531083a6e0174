# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg replay``: a bag in, a folder of results out; see docs/data.md, "What a replay leaves behind"."""

from __future__ import annotations

import shlex
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

from vigg_ros.cli.bag_input import add_bag_arguments, open_bag, read_truth
from vigg_ros.cli.config_arguments import ChosenConfig, add_config_arguments
from vigg_ros.cli.console import ExitCode, Progress, UsageError, add_examples, describe_machine, output_folder, say
from vigg_ros.report.accuracy import TrajectoryMetrics
from vigg_ros.report.bag_messages import chosen_topics
from vigg_ros.report.gallery import Gallery
from vigg_ros.report.page import write_report
from vigg_ros.report.recording import LEADING_MESSAGES, Recording, Replay, measure, truth_frame_note
from vigg_ros.report.replay_files import write_frames, write_json, write_result_bag, write_trajectory
from vigg_ros.report.wording import summary_table
from vigg_ros.tracking.frame_result import FrameResult, State

MIN_FRAMES = 2
"""Below these there is no motion to find."""


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of ``vigg replay``."""
    add_bag_arguments(parser)
    add_config_arguments(parser, default=None)
    parser.add_argument("-o", "--output", metavar="DIR", help="a new folder (default: vigg_replay_BAG_TIME)")
    parser.add_argument("--output-bag", action="store_true", help="also write the poses as a bag, for RViz or Foxglove")
    parser.add_argument("--ground-truth", metavar="FILE", help="poses in TUM format, instead of a topic")
    add_examples(
        parser,
        "vigg replay bags/street_lidar --output street",
        "vigg replay BAG --image-topic /left/image_raw --ground-truth truth.tum --set visual.detector=orb",
    )


def run(arguments: Namespace) -> ExitCode:
    """Replay, write, and say where; raises the package's errors for what cannot be replayed."""
    bag = Path(arguments.bag)
    output = output_folder(arguments.output, f"vigg_replay_{bag.stem}")
    truth = read_truth(Path(arguments.ground_truth)) if arguments.ground_truth else None
    with open_bag(arguments.bag, arguments) as source:
        pipeline, gallery = source.pipeline(), Gallery(source.chosen.config)
        replay = Replay(pipeline)
        leader = chosen_topics(source.choice)[pipeline.leader]
        results, interrupted = _collect(replay.run(source.messages()), gallery, leader.count)
        notes, damaged = source.notes(pipeline), source.reader.damaged
    recording = Recording(
        name=bag.name,
        frames=results,
        truth=replay.truth if truth is None else truth,
        refused=pipeline.refused,
        notes=notes,
        leaders=LEADING_MESSAGES[pipeline.leader],
    )
    if sum(result.state is not State.REFUSED for result in results) < MIN_FRAMES and not interrupted:
        return _nothing_paired(recording)
    _write(recording, gallery, source.chosen, output, with_bag=arguments.output_bag)
    if interrupted:
        return ExitCode.INTERRUPTED
    if len(recording.answered) < MIN_FRAMES:
        say(
            f"vigg replay: {len(recording.answered)} of {len(results)} {recording.leaders} got a pose, "
            f"fewer than the {MIN_FRAMES} of a motion; frames.csv and the report say why"
        )
        return ExitCode.NOTHING_PAIRED
    return ExitCode.PARTLY_READABLE if damaged else ExitCode.OK


def _collect(replayed: Iterator[FrameResult], gallery: Gallery, expected: int) -> tuple[list[FrameResult], bool]:
    """All results, or those until the user interrupted."""
    results: list[FrameResult] = []
    try:
        with Progress("frames", expected) as progress:
            for result in replayed:
                gallery.offer(result)
                results.append(result.kept())
                progress.step()
    except KeyboardInterrupt:
        return results, True
    return results, False


def _nothing_paired(recording: Recording) -> ExitCode:
    reasons = ", ".join(f"{code} {count}" for code, count in recording.refused.most_common())
    say(
        *_notes(recording),
        f"vigg replay: {len(recording.frames)} {recording.leaders}, but fewer than {MIN_FRAMES} frames could be made "
        f"of them (refused: {reasons or 'none'}); `vigg doctor` says what is missing",
    )
    return ExitCode.NOTHING_PAIRED


def _write(recording: Recording, gallery: Gallery, chosen: ChosenConfig, output: Path, *, with_bag: bool) -> None:
    metrics = measure(recording)
    run_info = {
        "command": shlex.join(["vigg", *sys.argv[1:]]),
        "configuration": chosen.source,
        "finished": datetime.now().astimezone().isoformat(timespec="seconds"),
        **describe_machine(),
    }
    try:
        output.mkdir(parents=True)
        write_trajectory(recording.frames, output / "trajectory.tum")
        write_frames(recording.frames, output / "frames.csv")
        write_json(_metrics(recording, metrics), output / "metrics.json")
        (output / "config.yaml").write_text(chosen.config.to_yaml(), encoding="utf-8")
        write_json(run_info, output / "run.json")
        write_report(recording, metrics, gallery, run_info, output / "report.html")
    except OSError as error:
        raise UsageError(f"{output} cannot be written: {error}; give another --output") from error
    if with_bag:
        write_result_bag(recording.frames, output / "results_bag")
    say(*_notes(recording))
    print(summary_table(recording, metrics, run_info))
    print(f"report: {output / 'report.html'}")


def _metrics(recording: Recording, metrics: TrajectoryMetrics | None) -> dict[str, Any]:
    """What metrics.json holds; without truth the coverage alone."""
    coverage = {
        "frames_received": len(recording.frames),
        "frames_answered": len(recording.answered),
        "coverage": recording.coverage,
        "refused": dict(recording.refused),
    }
    return coverage if metrics is None else coverage | metrics.as_dict()


def _notes(recording: Recording) -> list[str]:
    return [f"note: {note}" for note in (*recording.notes, truth_frame_note(recording)) if note]
