# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Real sensors against poses of a motion capture, a reconstruction and refined scans, where the data is there."""

from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from vigg_ros.bench.datasets.kitti import open_kitti
from vigg_ros.bench.datasets.rgbd_folder import open_rgbd_folder
from vigg_ros.bench.worlds.poses import Pose
from vigg_ros.registration import Camera, Config, Features, Frame, extract, register
from vigg_ros.registration.rigid import rigid_from_quaternion
from vigg_ros_testing.registration_samples import answer, assert_near, truth

DATA = Path(__file__).parents[2].parent / "shared" / "data"
TUM, KITCHEN, KITTI = DATA / "tum_pairs", DATA / "redkitchen", DATA / "kitti_04"
CONFIG, LIDAR_CONFIG = Config(), Config.preset("lidar")


@pytest.mark.skipif(not TUM.is_dir(), reason=f"no data folder {TUM.name}")
@pytest.mark.parametrize("case", ["case_1", "case_2"])
def test_pairs_of_a_motion_capture(case: str) -> None:
    (target, T_world_target), (source, T_world_source) = tum(case, "prev"), tum(case, "curr")
    found = answer(register(target, source, CONFIG)).T_target_source
    # Depth itself disagrees with the poses by 0.13 and 0.75 deg: GICP that starts from them ends up there, and
    # within 0.1 deg of what is found here.
    assert_near(found, truth(T_world_target, T_world_source), rotation_deg=1.0, translation_m=0.01)


def tum(case: str, name: str) -> tuple[Features, Pose]:
    """Features and pose of a frame by motion capture: tx ty tz qx qy qz qw."""
    folder = TUM / case
    numbers = np.loadtxt(folder / f"pose_{name}.txt")
    image = cv2.imread(str(folder / f"img_{name}.png"), cv2.IMREAD_COLOR)
    depth_m = cv2.imread(str(folder / f"dep_{name}.png"), cv2.IMREAD_UNCHANGED).astype(np.float32) / 5000
    frame = Frame.from_depth(image, depth_m, Camera(640, 480, 525.0, 525.0, 319.5, 239.5))
    return extract(frame, CONFIG), rigid_from_quaternion(numbers[:3], numbers[3:])


@pytest.mark.skipif(not KITCHEN.is_dir(), reason=f"no data folder {KITCHEN.name}")
@pytest.mark.parametrize(
    ("number", "gap", "within_deg", "within_m"),
    [(0, 20, 1.5, 0.03), (200, 20, 1.5, 0.03), (0, 60, 2.0, 0.04), (200, 60, 2.0, 0.06), (20, 120, 4.5, 0.12)],
)
def test_frames_of_a_kitchen(number: int, gap: int, within_deg: float, within_m: float) -> None:
    """The poses' own errors grow with the gap: at 20, 60 and 120 frames depth itself disagrees with them by
    medians of 0.56 deg and 1.3 cm, 1.80 and 2.9, 2.27 and 6.7. A pair may have twice that."""
    (target, T_world_target), (source, T_world_source) = kitchen(number + gap), kitchen(number)
    found = answer(register(target, source, CONFIG)).T_target_source
    T_true = truth(T_world_target, T_world_source)
    assert_near(found, T_true, rotation_deg=within_deg, translation_m=within_m)


def kitchen(number: int) -> tuple[Features, Pose]:
    """Features and pose of a frame of 7-Scenes."""
    (frame,) = (one for one in open_rgbd_folder(KITCHEN).frames() if one.number == number)
    return extract(Frame.from_depth(frame.image(), frame.depth_m(), frame.camera), CONFIG), frame.T_world_sensor


@cache
def kitti_features(number: int) -> Features:
    dataset = open_kitti(KITTI)
    (frame,) = (one for one in dataset.frames() if one.number == number)
    T_camera_lidar = np.linalg.inv(dataset.T_lidar_camera)
    return extract(Frame.from_points(frame.image(), frame.points(), frame.camera, T_camera_lidar), LIDAR_CONFIG)


@pytest.mark.skipif(not KITTI.is_dir(), reason=f"no data folder {KITTI.name}")
@pytest.mark.parametrize(("target", "source", "bound_m"), [(12, 4, 0.022), (16, 4, 0.03), (20, 4, 0.04)])
def test_a_real_road(target: int, source: int, bound_m: float) -> None:
    """Gaps of 8, 12 and 16 frames: 11, 17 and 22 m.

    The reference was refined by GICP at 0.3 m, which is good for about a centimetre itself; 2.2 cm and
    0.06 deg are what is asked for at the first gap, and less surface is left at the others.
    """
    outcome = answer(register(kitti_features(target), kitti_features(source), LIDAR_CONFIG))
    rows = np.loadtxt(KITTI / "refined_pairs.txt")
    (T_true,) = rows[(rows[:, :2] == (target, source)).all(axis=1), 2:].reshape(-1, 4, 4)
    assert_near(outcome.T_target_source, T_true, rotation_deg=0.06, translation_m=bound_m)
