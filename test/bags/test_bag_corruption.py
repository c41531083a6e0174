# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Random corruptions of each kind of bag: an error with words, or losses that are counted."""

import random
import shutil
from collections import Counter
from contextlib import nullcontext
from pathlib import Path

import pytest
from hypothesis import settings

from vigg_ros.bags.reader import BagReader
from vigg_ros.registration.errors import BagError
from vigg_ros_testing.bag_samples import (
    Entry,
    noise_entries,
    rgbd_entries,
    storage_file,
    tf_static_entry,
    write_bag,
    write_ros1_bag,
)
from vigg_ros_testing.message_samples import allocating_less_than

SEEDS = 2 * settings().max_examples

PEAK_BYTES = 48_000_000
"""The bags below hold 1.3 MB. A length that was believed would ask for gigabytes."""

KINDS = {
    "mcap": {"storage": "mcap"},
    "mcap zstd by chunk": {"storage": "mcap", "compression": "STORAGE"},
    "mcap zstd by file": {"storage": "mcap", "compression": "FILE"},
    "sqlite3": {"storage": "sqlite3"},
    "sqlite3 zstd by message": {"storage": "sqlite3", "compression": "MESSAGE"},
    "ROS 1": {},
}


def clean_entries() -> list[Entry]:
    return [tf_static_entry(), *rgbd_entries(), *noise_entries(5, topic="/noise")]


def make(kind: str, path: Path, entries: list[Entry]) -> Path:
    if kind == "ROS 1":
        return write_ros1_bag(path.with_suffix(".bag"), entries)
    return write_bag(path, entries, **KINDS[kind])


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("clean")
    return {kind: make(kind, folder / kind.replace(" ", "_"), clean_entries()) for kind in KINDS}


def corrupt(bag: Path, rng: random.Random) -> str:
    """Damage one file of the bag in one way, and say how."""
    files = sorted(bag.iterdir()) if bag.is_dir() else [bag]
    # Mostly the storage: metadata.yaml is small, and nearly any flip there is garbage.
    file = storage_file(bag) if bag.is_dir() and rng.random() < 0.8 else rng.choice(files)
    data = file.read_bytes()
    start = rng.randrange(len(data))
    # Heads and tails hold what readers look at first.
    start = rng.choice((start, start % 200, len(data) - 1 - start % 200))
    length = min(rng.choice((1, 8, 500, 100_000)), len(data) - start)
    before, part, after = data[:start], data[start : start + length], data[start + length :]
    ways = {
        "flip": bytes((part[0] ^ 1 << rng.randrange(8),)) + part[1:] + after,
        "zero": bytes(length) + after,
        "noise": rng.randbytes(length) + after,
        "drop": after,
        "double": 2 * part + after,
        "cut": b"",
    }
    way = rng.choice(list(ways))
    file.write_bytes(before + ways[way])
    return f"{way} {length} bytes at {start} of {file.name}"


def read_all(bag: Path) -> tuple[Counter[str], BagReader]:
    with BagReader(bag) as reader:
        reader.encodings()
        return Counter(one.topic for one in reader.messages()), reader


@pytest.mark.hostile(
    'Bags: flipped bits: keep what was read, exit 4 (sqlite3 can read "0 messages" without an error: '
    "compare message_count)"
)
@pytest.mark.parametrize("kind", KINDS)
def test_a_corrupted_bag_is_refused_or_its_losses_are_counted(kind: str, bags, tmp_path: Path) -> None:
    clean, _ = read_all(bags[kind])
    assert clean.total() == len(clean_entries())
    outcomes: Counter[str] = Counter()
    for seed in range(SEEDS):
        bag = tmp_path / bags[kind].name
        copy = shutil.copytree if bags[kind].is_dir() else shutil.copy
        copy(bags[kind], bag)
        how = f"seed {seed}: {corrupt(bag, random.Random(seed))}"
        with allocating_less_than(PEAK_BYTES) if seed % 10 == 0 else nullcontext():
            outcomes[outcome(bag, clean, how)] += 1
        shutil.rmtree(bag) if bag.is_dir() else bag.unlink()
    # Were they all refused, or all unharmed, this test would say nothing.
    assert {"read", "refused"} <= set(outcomes), outcomes


def outcome(bag: Path, clean: Counter[str], how: str) -> str:
    try:
        found, reader = read_all(bag)
    except BagError:
        return "refused"
    missing = clean - found
    # Of ROS 1 bags the index alone knows the counts: what a flip removes there, nobody misses.
    may_be_silent = reader.damaged or bag.suffix == ".bag"
    assert not missing or may_be_silent, f"{how}: {missing} missing in silence; {reader.notes}"
    return "partly read" if reader.damaged else "read"
