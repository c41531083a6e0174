# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which storage files make up a bag, and how many messages its metadata.yaml promises.

metadata.yaml is read here and not by rosbags, which lets UnicodeDecodeError escape and refuses the
whole bag when one of its files is missing. Format: rosbag2's ``BagMetadata``, versions 1 to 9.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import yaml

from vigg_ros.bags.losses import Ledger, in_one_line
from vigg_ros.registration.errors import BagError

_STORAGE_NAME = re.compile(r"\.(mcap|db3)(\.zstd)?$")
_METADATA_NAME = "metadata.yaml"
_METADATA_BYTES_MAX = 2**26


@dataclass(frozen=True, slots=True)
class BagFiles:
    """The files that hold the messages of one bag, in recording order."""

    paths: tuple[Path, ...]
    promised: Counter[str] | None
    """Messages per topic according to metadata.yaml; None without one."""


def find_files(path: Path, ledger: Ledger) -> BagFiles:
    """The storage files of the bag at this path: a folder, its metadata.yaml, or a lone storage file.

    Raises BagError when there is nothing to open or metadata.yaml is garbage.
    """
    if path.name == _METADATA_NAME and path.is_file():
        path = path.parent
    if not path.exists():
        raise BagError(f"{path} does not exist; give a bag folder or an .mcap, .db3 or .bag file")
    if path.is_dir():
        return _folder_files(path, ledger)
    if not _STORAGE_NAME.search(path.name) and path.suffix != ".bag":
        raise BagError(f"{path} is not a bag: expected a folder or a file named .mcap, .db3 or .bag")
    return BagFiles((path,), None)


def _folder_files(folder: Path, ledger: Ledger) -> BagFiles:
    present = sorted((file for file in folder.iterdir() if _STORAGE_NAME.search(file.name)), key=_natural_key)
    metadata_path = folder / _METADATA_NAME
    if metadata_path.exists():
        listed, promised = _read_metadata(metadata_path)
        return BagFiles(_listed_files(folder, listed, present, ledger), promised)
    if not present:
        raise BagError(_nothing_in(folder))
    ledger.note(f"{folder} has no {_METADATA_NAME} (recording not closed?); its storage files are read directly")
    return BagFiles(tuple(present), None)


def _nothing_in(folder: Path) -> str:
    ros1 = sorted(file.name for file in folder.glob("*.bag"))
    if ros1:
        return f"{folder} holds ROS 1 bags; give one of them: {', '.join(ros1)}"
    return f"{folder} is not a bag: it holds no {_METADATA_NAME} and no .mcap or .db3 file"


def _listed_files(folder: Path, listed: list[str], present: list[Path], ledger: Ledger) -> tuple[Path, ...]:
    """The files that metadata.yaml lists; if one is missing, the unlisted ones stand in (renamed bags)."""
    # Versions before 4 wrote paths that begin with the folder's name; only the last part counts.
    expected = [folder / PurePosixPath(name).name for name in listed]
    found = [path for path in expected if path.is_file()]
    if len(found) < len(expected) or not expected:
        missing = [path.name for path in expected if path not in found]
        spare = [path for path in present if path not in found]
        if missing:
            ledger.damage(f"{_METADATA_NAME} lists {', '.join(missing)}, which is not in {folder}")
        found += spare
    if not found:
        raise BagError(
            f"{folder} holds none of the storage files that its {_METADATA_NAME} lists "
            f"({', '.join(listed) or 'none'}); copy the bag again, with all its files"
        )
    return tuple(found)


def _read_metadata(path: Path) -> tuple[list[str], Counter[str]]:
    """Names of the storage files, and messages per topic."""
    try:
        if path.stat().st_size > _METADATA_BYTES_MAX:
            raise ValueError(f"larger than {_METADATA_BYTES_MAX} bytes")
        document = yaml.safe_load(path.read_bytes().decode())
        return _parse_metadata(document["rosbag2_bagfile_information"])
    except Exception as error:  # garbage makes a YAML parser fail in ways nobody lists
        raise BagError(
            f"{path} is not readable metadata ({in_one_line(error)}); "
            f"rebuild it with 'ros2 bag reindex', or give the storage file in {path.parent} itself"
        ) from error


def _parse_metadata(information: Mapping[str, Any]) -> tuple[list[str], Counter[str]]:
    promised: Counter[str] = Counter()
    for entry in information["topics_with_message_count"]:
        name, count = entry["topic_metadata"]["name"], entry["message_count"]
        if not isinstance(name, str) or not isinstance(count, int) or count < 0:
            raise ValueError(f"topic {name!r} with message_count {count!r}")
        promised[name] += count
    listed = information["relative_file_paths"]
    if not isinstance(listed, list) or not all(isinstance(name, str) for name in listed):
        raise ValueError(f"relative_file_paths {listed!r}")
    return listed, promised


def _natural_key(path: Path) -> list[tuple[int, str]]:
    """Orders bag_2 before bag_10."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", path.name)]
