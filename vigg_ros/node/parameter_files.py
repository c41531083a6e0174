# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameter files on the command line that say nothing to this node, which ROS passes over in silence."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import yaml

from vigg_ros.node.settings import unmatched_nodes


def notes_on_files(words: list[str], node_name: str) -> Iterator[str]:
    """A sentence for each --params-file none of whose sections is this node's."""
    for flag, path in pairwise(words):
        if flag == "--params-file":
            others = unmatched_nodes(_content(path), node_name)
            if others:
                yield (
                    f"{path}: found parameters of {', '.join(others)}, expected {node_name}; nothing of this file is "
                    f"used: name the section {node_name.strip('/')} or /**"
                )


def _content(path: str) -> object:
    """None for what this parser cannot read: rcl is less strict, and it is rcl that takes the parameters."""
    try:
        return yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError):
        return None
