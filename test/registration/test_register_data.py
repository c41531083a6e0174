# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Real cameras against poses of a motion capture and of a reconstruction, where the data is there."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vigg_ros.bench.worlds.poses import Pose
from vigg_ros.registration import Camera, Config, Frame, extract, register
from vigg_ros_testing.registration_samples import answer, errors

DATA = Path(__file__).parents[2].parent / "shared" / "data"
TUM, KITCHEN = DATA / "tum_pairs", DATA / "redkitchen"
CONFIG = Config()


def needs(folder: Path) -> pytest.MarkDecorator:
    return pytest.mark.skipif(not folder.is_dir(), reason=f"no ../shared/data/{folder.name} beside the repository")


def read(colour: Path, depth: Path, camera: Camera, units_per_metre: float) -> Frame:
    image = cv2.imread(str(colour), cv2.IMREAD_COLOR)
    counts = cv2.imread(str(depth), cv2.IMREAD_UNCHANGED).astype(np.float32)
    counts[counts == 65535] = 0
    return Frame.from_depth(image, counts / units_per_metre, camera)


def tum(case: str, name: str) -> tuple[Frame, Pose]:
    """A frame and its pose, tx ty tz qx qy qz qw, by motion capture."""
    camera = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
    folder = TUM / case
    numbers = np.loadtxt(folder / f"pose_{name}.txt")
    T_world_camera = np.eye(4)
    T_world_camera[:3, :3] = Rotation.from_quat(numbers[3:]).as_matrix()
    T_world_camera[:3, 3] = numbers[:3]
    return read(folder / f"img_{name}.png", folder / f"dep_{name}.png", camera, 5000), T_world_camera


def kitchen(number: int) -> tuple[Frame, Pose]:
    stem = str(KITCHEN / f"frame-{number:06d}")
    K = np.loadtxt(KITCHEN / "camera-intrinsics.txt")
    camera = Camera(640, 480, K[0, 0], K[1, 1], K[0, 2], K[1, 2])
    frame = read(Path(f"{stem}.color.jpg"), Path(f"{stem}.depth.png"), camera, 1000)
    return frame, np.loadtxt(f"{stem}.pose.txt")


def registered(target: tuple[Frame, Pose], source: tuple[Frame, Pose]) -> tuple[float, float]:
    found = answer(register(extract(target[0], CONFIG), extract(source[0], CONFIG), CONFIG))
    return errors(found.T_target_source, np.linalg.inv(target[1]) @ source[1])


@needs(TUM)
@pytest.mark.parametrize("case", ["case_1", "case_2"])
def test_pairs_of_a_motion_capture(case: str) -> None:
    rotation_deg, translation_m = registered(tum(case, "prev"), tum(case, "curr"))
    # Depth itself disagrees with the poses by 0.13 and 0.75 deg: GICP that starts from them ends up there, and
    # within 0.1 deg of what is found here.
    assert rotation_deg < 1.0
    assert translation_m < 0.01


@needs(KITCHEN)
@pytest.mark.parametrize(
    ("number", "gap", "within_deg", "within_m"),
    [(0, 20, 1.5, 0.03), (200, 20, 1.5, 0.03), (0, 60, 2.0, 0.04), (200, 60, 2.0, 0.06), (20, 120, 4.5, 0.12)],
)
def test_frames_of_a_kitchen(number: int, gap: int, within_deg: float, within_m: float) -> None:
    """The poses' own errors grow with the gap: at 20, 60 and 120 frames depth itself disagrees with them by
    medians of 0.56 deg and 1.3 cm, 1.80 and 2.9, 2.27 and 6.7. A pair may have twice that."""
    rotation_deg, translation_m = registered(kitchen(number + gap), kitchen(number))
    assert rotation_deg < within_deg
    assert translation_m < within_m
