# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Random damage to a recording, by seed: to its messages, or to the file that holds them."""

import random
from dataclasses import replace
from pathlib import Path

from vigg_ros_testing.short_recordings import Entry, write_entries


def damage_messages(entries: list[Entry], rng: random.Random) -> tuple[str, list[Entry]]:
    """Drop, double, reorder or corrupt some of the messages."""
    way = rng.choice(("drop", "double", "reorder", "flip in messages", "cut messages"))
    count = rng.randint(1, 5)
    if way == "reorder":
        times = [one.log_ns for one in entries]
        start = rng.randrange(len(times) - 1)
        part = times[start : start + rng.choice((4, 12, len(times)))]
        rng.shuffle(part)
        times[start : start + len(part)] = part
        moved = [replace(one, log_ns=log_ns) for one, log_ns in zip(entries, times, strict=True)]
        return way, sorted(moved, key=lambda one: one.log_ns)
    hit = set(rng.sample(range(len(entries)), count))
    if way == "drop":
        return way, [one for index, one in enumerate(entries) if index not in hit]
    if way == "double":
        return way, [one for index, one in enumerate(entries) for _ in range(1 + (index in hit))]
    corrupt = flipped if way == "flip in messages" else shortened
    return way, [corrupt(one, rng) if index in hit else one for index, one in enumerate(entries)]


def flipped(one: Entry, rng: random.Random) -> Entry:
    data = bytearray(one.data)
    for _ in range(rng.choice((1, 1, 20))):
        # Half of the flips hit the first bytes: stamps, sizes and encodings.
        data[rng.randrange(4, rng.choice((60, len(data))))] ^= 1 << rng.randrange(8)
    return replace(one, data=bytes(data))


def shortened(one: Entry, rng: random.Random) -> Entry:
    return replace(one, data=one.data[: rng.randrange(4, len(one.data))])


def damage_file(bag: Path, rng: random.Random) -> str:
    """Corrupt the file that holds the messages; sometimes metadata.yaml is missing as well."""
    (file,) = (path for path in bag.iterdir() if path.suffix in (".mcap", ".db3"))
    data = bytearray(file.read_bytes())
    way = rng.choice(("flip bytes", "flip bytes", "cut", "zero"))
    if way == "flip bytes":
        for _ in range(rng.choice((1, 5, 50))):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    elif way == "zero":
        start = rng.randrange(len(data))
        data[start : start + 4096] = bytes(len(data[start : start + 4096]))
    else:
        del data[rng.randrange(len(data)) :]
    file.write_bytes(data)
    if rng.random() < 0.5:
        (bag / "metadata.yaml").unlink()
        way += ", no metadata.yaml"
    return way


def damaged_bag(entries: list[Entry], path: Path, seed: int) -> tuple[Path, str]:
    """A bag of these messages with the damage of this seed, odd ones in the messages, even ones in the file."""
    rng = random.Random(seed)
    storage = rng.choice(("mcap", "sqlite3"))
    way = ""
    if seed % 2:
        way, entries = damage_messages(entries, rng)
    bag = write_entries(path, entries, storage)
    if not seed % 2:
        way = damage_file(bag, rng)
    return bag, f"seed {seed}: {way} ({storage})"
