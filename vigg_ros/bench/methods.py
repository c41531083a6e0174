# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a method is, to be compared with others on the same pairs."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from vigg_ros.bench.frame_cache import FrameCache
from vigg_ros.bench.pairs import FramePair
from vigg_ros.registration import Config, ConfigError, Features, Frame

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Task:
    """One pair for one method."""

    pair: FramePair
    """The true motion in it is for the floor and for ablations that say so."""
    cache: FrameCache
    config: Config

    def features(self, config: Config, *, within_view: bool = False) -> tuple[Features, Features, float]:
        """Features of target and source by a configuration, and the milliseconds for both."""
        target, target_ms = self.cache.features(self.pair.target, config, within_view=within_view)
        source, source_ms = self.cache.features(self.pair.source, config, within_view=within_view)
        return target, source, target_ms + source_ms

    def derived(self, key: Hashable, make: Callable[[Frame], _T]) -> tuple[_T, _T, float]:
        """What is made of target and of source, and the milliseconds for both; ``key`` names it in the cache."""
        target, target_ms = self.cache.derived(self.pair.target, key, make)
        source, source_ms = self.cache.derived(self.pair.source, key, make)
        return target, source, target_ms + source_ms


@dataclass(frozen=True, slots=True)
class MethodAnswer:
    """A motion, or the reason why there is none."""

    T_target_source: NDArray[np.float64] | None
    reason: str
    timings_ms: Mapping[str, float]
    """By stage, the preparation of both frames included."""
    covariance: NDArray[np.float64] | None = None
    """(6, 6) of the motion, as Registration has it; None where the method claims none."""


@dataclass(frozen=True, slots=True)
class Method:
    """A way to register two frames."""

    name: str
    what: str
    """One line for the list."""
    answer: Callable[[Task], MethodAnswer]
    library: str = ""
    """The module it needs beyond those of the package."""
    sources: tuple[str, ...] = ("vigg_ros.registration", "vigg_ros.acceptance", "vigg_ros.bench.ablations")
    """The modules and packages that its answers depend on."""

    def fingerprint(self, config: Config) -> str:
        """Changes when the answers may: with the code, the configuration, or the library's version."""
        text = f"{self.name} {config.to_yaml()} {code_digest(self.sources)} {_version(self.library)}"
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def require(methods: Sequence[Method]) -> None:
    """Raise ConfigError when a library is missing that one of them needs."""
    missing = [method for method in methods if method.library and not _is_installed(method.library)]
    if missing:
        names = ", ".join(f"{method.name} (needs {method.library})" for method in missing)
        raise ConfigError(
            f"libraries are missing for {names}; install them with: pip install '.[evaluation]', "
            "or leave these methods out of --methods"
        )


def _is_installed(library: str) -> bool:
    return importlib.util.find_spec(library) is not None


def _version(library: str) -> str:
    if not library:
        return ""
    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:
        return "?"


@cache
def code_digest(sources: tuple[str, ...]) -> str:
    """A digest of the files of these modules, and of all in the packages among them."""
    digest = hashlib.sha256()
    for source in sources:
        path = Path(str(importlib.import_module(source).__file__))
        for file in sorted(path.parent.rglob("*.py")) if path.name == "__init__.py" else [path]:
            digest.update(file.read_bytes())
    return digest.hexdigest()
