# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages come in the order in which the sensors looked, whatever the recorder's clock did."""

import random
import weakref
from dataclasses import replace
from pathlib import Path
from unittest.mock import MagicMock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vigg_ros.bags import ordering
from vigg_ros.bags.ordering import NEAR_MESSAGES, StampEntry, in_stamp_order, loop_numbers, stamp_order
from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.storage import Channel, RawMessage
from vigg_ros.registration.errors import BagError
from vigg_ros_testing.bag_samples import (
    COLOUR,
    DEPTH,
    START_NS,
    Entry,
    flip,
    noise_entries,
    rgbd_entries,
    storage_file,
    tf_static_entry,
    write_bag,
    write_ros1_bag,
)
from vigg_ros_testing.short_recordings import looped

LOG_ROW = pytest.mark.hostile("Bags: log time out of order: order by header stamp")
S = 1_000_000_000
CHANNEL = Channel("/a", "sensor_msgs/msg/Image", "cdr")


def series(stamps, topic: str = "/a") -> list[StampEntry]:
    return [StampEntry(topic, place, stamp) for place, stamp in enumerate(stamps)]


def raw_series(count: int) -> list[RawMessage]:
    return [RawMessage(CHANNEL, k, b"%d" % k) for k in range(count)]


LOG_TIMES = {
    "shuffled": lambda times_ns: random.Random(5).sample(times_ns, len(times_ns)),
    "backwards": lambda times_ns: [2 * START_NS - log_ns for log_ns in times_ns],
    "all the same": lambda times_ns: [START_NS] * len(times_ns),
    "all 0": lambda times_ns: [0] * len(times_ns),
    "clock steps back in the middle": lambda times_ns: [t - 10 * S * (at > 20) for at, t in enumerate(times_ns)],
    "topic after topic": lambda times_ns: [START_NS + at % 4 * S + at // 4 for at in range(len(times_ns))],
}


def with_log_times(entries: list[Entry], kind: str) -> list[Entry]:
    times_ns = LOG_TIMES[kind]([one.log_ns for one in entries])
    return [replace(one, log_ns=log_ns) for one, log_ns in zip(entries, times_ns, strict=True)]


@LOG_ROW
@pytest.mark.parametrize("written", ["mcap", "sqlite3", "ros1"])
@pytest.mark.parametrize("times", LOG_TIMES)
def test_messages_come_by_header_stamp(times: str, written: str, tmp_path: Path) -> None:
    # 60 frames are 2 s: more than a loop's least step back, and more than are held back in memory.
    entries = with_log_times(rgbd_entries(60), times)
    if written == "ros1":
        bag = write_ros1_bag(tmp_path / "old.bag", entries)
    else:
        bag = write_bag(tmp_path / "bag", entries, storage=written)
    with BagReader(bag) as reader:
        messages = list(reader.messages())
        assert not reader.damaged
    stamps = [(one.message.header.stamp.sec, one.message.header.stamp.nanosec) for one in messages]
    assert stamps == sorted(stamps)
    assert len(messages) == 4 * 60
    colours = [int(one.message.data[0]) for one in messages if one.topic == COLOUR]
    assert colours == list(range(60))


@LOG_ROW
def test_log_order_is_there_for_those_who_ask(tmp_path: Path) -> None:
    entries = [tf_static_entry(START_NS), *with_log_times(rgbd_entries(), "shuffled")]
    with BagReader(write_bag(tmp_path / "bag", entries)) as reader:
        assert next(reader.messages()).topic == "/tf_static"
        times = [one.log_ns for one in reader.messages(order="log")]
    assert times == sorted(one.log_ns for one in entries)


@LOG_ROW
def test_a_damaged_and_shuffled_bag_is_sorted_too(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", with_log_times(noise_entries(40), "shuffled"))
    file = storage_file(bag)
    flip(file, file.read_bytes().index(b"\x06", 8_000_000), count=1)  # somewhere in the pixels
    flip(file, -1)
    with BagReader(bag) as reader:
        stamps = [one.message.header.stamp.nanosec for one in reader.messages()]
        assert any("without its index" in note for note in reader.notes)
    assert len(stamps) == 40
    assert stamps == [(START_NS + k * 33_333_333) % S for k in np.arange(40).tolist()]


@given(st.permutations(range(100)))
def test_any_permutation_is_undone(stamps: list[int]) -> None:
    raws = raw_series(100)
    ordered = in_stamp_order(series(stamps), lambda: iter(raws))
    assert [stamps[int(raw.data)] for raw in ordered] == list(range(100))


@given(st.lists(st.one_of(st.none(), st.integers(0, 5 * S)), max_size=60))
def test_every_message_comes_once(stamps: list[int | None]) -> None:
    raws = raw_series(len(stamps))
    assert sorted(in_stamp_order(series(stamps), lambda: iter(raws)), key=lambda raw: raw.log_ns) == raws


@pytest.mark.parametrize(
    ("stamps", "order"),
    [
        ([5, 5, 3, 5, 3], [2, 4, 0, 1, 3]),  # equal ones as recorded
        # The first has none before it and comes first; the one recorded after 7 comes after 7.
        ([None, 7, None, 5], [0, 3, 1, 2]),
    ],
)
def test_the_order_by_hand(stamps: list[int | None], order: list[int]) -> None:
    assert stamp_order(series(stamps)).tolist() == order


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_loops_are_sorted_each_on_its_own(storage: str, tmp_path: Path) -> None:
    with BagReader(write_bag(tmp_path / "bag", looped(rgbd_entries(60), 3), storage=storage)) as reader:
        messages = list(reader.messages([COLOUR, DEPTH]))
    for topic in (COLOUR, DEPTH):
        values = [int(one.message.data[0]) for one in messages if one.topic == topic]
        assert values == values[:60] * 3


def test_a_loop_begins_with_the_first_topic_that_goes_back() -> None:
    stamps = [k * S for k in range(6)]
    entries = [*series(stamps, "/a"), *series(stamps, "/b")]
    entries.sort(key=lambda entry: (entry.stamp_ns, entry.topic != "/b"))
    assert loop_numbers(entries * 2).tolist() == [0] * 12 + [1] * 12


@pytest.mark.parametrize(
    ("stamps", "why"),
    [
        ([0, 1, 2, 3, 4, 5, 1, 6, 7], "one duplicate"),
        ([0, 1, 2, 3, 4, 5, 1, 2, 3, 6, 7], "a few duplicates"),
        ([5, 4, 3, 2, 1, 0], "new stamps, backwards"),
        ([0, 10, 1, 11, 2, 12, 3, 13], "disorder"),
        ([0, 1, 2, 3, 4, 5, 5, 5, 5, 5, 5, 5], "a stuck clock"),
        ([0, 0.1, 0.2, 0.3, 0.4, 0.5] * 2, "less than a second"),
    ],
)
def test_what_is_no_loop(stamps: list[float], why: str) -> None:
    assert not loop_numbers(series([round(stamp * S) for stamp in stamps])).any(), why


class WatchedMessage(RawMessage):
    """A raw message that knows how many of its kind exist."""

    now = most = 0

    def __init__(self, number: int) -> None:
        super().__init__(CHANNEL, number, b"%d" % number)
        WatchedMessage.now += 1
        WatchedMessage.most = max(WatchedMessage.most, WatchedMessage.now)
        weakref.finalize(self, self.gone)

    @classmethod
    def gone(cls) -> None:
        cls.now -= 1


@pytest.mark.parametrize("kind", ["near", "one far", "reversed", "random"])
def test_only_a_few_messages_are_held(kind: str) -> None:
    count = 2000
    stamps = {
        "near": [k + (NEAR_MESSAGES - 1) * (k % NEAR_MESSAGES == 0) for k in range(count)],
        "one far": [*range(10), 1500, *range(11, 1500), 10, *range(1501, count)],
        "reversed": list(range(count))[::-1],
        "random": random.Random(0).sample(range(count), count),
    }[kind]
    WatchedMessage.now = WatchedMessage.most = 0
    ordered = in_stamp_order(series(stamps), lambda: map(WatchedMessage, range(count)))
    assert [stamps[int(raw.data)] for raw in ordered] == sorted(stamps)
    assert WatchedMessage.most <= 2 * NEAR_MESSAGES + 2


@pytest.mark.parametrize("stamps", [range(100), range(100, 0, -1)])
@pytest.mark.parametrize("second", [50, 0])
def test_a_bag_that_shrinks_between_the_readings_is_an_error(stamps, second: int) -> None:
    with pytest.raises(BagError, match="changed while it was read"):
        list(in_stamp_order(series(stamps), lambda: iter(raw_series(second))))


def test_a_full_disk_is_an_error_that_names_the_place(monkeypatch) -> None:
    full = MagicMock()
    full.return_value.__enter__.return_value.write.side_effect = OSError(28, "No space left on device")
    monkeypatch.setattr(ordering.tempfile, "SpooledTemporaryFile", full)
    with pytest.raises(BagError, match=r"put aside in .*No space left"):
        list(in_stamp_order(series(range(100, 0, -1)), lambda: iter(raw_series(100))))
