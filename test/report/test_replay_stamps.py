# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stamps from message to file: zero, repeated, malformed, looping, and all nineteen digits."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from vigg_ros.bags.decoding import message_types
from vigg_ros.cli.console import ExitCode
from vigg_ros.pipeline import Pipeline
from vigg_ros.registration.config import Config
from vigg_ros.sensors.header import stamp_ns
from vigg_ros.sensors.input_decoder import InputDecoder
from vigg_ros.sensors.observation import Calibration
from vigg_ros_testing.pipeline_runs import messages_of
from vigg_ros_testing.short_recordings import CHEAP, ROOM, SECOND_NS, looped, short_entries, watch_replay, write_entries

CONFIG = Config.preset("rgbd").replace(CHEAP)
COLOUR, INFO = "/camera/color/image_raw/compressed", "/camera/color/camera_info"


@pytest.fixture(scope="module")
def entries():
    """Six frames over 1.3 s."""
    return short_entries(ROOM, frames=6, every=4)


@pytest.fixture
def watch(tmp_path, monkeypatch):
    """Replays a bag of these messages."""
    return lambda entries: watch_replay(write_entries(tmp_path / "bag", entries), tmp_path / "out", monkeypatch)


def stamp_of(one):
    return stamp_ns(message_types().deserialize_cdr(one.data, one.type).header.stamp)


def places_of(entries, topic):
    return [place for place, one in enumerate(entries) if one.topic == topic]


def of_the_frame_before(entries):
    return divmod(stamp_of(entries[places_of(entries, COLOUR)[2]]), SECOND_NS)


@pytest.mark.parametrize(
    ("stamp", "reason"),
    [
        pytest.param(lambda entries: (0, 0), "STAMP_ZERO", marks=pytest.mark.hostile("Stamps: 0 R")),
        pytest.param(of_the_frame_before, "STAMP_DUPLICATE", marks=pytest.mark.hostile("Stamps: duplicate R")),
        pytest.param(
            lambda entries: (1_700_000_000, 1_000_000_000),
            "STAMP_INVALID",
            marks=pytest.mark.hostile("Stamps: nanosec >= 1e9 or negative R"),
        ),
    ],
)
def test_an_image_with_a_bad_stamp_is_refused_and_the_others_are_answered(entries, watch, stamp, reason):
    changed, place = list(entries), places_of(entries, COLOUR)[3]
    # CDR: four bytes of encapsulation, seconds, nanoseconds.
    data, (sec, nanosec) = entries[place].data, stamp(entries)
    changed[place] = replace(
        entries[place], data=data[:4] + sec.to_bytes(4, "little") + nanosec.to_bytes(4, "little") + data[12:]
    )
    watched = watch(changed)
    assert watched.exit_code == ExitCode.OK
    assert [(one.state, one.reason) for one in watched.records if not one.has_pose] == [("REFUSED", reason)]
    assert sum(record.has_pose for record in watched.records) == 5
    assert {record.session for record in watched.records} == {0}


def test_frames_that_become_certain_together_are_registered_one_by_one(entries, tmp_path, monkeypatch):
    """All frames of a recording whose calibration comes last: their images are not held all at once."""
    decoder, bag = InputDecoder(CONFIG.input, COLOUR), write_entries(tmp_path / "bag", entries)
    decoded = [decoder.decode(role, message) for role, message in messages_of(bag) if role != "ground_truth"]
    calibration = next(one for one in decoded if isinstance(one, Calibration))
    pipeline, tracked = Pipeline(CONFIG), []
    track = pipeline.track
    monkeypatch.setattr(pipeline, "track", lambda synced: tracked.append(synced.frame.stamp_ns) or track(synced))
    images = (one for one in decoded if not isinstance(one, Calibration))
    assert [found for one in images for found in pipeline.pair(one).found] == []
    results = pipeline.finish(pipeline.pair(calibration).found)
    assert (next(results).state, len(tracked)) == ("STARTED", 1)
    assert [result.state for result in (*results, *pipeline.flush())] == ["TRACKING"] * 5


@pytest.mark.hostile("System: bag loop three times: the same result each time")
def test_each_loop_of_a_recording_gives_the_same_result(watch):
    # Ten frames over 2.4 s: several of them are more than a second older than the last, which tells a loop.
    watched = watch(looped(short_entries(ROOM, frames=10, every=4), 3))
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
def test_all_nineteen_digits_arrive_in_both_files(entries, watch):
    # A float64 keeps 2**53, about 16 digits: of these stamps it would lose the last two or three.
    stamps = [stamp_of(one) for one in entries if one.topic == COLOUR]
    assert all(len(str(stamp)) == 19 and int(float(stamp)) != stamp for stamp in stamps[1:4])
    output = watch(entries).output
    with (output / "frames.csv").open(newline="", encoding="utf-8") as file:
        assert [int(row["stamp_ns"]) for row in csv.DictReader(file)] == stamps
    lines = (output / "trajectory.tum").read_text().splitlines()
    written = [line.split()[0] for line in lines if not line.startswith("#")]
    assert [int(text.replace(".", "")) for text in written] == stamps


@pytest.mark.hostile("CameraInfo: changes mid-run: drop keyframes, N")
def test_a_change_of_the_calibration_starts_a_session_and_is_noted_once(entries, watch, capsys):
    store, changed = message_types(), list(entries)
    for place in places_of(entries, INFO)[2::2]:  # there and back, twice
        one = changed[place]
        message = store.deserialize_cdr(one.data, one.type)
        zoomed = replace(message, k=message.k * [1.1, 1, 1, 1, 1, 1, 1, 1, 1], p=np.zeros(12))
        changed[place] = replace(one, data=bytes(store.serialize_cdr(zoomed, one.type)))
    assert [record.session for record in watch(changed).records] == [0, 0, 1, 2, 3, 4]
    assert capsys.readouterr().err.count("found another calibration than before") == 1
