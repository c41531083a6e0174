# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether somebody else gives a frame a parent on TF, where each frame may have one only."""

from __future__ import annotations

from collections.abc import Callable

import yaml

PERIOD_S = 1.0
"""It is asked so often: another publisher may begin at any time."""

GONE_S = 5.0
"""A parent whose transforms are not renewed for so long is gone; tf2 remembers it for good. A static one stays."""

# Of the same grammar, in C where it is built in: a robot's tree may have hundreds of frames.
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class ParentWatch:
    """Asks for the frames that tf2 knows, in the words of its all_frames_as_yaml."""

    def __init__(self, frames: Callable[[], str]) -> None:
        self._frames = frames
        self._base: str | None = None
        self._asked_s = 0.0
        self._other: str | None = None
        self._renewed: tuple[object, object] = (None, None)
        self._renewed_s = 0.0

    def other_parent(self, base: str, odom: str, now_s: float) -> str | None:
        """The parent of the base besides ``odom``; None if there is none, or none any more."""
        if base != self._base or now_s - self._asked_s >= PERIOD_S:
            self._base, self._asked_s = base, now_s
            self._other = self._ask(base, odom, now_s)
        return self._other

    def _ask(self, base: str, odom: str, now_s: float) -> str | None:
        known = yaml.load(self._frames(), Loader=_LOADER)
        frame = known.get(base, {}) if isinstance(known, dict) else {}
        parent, newest_s = frame.get("parent"), frame.get("most_recent_transform")
        if parent is None or parent == odom:  # what this node publishes comes back
            return None
        if (parent, newest_s) != self._renewed:
            self._renewed, self._renewed_s = (parent, newest_s), now_s
        is_static = not newest_s
        return str(parent) if is_static or now_s - self._renewed_s < GONE_S else None
