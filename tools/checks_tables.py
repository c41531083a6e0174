# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The rules by which an answer is refused, and their limits, as tables."""

from __future__ import annotations

from collections.abc import Iterable

from vigg_ros.acceptance import limits as acceptance_limits
from vigg_ros.acceptance.checks import CHECKS, EXPLANATIONS, Check
from vigg_ros.acceptance.limits import Limit
from vigg_ros.registration import Config

LIMITS = {name: value for name, value in vars(acceptance_limits).items() if isinstance(value, Limit)}
PRESETS = ("rgbd", "lidar")


def checks() -> str:
    """Every check in the order in which it is asked."""
    rows = (
        (f"`{check.reason.value}`", f"`{check.measured}`", f"{check.bound} {_values(check)}", _places(check))
        for check in CHECKS
    )
    return _table(("reason", "measured", "passes if", "the limit is set by"), rows)


def reasons() -> str:
    """What each reason means, and what a user can do."""
    rows = ((f"`{reason.value}`", one.meaning, one.remedy) for reason, one in EXPLANATIONS.items())
    return _table(("reason", "meaning", "remedy"), rows)


def limits() -> str:
    """The limits that are no options."""
    rows = ((f"`{name}`", f"{one.value:g}", one.origin, one.right, one.wrong) for name, one in LIMITS.items())
    return _table(("limit", "value", "where it comes from", "right answers show", "wrong answers show"), rows)


def _values(check: Check[object]) -> str:
    """The limit as a number: of a constant, or of an option in both presets."""
    named = [f"{LIMITS[name].value:g}" for name in _names(check) if name in LIMITS]
    if named:
        return " and ".join(named)
    # Only constants depend on what is measured, so any subject will do here.
    values = [f"{check.limit(object(), Config.preset(preset)):g}" for preset in PRESETS]
    return values[0] if values[0] == values[1] else f"{values[0]} (lidar: {values[1]})"


def _places(check: Check[object]) -> str:
    return check.limit_text if check.limit_text == "by definition" else ", ".join(f"`{one}`" for one in _names(check))


def _names(check: Check[object]) -> list[str]:
    return check.limit_text.split(", ")


def _table(heading: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = (f"| {' | '.join(row)} |" for row in rows)
    return "\n".join([f"| {' | '.join(heading)} |", "|---" * len(heading) + "|", *lines])
