# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings with random damage through `vigg replay`: it ends as declared, and what is whole is not affected.

What "not affected" means: a frame is registered against a keyframe, and damage may have taken the keyframe
that the clean run used. So poses as such cannot be compared. But the registration is a function of the two
frames alone. Hence, wherever a frame of undamaged messages was answered against a keyframe of undamaged
messages, the answer is bit by bit that of registering these two frames of the clean recording, and the pose
is the keyframe's pose times the answer. Frames that were answered against a damaged keyframe are counted but
not compared: their row in frames.csv names that keyframe. Undamaged images without a pose have a reason.

VIGG_SEEDS sets the number of recordings; `pytest -s` shows what became of them.
"""

import csv
import hashlib
import os
import shutil
from collections import Counter, defaultdict
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from vigg_ros.bags.reader import BagReader
from vigg_ros.cli.console import ExitCode
from vigg_ros.cli.main import main
from vigg_ros.pipeline import Pipeline
from vigg_ros.registration.config import Config
from vigg_ros.registration.errors import DataError
from vigg_ros.registration.result import Registration
from vigg_ros.registration.vigg import extract, register
from vigg_ros.sensors.header import stamp_ns
from vigg_ros.tracking.assembly import SyncedFrame, SyncedMessages
from vigg_ros_testing.pipeline_runs import messages_of
from vigg_ros_testing.recording_damage import damaged_bag
from vigg_ros_testing.short_recordings import CHEAP, ROOM, short_entries, watch_replay, write_entries

SEEDS = int(os.environ.get("VIGG_SEEDS", "6"))
CONFIG = Config.preset("rgbd").replace(CHEAP)
SLOP_NS = round(CONFIG.pairing.sync_slop_s * 1e9)
DECLARED = {ExitCode.OK, ExitCode.USAGE, ExitCode.UNREADABLE, ExitCode.PARTLY_READABLE, ExitCode.NOTHING_PAIRED}
WROTE = {ExitCode.OK, ExitCode.PARTLY_READABLE}


class CleanRecording:
    """The frames of the clean bag, and the registration of any two of them."""

    def __init__(self, entries, bag):
        self.entries = entries
        self.prints = fingerprints(bag)
        self.frames = frames_of(bag)
        self.features = cache(lambda stamp: extract(self.frames[stamp], CONFIG))
        self.register = cache(lambda target, source: register(self.features(target), self.features(source), CONFIG))

    def holds(self, frame):
        """Whether the frame is one of the clean recording, bit by bit."""
        clean = self.frames.get(frame.stamp_ns)
        return (
            clean is not None
            and clean.camera == frame.camera
            and np.array_equal(clean.image, frame.image)
            and np.array_equal(clean.geometry.depth_m, frame.geometry.depth_m)
        )


def frames_of(bag):
    pipeline = Pipeline(CONFIG)
    messages = ((role, message) for role, message in messages_of(bag) if role != "ground_truth")
    found = [one for role, message in messages for one in pipeline.receive(role, message).found]
    built = [pipeline.build(one) for one in (*found, *pipeline.remaining()) if isinstance(one, SyncedMessages)]
    return {one.frame.stamp_ns: one.frame for one in built if isinstance(one, SyncedFrame)}


def fingerprints(bag):
    """What each topic holds at each stamp: hashes of everything that a frame is made of."""
    found = defaultdict(lambda: defaultdict(set))
    with BagReader(bag) as reader:
        for item in reader.messages(order="log"):
            try:
                stamp = stamp_ns(item.message.header.stamp)
            except (AttributeError, DataError):
                continue
            text = repr(item.message).encode() + bytes(getattr(item.message, "data", b""))
            found[item.topic][stamp].add(hashlib.sha256(text).hexdigest())
    return found


def undamaged(stamp, clean, prints):
    """Whether all that this frame is made of is in the recording as it was: image, depth, every calibration."""

    def near(held):
        return {other: hashes for other, hashes in held.items() if abs(other - stamp) <= SLOP_NS}

    for topic, held in clean.prints.items():
        now = prints.get(topic, {})
        if topic.endswith("camera_info"):
            if any(hashes != held.get(other) for other, hashes in now.items()) or stamp not in now:
                return False
        elif "pose" not in topic and near(held) != near(now):
            return False
    return True


def check(watched, bag, clean, how):
    """All that the head of this file promises; returns how many frames were compared, and how they fared."""
    counts = Counter({"replays": 1, f"exit {watched.exit_code}": 1})
    assert watched.exit_code in DECLARED, how
    assert watched.output.exists() == (watched.exit_code in WROTE), how
    if watched.exit_code not in WROTE:
        return counts
    prints = fingerprints(bag)
    intact = {stamp for stamp in clean.frames if undamaged(stamp, clean, prints)}
    with (watched.output / "frames.csv").open(newline="", encoding="utf-8") as file:
        rows = {int(row["stamp_ns"]): row for row in reversed(list(csv.DictReader(file)))}
    for stamp in intact:
        assert stamp in rows, f"{how}: {stamp} left no row"
        assert rows[stamp]["sigma_translation_m"] or rows[stamp]["reason"], f"{how}: {stamp} has no reason"
    keyframe_poses = {}
    for result in watched.steps:
        counts.update(compare(result, clean, intact, how))
        if result.T_odom_frame is not None:
            assert np.isfinite(result.T_odom_frame).all(), how
            keyframe_poses[result.session, result.stamp_ns] = result.T_odom_frame
            check_chain(result, keyframe_poses, how)
    return counts


def compare(result, clean, intact, how):
    if result.stamp_ns in intact:
        assert clean.holds(result.compared.frame), f"{how}: {result.stamp_ns} is another frame than when clean"
    if not clean.holds(result.compared.frame):
        return Counter({"frames that are damaged but decode": 1})
    if not isinstance(result.outcome, Registration):
        return Counter({"first frames" if result.outcome is None else "lost frames": 1})
    if not clean.holds(result.compared.keyframe.frame):
        return Counter({"frames on a damaged keyframe": 1})
    expected = clean.register(result.compared.keyframe.frame.stamp_ns, result.stamp_ns)
    assert isinstance(expected, Registration), f"{how}: {result.stamp_ns} is refused when clean"
    assert np.array_equal(expected.T_target_source, result.outcome.T_target_source), f"{how}: {result.stamp_ns}"
    return Counter({"frames equal to the clean ones": 1})


def check_chain(result, poses, how):
    """The pose is the keyframe's pose times the registration."""
    if result.compared.keyframe is None:
        assert np.array_equal(result.T_odom_frame, np.eye(4)), how
        return
    T_odom_keyframe = poses[result.session, result.compared.keyframe.frame.stamp_ns]
    expected = T_odom_keyframe @ result.outcome.T_target_source
    # Rounding only: each link is made orthonormal again.
    np.testing.assert_allclose(result.T_odom_frame, expected, atol=1e-12, err_msg=how)


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    entries = short_entries(ROOM, frames=6, every=4)
    return CleanRecording(entries, write_entries(tmp_path_factory.mktemp("clean") / "room", entries))


