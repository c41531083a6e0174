# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Small data set folders with nothing wrong, by the published layouts."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import choose_topics
from vigg_ros.bench.datasets.dataset import Dataset
from vigg_ros.registration import Camera

SHARED = Path(__file__).parents[3] / "shared" / "data"

CAMERA = Camera(width_px=8, height_px=6, fx_px=7, fy_px=6, cx_px=3.5, cy_px=2.5)
"""Of ``save_intrinsics``, for images of ``save_image``."""


def real_data(name: str) -> Path:
    """A folder of real data, or skip."""
    if not (SHARED / name).is_dir():
        pytest.skip(f"the real data {name} is not on this machine")
    return SHARED / name


def messages_of(bag: Path) -> dict[str, list]:
    """The bag's messages by topic, in order; its topics need no naming."""
    found: dict[str, list] = {}
    with BagReader(bag) as reader:
        assert set(choose_topics(reader.topics, encodings=reader.encodings()).names) == {t.name for t in reader.topics}
        for one in reader.messages():
            found.setdefault(one.topic, []).append(one.message)
        assert not reader.damaged
    return found


def save_image(path: Path, value: int, size: tuple[int, int] = (8, 6)) -> None:
    _save(path, np.full((size[1], size[0], 3), value, np.uint8))


def save_depth(path: Path, value: int, size: tuple[int, int] = (8, 6)) -> None:
    """Depth of one value, but for a pixel of 0 and one of 65535 at the top left."""
    depth = np.full((size[1], size[0]), value, np.uint16)
    depth[0, :2] = 0, 65535
    _save(path, depth)


def _save(path: Path, image: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), image)


