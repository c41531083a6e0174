# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Data set folders to bags, by the name of their layout."""

from __future__ import annotations

import inspect
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from vigg_ros.bags.writer import BagWriter, Compression
from vigg_ros.bench.datasets.dataset import Dataset
from vigg_ros.bench.datasets.dataset_messages import dataset_messages
from vigg_ros.bench.datasets.image_folder import open_image_folder
from vigg_ros.bench.datasets.kitti import open_kitti
from vigg_ros.bench.datasets.kitti_raw import open_kitti_raw
from vigg_ros.bench.datasets.rgbd_folder import open_rgbd_folder
from vigg_ros.bench.datasets.tum_folder import open_tum
from vigg_ros.registration import BagError

LAYOUTS: dict[str, Callable[..., Dataset]] = {
    "7scenes": open_rgbd_folder,
    "3dmatch": open_rgbd_folder,
    "scannet": open_rgbd_folder,
    "tum": open_tum,
    "images": open_image_folder,
    "kitti": open_kitti,
    "kitti-raw": open_kitti_raw,
}

Progress = Callable[[int, int], None]
"""Called with the number of messages done and of all."""


@dataclass(frozen=True, slots=True)
class ConvertSummary:
    """What a conversion wrote."""

    output: Path
    counts: dict[str, int]
    """Messages per topic."""
    duration_s: float
    """From the first stamp to the last."""
    notes: tuple[str, ...]
    """What a user should know: assumed intrinsics, missing poses, unreadable files."""


def open_dataset(layout: str, folder: Path | str, **options: Any) -> Dataset:
    """The data set in a folder of one of the LAYOUTS; options are those of its ``open_..`` function, None
    standing for their defaults.

    Raises BagError for an unknown layout, an option it does not have, and folders that do not fit.
    """
    if layout not in LAYOUTS:
        raise BagError(f"unknown layout {layout!r}; known ones: {', '.join(LAYOUTS)}")
    known = [name for name in inspect.signature(LAYOUTS[layout]).parameters if name != "folder"]
    options = {name: value for name, value in options.items() if value is not None}
    unknown = sorted(set(options) - set(known))
    if unknown:
        takes = f"takes {', '.join(known)}" if known else "takes no options"
        raise BagError(f"the layout {layout} has no option {', '.join(unknown)}; it {takes}")
    try:
        return LAYOUTS[layout](Path(folder), **options)
    except OSError as error:
        raise BagError(f"{folder} cannot be read: {error}") from error


def convert(
    layout: str,
    folder: Path | str,
    output: Path | str,
    *,
    storage: Literal["mcap", "sqlite3"] = "mcap",
    compression: Compression = "none",
    progress: Progress | None = None,
    **options: Any,
) -> ConvertSummary:
    """Write a data set folder as a new bag. Options are those of the layout, see ``open_dataset``.

    Raises BagError as ``open_dataset`` and ``BagWriter`` do. Single files that cannot be read are left
    out and noted.
    """
    writer = BagWriter(output, storage=storage, compression=compression)
    dataset = open_dataset(layout, folder, **options)
    with writer:
        return write_bag(dataset, writer, progress=progress)


def write_bag(dataset: Dataset, writer: BagWriter, *, progress: Progress | None = None) -> ConvertSummary:
    """Write the messages of a data set in the order of their stamps, one in memory at a time.

    Raises BagError when the bag cannot be written.
    """
    counts: Counter[str] = Counter()
    failures: list[str] = []
    messages = dataset_messages(dataset)
    for done, planned in enumerate(messages, 1):
        try:
            message = planned.make()
        except BagError as error:
            failures.append(str(error))
        else:
            writer.write(planned.topic, message, log_ns=planned.stamp_ns)
            counts[planned.topic] += 1
        if progress is not None:
            progress(done, len(messages))
    left_out = (f"{len(failures)} files were left out; the first: {failures[0]}",) if failures else ()
    duration_s = (messages[-1].stamp_ns - messages[0].stamp_ns) / 1e9
    return ConvertSummary(writer.path, dict(counts), duration_s, dataset.notes + left_out)
