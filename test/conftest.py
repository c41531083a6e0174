# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Settings of all tests, and worlds that many of them look at.

Of the profiles of hypothesis `make fuzz` chooses the second one. A world is rendered once: painting a room takes longer
than registering it.
"""

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import settings

from vigg_ros.bench.worlds import HandheldLoop, hall_of_columns, render_rgbd, room, single_plane
from vigg_ros_testing.doctor_bags import VIEWED_BY
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


@pytest.fixture(scope="session")
def views() -> list[tuple[np.ndarray, ...]]:
    """Four of them: image, depth (m), pose."""
    world, path = room(seed=2), HandheldLoop()
    poses = [path.T_world_camera(0.1 * k) for k in range(4)]
    return [(*render_rgbd(world, VIEWED_BY, pose), pose) for pose in poses]


@pytest.fixture(scope="session")
def untouched_folder(views: list[tuple[np.ndarray, ...]], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("views")
    for k, (image, depth_m, pose) in enumerate(views[:3]):
        cv2.imwrite(str(folder / f"frame-{k:06d}.color.png"), image)
        cv2.imwrite(str(folder / f"frame-{k:06d}.depth.png"), np.rint(1000 * depth_m).astype(np.uint16))
        np.savetxt(folder / f"frame-{k:06d}.pose.txt", pose)
    np.savetxt(folder / "camera-intrinsics.txt", VIEWED_BY.matrix)
    return folder


@pytest.fixture
def scene_folder(untouched_folder: Path, tmp_path: Path) -> Path:
    """The first three views; a test may change them."""
    return shutil.copytree(untouched_folder, tmp_path / "scene")