def pose_at(x: float) -> np.ndarray:
    """A quarter turn about z, at x."""
    return np.array([[0.0, -1, 0, x], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


QUARTER_TURN = "0 0 0.7071067811865476 0.7071067811865476"
"""The quaternion x y z w of ``pose_at``."""


def save_intrinsics(path: Path) -> None:
    path.write_text("7 0 3.5\n0 6 2.5\n0 0 1\n")


def save_frames(folder: Path, numbers, colour: str, depth: str, pose: str, size=(8, 6)) -> None:
    """Files of these names in numbers; colour in this size."""
    for k in numbers:
        save_image(folder / colour.format(k), k, size)
        save_depth(folder / depth.format(k), 1000 + k)
        (folder / pose.format(k)).parent.mkdir(exist_ok=True)
        np.savetxt(folder / pose.format(k), pose_at(k))


def seven_scenes(folder: Path, numbers=(0, 1, 2, 5), colour: str = "color.png") -> Path:
    name = "frame-{:06d}"
    save_frames(folder, numbers, f"{name}.{colour}", f"{name}.depth.png", f"{name}.pose.txt")
    save_intrinsics(folder / "camera-intrinsics.txt")
    return folder


def scannet(folder: Path, numbers=(0, 1, 2, 10)) -> Path:
    save_frames(folder, numbers, "color/{}.png", "depth/{}.png", "pose/{}.txt", (16, 12))
    (folder / "intrinsic").mkdir()
    K = np.eye(4)
    K[0, 0], K[1, 1], K[0, 2], K[1, 2] = 7, 6, 3.5, 2.5
    np.savetxt(folder / "intrinsic" / "intrinsic_depth.txt", K)
    np.savetxt(folder / "intrinsic" / "intrinsic_color.txt", 2 * K)
    return folder


def tum(folder: Path) -> Path:
    """Three colour and depth images a few ms apart, the last depth too late; poses at 100 Hz."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, stamps in (
        ("rgb", ("1305031102.175304", "1305031102.211214", "1305031102.243211")),
        ("depth", ("1305031102.160407", "1305031102.226738", "1305031102.283211")),
    ):
        lines = ["# images", "# timestamp filename"]
        for k, stamp in enumerate(stamps):
            path = folder / name / f"{stamp}.png"
            save_image(path, k) if name == "rgb" else save_depth(path, 5000 + k)
            lines.append(f"{stamp} {name}/{stamp}.png")
        (folder / f"{name}.txt").write_text("\n".join(lines) + "\n")
    poses = (f"1305031102.{150 + 10 * k}0 {k} 0 0 {QUARTER_TURN}" for k in range(12))
    (folder / "groundtruth.txt").write_text("# timestamp tx ty tz qx qy qz qw\n" + "\n".join(poses))
    return folder


KITTI_P2 = "7 0 3.5 14 0 7 2.5 -7 0 0 1 0.5"
"""K^-1 of the last column: ((14 - 3.5 * 0.5) / 7, (-7 - 2.5 * 0.5) / 7, 0.5)."""

KITTI_TR = "0 -1 0 0.1 0 0 -1 0.2 1 0 0 0.3"
"""Velodyne (x forward, y left, z up) to camera 0 (x right, y down, z forward)."""


def kitti(folder: Path, frames: int = 3) -> Path:
    (folder / "velodyne").mkdir(parents=True)
    for k in range(frames):
        save_image(folder / "image_2" / f"{k:06d}.png", k)
        scan = np.array([[k, 1, 2, 0.25], [4, 5, 6, 0.5]], "<f4")
        scan.tofile(folder / "velodyne" / f"{k:06d}.bin")
    (folder / "calib.txt").write_text(f"P0: 0\nP2: {KITTI_P2}\nTr: {KITTI_TR}\n")
    (folder / "times.txt").write_text("".join(f"{0.1041284 * k:.6e}\n" for k in range(frames)))
    # Camera 0 moves 2 m along its z, which is the Velodyne's x.
    (folder / "poses.txt").write_text("".join(f"1 0 0 0 0 1 0 0 0 0 1 {2 * k}\n" for k in range(frames)))
    return folder


def kitti_raw(folder: Path, frames: int = 3) -> Path:
    drive = folder / "2011_09_26" / "2011_09_26_drive_0001_sync"
    stamps = {"image_02": "964389445", "velodyne_points": "951199337", "oxts": "960000001"}
    for sensor, fraction in stamps.items():
        (drive / sensor / "data").mkdir(parents=True)
        rows = (f"2011-09-26 13:02:{25 + k}.{fraction}\n" for k in range(frames))
        (drive / sensor / "timestamps.txt").write_text("".join(rows))
    for k in range(frames):
        save_image(drive / "image_02" / "data" / f"{k:010d}.png", k)
        np.full((2, 4), k + 1, "<f4").tofile(drive / "velodyne_points" / "data" / f"{k:010d}.bin")
        # One degree of longitude at the equator is 111,319.49 m: this is k metres to the east.
        longitude_deg = k / (6_378_137.0 * np.pi / 180)
        (drive / "oxts" / "data" / f"{k:010d}.txt").write_text(f"0 {longitude_deg!r} 5 0 0 0" + " 0" * 24)
    rectified = f"S_rect_02: 8 6\nR_rect_00: 1 0 0 0 1 0 0 0 1\nP_rect_02: {KITTI_P2}\n"
    (drive.parent / "calib_cam_to_cam.txt").write_text(f"calib_time: 09-Jan-2012 13:57:47\n{rectified}")
    (drive.parent / "calib_velo_to_cam.txt").write_text("R: 0 -1 0 0 0 -1 1 0 0\nT: 0.1 0.2 0.3\n")
    (drive.parent / "calib_imu_to_velo.txt").write_text("R: 1 0 0 0 1 0 0 0 1\nT: -0.8 0.3 -0.8\n")
    return drive


def stamps_after_start(dataset: Dataset) -> list[int]:
    """Stamps of the frames in ns, from where data sets that count from 0 begin."""
    return [frame.stamp_ns - 10**9 for frame in dataset.frames()]
