# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg benchmark``: time per stage of a recording, beside what SIFT alone takes on the same images."""

from __future__ import annotations

import cProfile
import resource
import sys
from argparse import ArgumentParser, Namespace
from collections import defaultdict
from collections.abc import Iterable, Iterator
from contextlib import nullcontext, suppress
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import TopicChoice
from vigg_ros.bench.frame_cache import timed
from vigg_ros.bench.growth import GROWTH_REPEATS, INPUT_SIZES, draw_growth, measure
from vigg_ros.cli.bag_input import add_extrinsics_argument, add_topic_arguments, open_bag
from vigg_ros.cli.config_arguments import add_config_arguments
from vigg_ros.cli.console import ExitCode, Progress, UsageError, describe_machine, positive_int, table
from vigg_ros.pipeline import Pipeline
from vigg_ros.registration import Config, DataError, Frame
from vigg_ros.report.bag_messages import chosen_topics
from vigg_ros.sensors.input_decoder import InputDecoder, Role
from vigg_ros.tracking.assembly import SyncedFrame, SyncedMessages
from vigg_ros.tracking.frame_result import FrameResult
from vigg_ros.tracking.registrar import Registrar

WARM_UP_FRAMES = 3
"""Frames not counted: they compile, load and fill caches."""

MAX_PROFILED = 15
"""Functions that a profile names."""

DECODED_MESSAGES = 20
"""Messages of each topic that are decoded."""

SIFT_ALONE = "SIFT alone"

Times = dict[str, list[float]]
"""Milliseconds by name."""


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("bag", nargs="?", help="a recording of at least a few frames")
    parser.add_argument("--frames", type=positive_int, default=60, help="measured at most (default: %(default)s)")
    parser.add_argument("--profile", action="store_true", help="name the functions that take the most time themselves")
    parser.add_argument("--growth", action="store_true", help="instead of a bag: time and memory over the input's size")
    parser.add_argument("--plot", metavar="FILE", help="with --growth: a new picture")
    add_config_arguments(parser, default=None)
    add_extrinsics_argument(parser)
    add_topic_arguments(parser)


def run(arguments: Namespace) -> ExitCode:
    """Measure and print tables of medians and p95."""
    if arguments.growth:
        return run_growth(arguments.plot)
    if not arguments.bag:
        raise UsageError("nothing to measure: name a BAG, or give --growth")
    with open_bag(arguments.bag, arguments) as source:
        chosen = source.chosen
        config = chosen.config
        decoding = time_decoding(source.reader, source.choice, config)
        frames = list(islice(read_frames(source.pipeline(), source.messages()), arguments.frames + WARM_UP_FRAMES))
    if len(frames) <= WARM_UP_FRAMES:
        raise UsageError(f"{arguments.bag} gives {len(frames)} frames, expected more than {WARM_UP_FRAMES}")
    profile = cProfile.Profile() if arguments.profile else None
    stages = time_frames(frames, config, profile)
    machine = describe_machine()
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    for note in chosen.notes:
        print(f"note: {note}", file=sys.stderr)
    measured = len(frames) - WARM_UP_FRAMES
    print(f"{measured} frames; configuration {chosen.source}")
    print(f"{machine['cores']} cores of {machine['processor']}; peak {peak_mb:.0f} MB")
    print(table([("stage", "median ms", "p95 ms", "x SIFT"), *_rows(stages, float(np.median(stages[SIFT_ALONE])))]))
    if profile is not None:
        print()
        print(table([("function", "calls per frame", "own ms per frame"), *_hottest(profile, measured)]))
    print()
    print(table([("decoding", "median ms", "p95 ms"), *(row[:3] for row in _rows(decoding, 1.0))]))
    return ExitCode.OK


def read_frames(pipeline: Pipeline, messages: Iterable[tuple[Role, Any]]) -> Iterator[Frame]:
    """The frames that a replay would register."""
    received = (pipeline.receive(role, message).found for role, message in messages)
    for found in received:
        yield from _built(pipeline, found)
    yield from _built(pipeline, pipeline.remaining())


