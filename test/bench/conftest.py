# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The camera and the scenes that the tests of the worlds share."""

from __future__ import annotations

import pytest

from vigg_ros.bench.worlds import Scene, room, street
from vigg_ros.registration import Camera


@pytest.fixture(scope="session")
def camera() -> Camera:
    return Camera(width_px=160, height_px=120, fx_px=138.5, fy_px=138.5, cx_px=79.5, cy_px=59.5)


@pytest.fixture(scope="session")
def furnished_room() -> Scene:
    return room(seed=11)


@pytest.fixture(scope="session")
def a_street() -> Scene:
    """The one that the bundled bag shows."""
    return street(seed=3)
