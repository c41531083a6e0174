# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A folder of a few small views of a room, in the layout 7scenes."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from vigg_ros.bench.worlds import HandheldLoop, render_rgbd, room
from vigg_ros_testing.scene_folder import VIEWED_BY


@pytest.fixture
def scene_folder(tmp_path: Path) -> Path:
    folder = tmp_path / "scene"
    folder.mkdir()
    world, path = room(seed=2), HandheldLoop()
    for k in range(3):
        pose = path.T_world_camera(0.1 * k)
        image, depth_m = render_rgbd(world, VIEWED_BY, pose)
        cv2.imwrite(str(folder / f"frame-{k:06d}.color.png"), image)
        cv2.imwrite(str(folder / f"frame-{k:06d}.depth.png"), np.rint(1000 * depth_m).astype(np.uint16))
        np.savetxt(folder / f"frame-{k:06d}.pose.txt", pose)
    np.savetxt(folder / "camera-intrinsics.txt", VIEWED_BY.matrix)
    return folder