def check_doctor(doctor_code, replay_code, how):
    """The doctor ends as declared; it may miss what stands behind the few messages that it decodes, no more."""
    assert doctor_code in DECLARED - {ExitCode.USAGE}, how
    assert (doctor_code == ExitCode.UNREADABLE) == (replay_code == ExitCode.UNREADABLE), how
    return Counter({f"doctor {doctor_code}, replay {replay_code}": 1})


def test_the_undamaged_recording_is_equal_to_itself_and_one_bit_is_a_difference(clean, tmp_path, monkeypatch):
    bag = write_entries(tmp_path / "bag", clean.entries)
    watched = watch_replay(bag, tmp_path / "out", monkeypatch)
    assert watched.exit_code == ExitCode.OK
    # Were nothing compared, the test below would say nothing.
    equal = {"replays": 1, "exit 0": 1, "first frames": 1, "frames equal to the clean ones": 5}
    assert check(watched, bag, clean, "clean") == equal
    assert sum(record.new_keyframe for record in watched.records) > 1
    result = watched.steps[-1]
    T = result.outcome.T_target_source.copy()
    T[0, 3] = np.nextafter(T[0, 3], 1)
    with pytest.raises(AssertionError):
        compare(replace(result, outcome=replace(result.outcome, T_target_source=T)), clean, set(), "one bit off")


@pytest.mark.hostile(
    'Bags: flipped bits: keep what was read, exit 4 (sqlite3 can read "0 messages" without an error: '
    "compare message_count)"
)
@pytest.mark.hostile("Bags: log time out of order: order by header stamp")
def test_random_damage_ends_as_declared_and_spares_what_is_whole(clean, tmp_path, monkeypatch, capsys):
    total = Counter()
    for seed in range(SEEDS):
        bag, how = damaged_bag(clean.entries, tmp_path / f"bag_{seed}", seed)
        watched = watch_replay(bag, tmp_path / f"out_{seed}", monkeypatch)
        total += check(watched, bag, clean, how)
        total += check_doctor(main(["doctor", str(bag)]), watched.exit_code, how)
        shutil.rmtree(bag)
    said = capsys.readouterr()
    assert "Traceback" not in said.err + said.out
    print(dict(sorted(total.items())))
    assert total["frames equal to the clean ones"] > SEEDS
