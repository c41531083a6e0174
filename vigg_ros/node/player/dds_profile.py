# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The Fast DDS profile of this package, without which large best-effort images are lost; see its own words."""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Iterator, MutableMapping
from importlib import metadata
from pathlib import Path

VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"
NAME = "config/fastdds_shm.xml"
SHARED_MEMORY = "/dev/shm"
NEEDED_MB = 128
"""For four processes. One that finds no room says so in red and sends by UDP; in Docker there are 64 MB by default."""


def set_profile(environment: MutableMapping[str, str] = os.environ) -> list[str]:
    """Have Fast DDS read the package's profile, unless a profile is set already; an empty value means: none.

    To be called before the first participant. Returns what the user should know: nothing, or why it was not set.
    """
    if VARIABLE in environment:
        if not environment[VARIABLE]:
            del environment[VARIABLE]  # Fast DDS would look for a file of this name
        return []
    path, free_mb = find_shared_file(NAME), _free_shared_mb()
    if path is None:
        return [f"{NAME} of this package was not found; large best-effort messages may be lost"]
    if free_mb < NEEDED_MB:
        return [
            f"{SHARED_MEMORY} has {free_mb:.0f} MB free, the Fast DDS profile for large messages needs {NEEDED_MB}: "
            "best-effort images may be lost (in Docker: --shm-size=512m)"
        ]
    environment[VARIABLE] = str(path)
    return []


def _free_shared_mb() -> float:
    try:
        return shutil.disk_usage(SHARED_MEMORY).free / 2**20
    except OSError:  # a system without it, for which Fast DDS has other ways
        return math.inf


def find_shared_file(name: str) -> Path | None:
    """A file such as config/rgbd.yaml: in the source tree, else where it was installed; None if nowhere."""
    return next((folder / name for folder in _share_folders() if (folder / name).is_file()), None)


def _share_folders() -> Iterator[Path]:
    beside = Path(__file__).parents[3]
    yield beside  # the source tree, and a development installation
    yield beside / "share" / "vigg_ros"  # pip install --target
    for prefix in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        yield Path(prefix) / "share" / "vigg_ros"
    try:
        # pip wrote down where it put each file, for --user and --prefix too.
        for file in metadata.files("vigg_ros") or ():
            if file.name == "package.xml":
                yield Path(str(file.locate())).resolve().parent
    except metadata.PackageNotFoundError:
        pass
