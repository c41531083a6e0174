# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stamps from message to file: zero, repeated, late, jumping back, looping, and all nineteen digits."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vigg_ros.bags.decoding import message_types
from vigg_ros.cli.console import ExitCode
from vigg_ros.pipeline import Pipeline
from vigg_ros.registration.config import Config
from vigg_ros.sensors.header import stamp_ns
from vigg_ros.sensors.input_decoder import InputDecoder
from vigg_ros.sensors.observation import Calibration, ColourImage, DepthImage, Observation
from vigg_ros.tracking.frame_result import FrameResult
from vigg_ros_testing.pipeline_runs import messages_of, run_observations
from vigg_ros_testing.short_recordings import (
    CHEAP,
    ROOM,
    SECOND_NS,
    Entry,
    looped,
    short_entries,
    watch_replay,
    write_entries,
)

CONFIG = Config.preset("rgbd").replace(CHEAP)
COLOUR, INFO = "/camera/color/image_raw/compressed", "/camera/color/camera_info"


@pytest.fixture(scope="module")
def entries() -> list[Entry]:
    """Six frames over 1.3 s."""
    return short_entries(ROOM, frames=6, every=4)


@pytest.fixture(scope="module")
def long_entries() -> list[Entry]:
    """Ten frames over 2.4 s: several of them are more than a second older than the last, which tells a loop."""
    return short_entries(ROOM, frames=10, every=4)


@pytest.fixture(scope="module")
def observations(entries: list[Entry], tmp_path_factory: pytest.TempPathFactory) -> list[Observation]:
    bag = write_entries(tmp_path_factory.mktemp("clean") / "room", entries)
    decoder = InputDecoder(CONFIG.input, COLOUR)
    return [decoder.decode(role, message) for role, message in messages_of(bag)]


def frames(observations: list[Observation], *numbers: int) -> list[Observation]:
    """The calibration, then colour and depth of these frames."""
    colours, depths = ([one for one in observations if isinstance(one, kind)] for kind in (ColourImage, DepthImage))
    calibration = next(one for one in observations if isinstance(one, Calibration))
    return [calibration, *(one for number in numbers for one in (colours[number], depths[number]))]


def run(observations: list[Observation]) -> list[FrameResult]:
    return run_observations(Pipeline(CONFIG), observations)


def with_stamp(one: Entry, stamp: int) -> Entry:
    """The message with another stamp in its header."""
    store = message_types()
    message = store.deserialize_cdr(one.data, one.type)
    time = store.types["builtin_interfaces/msg/Time"](*divmod(stamp, SECOND_NS))
    header = replace(message.header, stamp=time)
    return replace(one, data=bytes(store.serialize_cdr(replace(message, header=header), one.type)))


def stamp_of(one: Entry) -> int:
    return stamp_ns(message_types().deserialize_cdr(one.data, one.type).header.stamp)


def restamped(entries: list[Entry], topic: str, number: int, stamp: int) -> list[Entry]:
    """The recording with another stamp in the message of this number on this topic."""
    places = [place for place, one in enumerate(entries) if one.topic == topic]
    return [with_stamp(one, stamp) if place == places[number] else one for place, one in enumerate(entries)]


@pytest.mark.hostile("Stamps: 0 R")
def test_a_stamp_of_zero_is_refused_and_the_next_frame_works(entries, tmp_path: Path, monkeypatch) -> None:
    bag = write_entries(tmp_path / "bag", restamped(entries, COLOUR, 2, 0))
    watched = watch_replay(bag, tmp_path / "out", monkeypatch)
    refused = [record for record in watched.records if not record.has_pose]
    assert watched.exit_code == ExitCode.OK
    assert [(record.stamp_ns, record.state, record.reason) for record in refused] == [(0, "REFUSED", "STAMP_ZERO")]
    assert sum(record.has_pose for record in watched.records) == 5


