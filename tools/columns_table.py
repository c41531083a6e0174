# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The columns of frames.csv, with what their fields' docstrings say."""

from __future__ import annotations

import ast
import inspect

from vigg_ros.registration.result import Evidence
from vigg_ros.tracking.columns import COLUMNS, RENAMED_COLUMNS
from vigg_ros.tracking.frame_result import FrameResult

FIELDS = {"keyframe": "keyframe_id"}
"""Columns that are not called as their field is."""

MEANINGS = {
    "stamp_ns": "The stamp of the leading message, in integer nanoseconds.",
    "state": "STARTED, TRACKING, RELOCALISED, LOST, or why the frame was not registered.",
    "visual_matches": "Visual matches that were found.",
    "geometric_matches": "Geometric matches that were found; 0 where the images left no doubt.",
    "geometric_inliers": "Geometric matches within the threshold under the answer.",
    "sigma_translation_m": "Largest standard deviation of the pose's position, by its covariance.",
    "sigma_rotation_deg": "Largest standard deviation of the pose's rotation, by its covariance.",
}
"""Of columns whose fields need no docstring where they stand, and of those that are computed."""


def table() -> str:
    """The table in Markdown; times per stage and the sentence follow the columns of ``COLUMNS``."""
    rows = [(f"`{column.name}`", meaning_of(column.name)) for column in COLUMNS]
    rows += [(f"`{old}`", f"The old name of `{new}`, written for one release.") for old, new in RENAMED_COLUMNS.items()]
    rows += [("`ms_...`", "Milliseconds of each stage."), ("`message`", "Why there is no pose, in one sentence.")]
    return "\n".join(["| column | meaning |", "|---|---|", *(f"| {' | '.join(row)} |" for row in rows)])


def meaning_of(column: str) -> str:
    """One line on a column. Raises KeyError where nothing is said of it anywhere."""
    said = docstrings(FrameResult) | docstrings(Evidence) | MEANINGS
    return said[FIELDS.get(column, column)].replace("``", "`").replace("|", "\\|")


def docstrings(kind: type) -> dict[str, str]:
    """The docstrings below the fields of a class, each on one line."""
    (definition,) = ast.parse(inspect.getsource(kind)).body
    assert isinstance(definition, ast.ClassDef)
    found = {}
    for field, after in zip(definition.body, definition.body[1:], strict=False):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(after, ast.Expr):
            found[field.target.id] = " ".join(str(ast.literal_eval(after.value)).split())
    return found
