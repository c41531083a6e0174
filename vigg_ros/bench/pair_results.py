# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What each method answered to each pair: kept in a file as it comes, so that a run can be taken up again."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import IO, Any

from vigg_ros.registration import BagError

RESULTS_FILE = "pairs.jsonl"

_UNKNOWN = {"rotation_error_deg": math.inf, "translation_error_m": math.inf, "overlap": math.nan, "nees": math.nan}
"""What null stands for in the file."""


@dataclass(frozen=True, slots=True)
class Limits:
    """From which errors on an answer does not count; the paper's."""

    accuracy_deg: tuple[float, ...]
    accuracy_m: tuple[float, ...]
    recall_deg: float
    recall_m: float


INDOOR_LIMITS = Limits((2.0, 5.0, 10.0), (0.05, 0.10, 0.25), 15.0, 0.30)
OUTDOOR_LIMITS = Limits((0.25, 0.5, 1.0), (0.075, 0.15, 0.30), 5.0, 0.60)


@dataclass(frozen=True, slots=True)
class PairResult:
    """One pair: what was answered, and how far it is from the truth."""

    method: str
    group: str
    """The gap in frames, or the kind of scene."""
    target: str
    source: str
    reason: str
    """Of the rejection, or the code of a frame that could not be used; empty for an answer."""
    rotation_error_deg: float
    """RE; inf without an answer."""
    translation_error_m: float
    """TE; inf without an answer."""
    overlap: float
    """Share of the surface that both frames see; NaN where it is not known."""
    nees: float
    """The error, squared, in units of the covariance claimed: see ``reliability.nees``; NaN where there is none."""
    timings_ms: Mapping[str, float]
    """By stage, the extraction of both frames' features included; empty if a frame could not be used."""

    @property
    def is_answered(self) -> bool:
        return not self.reason

    def is_right(self, limits: Limits) -> bool:
        """Whether the answer counts for the recall."""
        return self.rotation_error_deg < limits.recall_deg and self.translation_error_m < limits.recall_m

    def is_wrong(self, limits: Limits) -> bool:
        """Whether it is an answer that does not count."""
        return self.is_answered and not self.is_right(limits)

    @property
    def total_ms(self) -> float:
        return sum(self.timings_ms.values())


class ResultFile:
    """A file of results that only grows.

    Each line is keyed by what made it, so that what was measured with other code or options is left alone.
    """

    def __init__(self, results: dict[str, PairResult], file: IO[str]) -> None:
        self._results, self._file = results, file

    @classmethod
    @contextmanager
    def open(cls, path: Path) -> Iterator[ResultFile]:
        """What is in the file, for the with block. Raises BagError."""
        results = _read(path)
        try:
            file = path.open("a", encoding="utf-8")
        except OSError as error:
            raise BagError(f"{path} cannot be written: {error}") from error
        with file:
            if file.tell():
                file.write("\n")  # ends a line that was cut when the last run was stopped
            yield cls(results, file)

    def get(self, key: str) -> PairResult | None:
        """The result under this key, if it is there already."""
        return self._results.get(key)

    def add(self, key: str, result: PairResult) -> None:
        """Append one result; it is on disk when this returns."""
        self._results[key] = result
        self._file.write(json.dumps({"key": key, **nulled(asdict(result))}) + "\n")
        self._file.flush()


def _read(path: Path) -> dict[str, PairResult]:
    """The results in a file; lines that are none, cut short by an interruption, are left out."""
    found = {}
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    for line in lines:
        try:
            row = json.loads(line)
            key = row.pop("key")
            found[key] = _result(row)
        except (ValueError, KeyError, TypeError, AttributeError):
            continue
    return found


def _result(row: dict[str, Any]) -> PairResult:
    if set(row) != {field.name for field in fields(PairResult)}:
        raise ValueError("a line of another version")
    for name, missing in _UNKNOWN.items():
        row[name] = missing if row[name] is None else row[name]
    return PairResult(**row)


def nulled(row: dict[str, Any]) -> dict[str, Any]:
    """The row for JSON, which has no infinity: null stands for what is not known."""
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in row.items()}


def write_csv(results: Sequence[PairResult], path: Path) -> None:
    """A row for each result; inf stands for no answer. Raises BagError."""
    columns = [field.name for field in fields(PairResult) if field.name != "timings_ms"]
    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow([*columns, "ms"])
            for result in results:
                row = [getattr(result, name) for name in columns]
                cells = [f"{value:.6g}" if isinstance(value, float) else value for value in row]
                writer.writerow([*cells, f"{result.total_ms:.1f}"])
    except OSError as error:
        raise BagError(f"{path} cannot be written: {error}") from error