@pytest.mark.hostile("Stamps: duplicate R")
def test_the_second_image_of_a_stamp_is_refused(entries, tmp_path: Path, monkeypatch) -> None:
    colours = [one for one in entries if one.topic == COLOUR]
    doubled = restamped(entries, COLOUR, 3, stamp_of(colours[2]))
    watched = watch_replay(write_entries(tmp_path / "bag", doubled), tmp_path / "out", monkeypatch)
    found = [(record.stamp_ns, record.reason) for record in watched.records if not record.has_pose]
    assert found == [(stamp_of(colours[2]), "STAMP_DUPLICATE")]
    assert {record.session for record in watched.records} == {0}


@pytest.mark.hostile("Stamps: back by less than 1 s R, by more: reset")
def test_a_stamp_that_is_a_little_late_is_refused(observations) -> None:
    # Frame 1 after frame 2: 0.27 s late, as from a second publisher. Replay sorts, so this feeds it unsorted.
    records = run(frames(observations, 0, 2, 1, 3))
    late = [(record.reason, record.session) for record in records if not record.has_pose]
    assert late == [("STAMP_LATE", 0)]
    assert [record.session for record in records if record.has_pose] == [0, 0, 0]


def test_a_depth_image_that_is_refused_is_counted_but_is_no_frame(observations) -> None:
    first, second = frames(observations, 0, 1)[1:3], frames(observations, 1)[1:]
    calibration = frames(observations)[0]
    pipeline = Pipeline(CONFIG)
    records = run_observations(pipeline, [calibration, *first, *second, second[1]])
    assert [record.state for record in records] == ["STARTED", "TRACKING"]
    assert pipeline.refused == {"STAMP_DUPLICATE": 1}


def test_frames_that_become_certain_together_are_registered_one_by_one(observations, monkeypatch) -> None:
    """All frames of a recording whose calibration comes last: their images are not held all at once."""
    calibration, *images = frames(observations, 0, 1, 2)
    pipeline, tracked = Pipeline(CONFIG), []
    track = pipeline.track
    monkeypatch.setattr(pipeline, "track", lambda synced: tracked.append(synced.frame.stamp_ns) or track(synced))
    run_before = [found for one in images for found in pipeline.pair(one).found]
    results = pipeline.finish(pipeline.pair(calibration).found)
    assert (run_before, next(results).state, len(tracked)) == ([], "STARTED", 1)
    assert [result.state for result in (*results, *pipeline.flush())] == ["TRACKING", "TRACKING"]


@pytest.mark.hostile("Stamps: back by less than 1 s R, by more: reset")
def test_a_jump_back_of_a_second_starts_a_new_session(observations) -> None:
    # Frames are 0.27 s apart: from 5 back to 0 it is 1.33 s.
    records = run(frames(observations, 3, 4, 5, 0, 1))
    assert [(record.session, record.state) for record in records] == [
        (0, "STARTED"), (0, "TRACKING"), (0, "TRACKING"), (1, "STARTED"), (1, "TRACKING"),
    ]  # fmt: skip
    np.testing.assert_array_equal(records[3].T_odom_frame, np.eye(4))


@pytest.mark.hostile("Stamps: long forward gap A")
def test_a_gap_of_an_hour_is_no_new_session(observations) -> None:
    later = [replace(one, stamp_ns=one.stamp_ns + 3600 * SECOND_NS) for one in frames(observations, 2, 3)[1:]]
    records = run([*frames(observations, 0, 1), *later])
    assert [(record.session, record.state) for record in records] == [(0, "STARTED"), *[(0, "TRACKING")] * 3]


@pytest.mark.hostile("Stamps: nanosec >= 1e9 or negative R")
def test_a_malformed_stamp_is_refused_and_the_others_are_answered(entries, tmp_path: Path, monkeypatch) -> None:
    places = [place for place, one in enumerate(entries) if one.topic == COLOUR]
    # CDR: four bytes of encapsulation, seconds, nanoseconds.
    broken = entries[places[2]]
    broken = replace(broken, data=broken.data[:8] + (1_000_000_000).to_bytes(4, "little") + broken.data[12:])
    changed = [broken if place == places[2] else one for place, one in enumerate(entries)]
    watched = watch_replay(write_entries(tmp_path / "bag", changed), tmp_path / "out", monkeypatch)
    assert [record.reason for record in watched.records if not record.has_pose] == ["STAMP_INVALID"]
    assert sum(record.has_pose for record in watched.records) == 5


