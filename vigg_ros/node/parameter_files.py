# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameter files on the command line that say nothing to this node, which ROS passes over in silence."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml


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


def unmatched_nodes(content: Any, node_name: str) -> list[str]:
    """The nodes that a parameter file speaks of, if none of them is ``node_name`` ("/ns/registrar"); else nothing."""
    if not isinstance(content, Mapping):
        return []
    named = [f"{prefix}/{key}".replace("//", "/").strip("/") for prefix, key in _node_keys(content)]
    if any(_matches(name, node_name.strip("/")) for name in named):
        return []
    return named


def _node_keys(content: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    for key, value in content.items():
        if isinstance(value, Mapping) and "ros__parameters" in value:
            yield prefix, str(key)
        elif isinstance(value, Mapping):
            yield from _node_keys(value, f"{prefix}/{key}")


def _matches(pattern: str, name: str) -> bool:
    """rcl's wildcards: * is one part of a name, ** any number of them."""
    wild = {"*": "/[^/]+", "**": "(/[^/]+)*"}
    return bool(re.fullmatch("".join(wild.get(part, f"/{re.escape(part)}") for part in pattern.split("/")), f"/{name}"))
