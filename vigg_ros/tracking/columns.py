# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The table of a FrameResult: one list of columns for frames.csv, ~/status, the result bag and the docs."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vigg_ros.registration.result import Evidence
from vigg_ros.tracking.frame_result import FrameResult

Value = str | bool | int | float | None


@dataclass(frozen=True, slots=True)
class Column:
    """One figure of a frame."""

    name: str
    value: Callable[[FrameResult], Value]
    """None where there is none."""


RENAMED_COLUMNS = {"likeness": "photometric_correlation"}
"""Old name: new name. The old ones are still written in this release, after the others."""


def _of_evidence(name: str) -> Column:
    return Column(name, lambda result: None if result.evidence is None else getattr(result.evidence, name))


def _sigma(rows: slice, scale: float) -> Callable[[FrameResult], Value]:
    """The largest standard deviation of some rows of the covariance."""

    def value(result: FrameResult) -> Value:
        if result.covariance is None:
            return None
        return scale * float(np.sqrt(np.diag(result.covariance)[rows].max()))

    return value


COLUMNS = (
    Column("stamp_ns", lambda result: result.stamp_ns),
    Column("session", lambda result: result.session),
    Column("state", lambda result: result.state.value),
    Column("reason", lambda result: result.reason),
    Column("keyframe", lambda result: result.keyframe_id),
    Column("keyframe_stamp_ns", lambda result: result.keyframe_stamp_ns),
    Column("new_keyframe", lambda result: result.new_keyframe),
    *(_of_evidence(field.name) for field in dataclasses.fields(Evidence)),
    Column("sigma_translation_m", _sigma(slice(0, 3), 1.0)),
    Column("sigma_rotation_deg", _sigma(slice(3, 6), 180.0 / math.pi)),
)


COLUMN_NAMES = (*(column.name for column in COLUMNS), *RENAMED_COLUMNS)
"""Of ``values_of``, in its order."""


def values_of(result: FrameResult) -> dict[str, Value]:
    """Every column of a result by name, renamed ones under both names."""
    values = {column.name: column.value(result) for column in COLUMNS}
    return values | {old: values[new] for old, new in RENAMED_COLUMNS.items()}


def known_values_of(result: FrameResult) -> dict[str, str]:
    """Columns that have a value, as text: what a message carries, yes and no as True and False."""
    known = ((name, value) for name, value in values_of(result).items() if value is not None)
    finite = ((name, value) for name, value in known if not isinstance(value, float) or math.isfinite(value))
    return {name: str(value) if isinstance(value, bool) else as_text(value) for name, value in finite}


def as_text(value: Value) -> str:
    """A cell of frames.csv: yes and no as 1 and 0, numbers that are not whole to six digits."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def timing_name(stage: str) -> str:
    """The name of the column with a stage's milliseconds."""
    return f"ms_{stage.replace(' ', '_')}"
