# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where sensors stand relative to each other: fixed transforms, chained."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.errors import DataError
from vigg_ros.registration.rigid import inverse

Lookup = Callable[[str, str], "NDArray[np.float64] | None"]
"""T_target_source (4, 4) of two coordinate frames by name, None if no chain of transforms connects them."""


def require_frame_names(target: str, source: str) -> None:
    """Raise DataError unless both frames have names: of two without one, nobody knows that they are the same."""
    if not (target and source):
        raise DataError(
            "FRAME_ID_EMPTY", found=f"frames {source!r} and {target!r}",
            expected="the names of two frames in TF",
            remedy="set the driver's frame_id, or give the extrinsics as a parameter",
        )


class StaticTree:
    """The transforms of /tf_static; the latest of two for the same link holds."""

    def __init__(self) -> None:
        self._links: dict[str, dict[str, NDArray[np.float64]]] = {}

    def add(self, frame_id: str, child_frame_id: str, T_frame_child: NDArray[np.float64]) -> None:
        """A link: p_frame = T_frame_child @ p_child."""
        self._links.setdefault(frame_id, {})[child_frame_id] = T_frame_child
        self._links.setdefault(child_frame_id, {})[frame_id] = inverse(T_frame_child)

    def lookup(self, target: str, source: str) -> NDArray[np.float64] | None:
        """T_target_source along the shortest chain of links; None if there is none. Raises DataError without names."""
        require_frame_names(target, source)
        if target == source:
            return np.eye(4)
        reached = {target: np.eye(4)}
        waiting = deque([target])
        while waiting:
            here = waiting.popleft()
            for neighbour, T_here_neighbour in self._links.get(here, {}).items():
                if neighbour not in reached:
                    reached[neighbour] = reached[here] @ T_here_neighbour
                    waiting.append(neighbour)
        return reached.get(source)


def fixed(T_camera_points: NDArray[np.float64]) -> Lookup:
    """A lookup that answers every question with one transform given by the user."""
    return lambda target, source: T_camera_points