def _built(pipeline: Pipeline, found: Iterable[FrameResult | SyncedMessages]) -> Iterator[Frame]:
    for one in found:
        made = one if isinstance(one, FrameResult) else pipeline.build(one)
        if isinstance(made, SyncedFrame):
            yield made.frame


def run_growth(plot: str | None) -> ExitCode:
    """Print the table of time and memory over the size of the input, and draw it."""
    if plot is not None and Path(plot).exists():
        raise UsageError(f"{plot} exists; give a new file")
    with Progress("sizes", sum(map(len, INPUT_SIZES.values()))) as progress:
        rows = []
        for row in measure():
            rows.append(row)
            progress.step()
    machine, runs = describe_machine(), f"the least of {GROWTH_REPEATS} runs, each in a new process"
    print(f"{machine['cores']} cores of {machine['processor']}; {runs}")
    lines = ((row.what, str(row.size), f"{row.milliseconds:.1f}", f"{row.peak_mb:.0f}") for row in rows)
    print(table([("input", "size", "ms", "peak MB"), *lines]))
    if plot is not None:
        try:
            draw_growth(rows, Path(plot))
        except OSError as error:
            raise UsageError(f"{plot} cannot be written: {error}; give another file") from error
    return ExitCode.OK


def time_frames(frames: list[Frame], config: Config, profile: cProfile.Profile | None = None) -> Times:
    """Stages of each step after the warm-up, and SIFT alone on the same image in the same moment."""
    registrar = Registrar(config)
    stages: Times = defaultdict(list)
    with Progress("frames", len(frames)) as progress:
        for number, frame in enumerate(frames):
            grey = frame.image if frame.image.ndim == 2 else cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY)
            alone_ms = timed(partial(cv2.SIFT_create().detectAndCompute, grey, None))[1]
            with profile if profile is not None and number >= WARM_UP_FRAMES else nullcontext():
                result, total_ms = timed(partial(registrar.step, frame))
            progress.step()
            if number >= WARM_UP_FRAMES:
                for stage, ms in (*result.timings_ms.items(), ("whole step", total_ms), (SIFT_ALONE, alone_ms)):
                    stages[stage].append(ms)
    return stages


def time_decoding(reader: BagReader, choice: TopicChoice, config: Config) -> Times:
    """Message to observation, for each topic; messages that are refused are left out, as in a replay."""
    decoder = InputDecoder(config.input, choice.image.name)
    times: Times = defaultdict(list)
    for role, topic in chosen_topics(choice).items():
        for item in islice(reader.messages([topic.name], order="log"), DECODED_MESSAGES):
            with suppress(DataError):
                times[f"{topic.name} ({item.type})"].append(timed(partial(decoder.decode, role, item.message))[1])
    return times


def _hottest(profile: cProfile.Profile, frames: int) -> list[tuple[str, str, str]]:
    """The functions with the most time of their own: name and place, calls and milliseconds per frame."""
    rows = []
    for entry in sorted(profile.getstats(), key=lambda entry: -entry.inlinetime)[:MAX_PROFILED]:
        code = entry.code
        # Whole kernels show as their wrappers here; what is inside was compiled.
        place = "" if isinstance(code, str) else f" ({Path(code.co_filename).name}:{code.co_firstlineno})"
        name = f"{code if isinstance(code, str) else code.co_name}{place}"
        rows.append((name, f"{entry.callcount / frames:.1f}", f"{1e3 * entry.inlinetime / frames:.2f}"))
    return rows


def _rows(times: Times, unit_ms: float) -> list[tuple[str, str, str, str]]:
    rows = []
    for name, values in times.items():
        median = float(np.median(values))
        rows.append((name, f"{median:.2f}", f"{np.percentile(values, 95):.2f}", f"{median / unit_ms:.2f}"))
    return rows
