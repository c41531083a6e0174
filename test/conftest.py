# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Settings of all tests, and worlds that many of them look at.

Of the profiles of hypothesis `make fuzz` chooses the second one. A world is rendered once: painting a room takes longer
than registering it.
"""

from __future__ import annotations

import pytest
from hypothesis import settings

from vigg_ros.bench.worlds import hall_of_columns, room, single_plane
from vigg_ros_testing.registration_samples import Studio

# No deadline: a timing is never asserted in a test. Derandomized: a red run is red again.
settings.register_profile("house", deadline=None, derandomize=True, max_examples=50)
settings.register_profile("fuzz", deadline=None, max_examples=1000, print_blob=True)
settings.load_profile("house")


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
