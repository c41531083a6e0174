# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A DDS domain for one process and its children, so that runs side by side on a machine do not hear each other."""

import fcntl
import functools
import os
import tempfile
from pathlib import Path

HIGHEST = 100
"""Domains up to 101 have ports below those that Linux gives out by itself."""


@functools.cache
def own_domain() -> int:
    """The domain of this process; see ``claim_domain``."""
    return claim_domain()


def claim_domain() -> int:
    """A ROS_DOMAIN_ID from 1 to 100 that nobody else has claimed, as long as this process runs."""
    for attempt in range(HIGHEST):
        number = 1 + (os.getpid() + attempt) % HIGHEST
        # A bare descriptor: it is closed with the process, and nothing warns that nobody did it before.
        lock = os.open(Path(tempfile.gettempdir()) / f"vigg_ros_domain_{number}.lock", os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(lock)
            continue
        return number
    raise RuntimeError(f"{HIGHEST} test processes run on this machine; no ROS_DOMAIN_ID is left")
