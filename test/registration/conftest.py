# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rendered once for all tests of the method: painting a room takes longer than registering it."""

from __future__ import annotations

import pytest

from vigg_ros.bench.worlds import hall_of_columns, room, single_plane
from vigg_ros_testing.registration_samples import Studio


@pytest.fixture(scope="session")
def studio() -> Studio:
    """A furnished room."""
    return Studio(room(seed=11))


@pytest.fixture(scope="session")
def wall() -> Studio:
    """One painted wall."""
    return Studio(single_plane(seed=2))


@pytest.fixture(scope="session")
def hall() -> Studio:
    """A hall that looks the same every 1.2 m."""
    return Studio(hall_of_columns(seed=2))