@pytest.mark.hostile("System: bag loop three times: the same result each time")
def test_each_loop_of_a_recording_gives_the_same_result(long_entries, tmp_path: Path, monkeypatch) -> None:
    bag = write_entries(tmp_path / "bag", looped(long_entries, 3))
    watched = watch_replay(bag, tmp_path / "out", monkeypatch)
    loops = [[record for record in watched.records if record.session == session] for session in range(3)]
    assert watched.exit_code == ExitCode.OK
    assert [len(loop) for loop in loops] == [10, 10, 10]
    assert all(record.has_pose for record in watched.records)
    for other in loops[1:]:
        for first, again in zip(loops[0], other, strict=True):
            assert (first.stamp_ns, first.state, first.keyframe_id) == (again.stamp_ns, again.state, again.keyframe_id)
            np.testing.assert_array_equal(first.T_odom_frame, again.T_odom_frame)
            np.testing.assert_array_equal(first.covariance, again.covariance)
    nothing, *parts = (watched.output / "trajectory.tum").read_text().split("# session ")
    titles, texts = zip(*(part.split("\n", 1) for part in parts), strict=True)
    assert (nothing, titles) == ("", ("0", "1", "2"))
    assert texts[0] == texts[1] == texts[2]


@pytest.mark.hostile("Stamps: 19-digit nanoseconds kept exactly from message to file")
def test_all_nineteen_digits_arrive_in_both_files(entries, tmp_path: Path, monkeypatch) -> None:
    # A float64 keeps 2**53, about 16 digits: of these stamps it would lose the last two or three.
    stamps = [stamp_of(one) for one in entries if one.topic == COLOUR]
    assert all(len(str(stamp)) == 19 and int(float(stamp)) != stamp for stamp in stamps[1:4])
    watched = watch_replay(write_entries(tmp_path / "bag", entries), tmp_path / "out", monkeypatch)
    with (watched.output / "frames.csv").open(newline="", encoding="utf-8") as file:
        assert [int(row["stamp_ns"]) for row in csv.DictReader(file)] == stamps
    lines = (watched.output / "trajectory.tum").read_text().splitlines()
    written = [line.split()[0] for line in lines if not line.startswith("#")]
    assert [int(text.replace(".", "")) for text in written] == stamps


@pytest.mark.hostile("CameraInfo: changes mid-run: drop keyframes, N")
def test_another_calibration_starts_a_new_session(observations) -> None:
    calibration, *rest = frames(observations, 0, 1, 2, 3)
    zoomed = replace(calibration, camera=replace(calibration.camera, fx_px=300.0, fy_px=300.0))
    records = run([calibration, *rest[:4], zoomed, *rest[4:]])
    assert [(record.session, record.state) for record in records] == [
        (0, "STARTED"), (0, "TRACKING"), (1, "STARTED"), (1, "TRACKING"),
    ]  # fmt: skip


@pytest.mark.hostile("CameraInfo: changes mid-run: drop keyframes, N")
def test_a_change_of_the_calibration_is_noted_once(entries, tmp_path: Path, monkeypatch, capsys) -> None:
    store, changed, places = message_types(), list(entries), [i for i, one in enumerate(entries) if one.topic == INFO]
    for place in places[2::2]:  # there and back, twice
        one = changed[place]
        message = store.deserialize_cdr(one.data, one.type)
        zoomed = replace(message, k=message.k * [1.1, 1, 1, 1, 1, 1, 1, 1, 1], p=np.zeros(12))
        changed[place] = replace(one, data=bytes(store.serialize_cdr(zoomed, one.type)))
    watched = watch_replay(write_entries(tmp_path / "bag", changed), tmp_path / "out", monkeypatch)
    assert [record.session for record in watched.records] == [0, 0, 1, 2, 3, 4]
    assert capsys.readouterr().err.count("found another calibration than before") == 1
