# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A few small views of a room, and a folder of them in the layout 7scenes: rendered once for all commands."""

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from vigg_ros.bench.worlds import HandheldLoop, render_rgbd, room
from vigg_ros_testing.doctor_bags import VIEWED_BY

View = tuple[np.ndarray, np.ndarray, np.ndarray]


@pytest.fixture(scope="session")
def views() -> list[View]:
    """Four of them: image, depth (m), pose."""
    world, path = room(seed=2), HandheldLoop()
    poses = [path.T_world_camera(0.1 * k) for k in range(4)]
    return [(*render_rgbd(world, VIEWED_BY, pose), pose) for pose in poses]


@pytest.fixture(scope="session")
def untouched_folder(views: list[View], tmp_path_factory: pytest.TempPathFactory) -> Path:
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
