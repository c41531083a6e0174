# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg register``: from files to the printed transform, the pictures and the exit code."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vigg_ros.cli.console import ExitCode
from vigg_ros.cli.main import main
from vigg_ros_testing.doctor_bags import INTRINSICS, VIEWED_BY, looking_along_x

LOOKING_AHEAD = ["--extrinsics", "0", "0", "0", "-0.5", "0.5", "-0.5", "0.5"]


@pytest.fixture
def files(scene_folder: Path) -> list[str]:
    """Image and depth image of a target, then of a source."""
    return [str(scene_folder / f"frame-{k:06d}.{kind}.png") for k in (0, 2) for kind in ("color", "depth")]


def true_motion(scene_folder: Path) -> np.ndarray:
    poses = (np.loadtxt(scene_folder / f"frame-{k:06d}.pose.txt") for k in (0, 2))
    return np.linalg.inv(next(poses)) @ next(poses)


def printed_transform(capsys: pytest.CaptureFixture[str]) -> np.ndarray:
    return np.array([[float(word) for word in line.split()] for line in capsys.readouterr().out.splitlines()[1:5]])


def test_it_prints_the_transform_and_draws(files: list[str], scene_folder: Path, tmp_path: Path, capsys) -> None:
    assert main(["register", *files, *INTRINSICS, "--output", str(tmp_path / "out")]) == ExitCode.OK
    # Millimetre depth images; the rest is the voxel grid's.
    np.testing.assert_allclose(printed_transform(capsys), true_motion(scene_folder), atol=0.01)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"matches.png", "aligned.png"}


def test_it_says_why_there_is_no_answer(files: list[str], tmp_path: Path, capsys) -> None:
    cv2.imwrite(files[2], np.full((120, 160, 3), 127, np.uint8))
    assert main(["register", *files, *INTRINSICS, "--output", str(tmp_path / "out")]) == ExitCode.FAILED
    assert "no answer: NO_TEXTURE" in capsys.readouterr().out


def test_the_motion_of_scans_is_that_of_the_scanner(files, scene_folder, tmp_path, capsys) -> None:
    """--extrinsics means the same as for `vigg replay`."""
    T_points_camera = looking_along_x()
    T_points_camera[:3, 3] = 0.3, -0.2, 0.1
    for place in (1, 3):
        depth_m = cv2.imread(files[place], cv2.IMREAD_UNCHANGED) / 1000
        v, u = np.nonzero(depth_m)
        in_camera = VIEWED_BY.lift(np.column_stack((u, v)), depth_m[v, u])
        files[place] = str(tmp_path / f"{place}.npy")
        np.save(files[place], (in_camera @ T_points_camera[:3, :3].T + T_points_camera[:3, 3]).astype(np.float32))
    quaternion = Rotation.from_matrix(T_points_camera[:3, :3]).as_quat()
    extrinsics = ["--extrinsics", *(f"{value:.9f}" for value in (*T_points_camera[:3, 3], *quaternion))]
    assert main(["register", *files, *INTRINSICS, *extrinsics, "--output", str(tmp_path / "out")]) == ExitCode.OK
    T_true = T_points_camera @ true_motion(scene_folder) @ np.linalg.inv(T_points_camera)
    np.testing.assert_allclose(printed_transform(capsys), T_true, atol=0.01)
    drawn = {path.name for path in (tmp_path / "out").iterdir()}
    assert drawn == {"matches.png", "aligned.png", "target_scan.png", "source_scan.png"}


def test_the_preset_follows_from_how_far_the_points_reach(files, tmp_path, capsys) -> None:
    far = np.random.default_rng(0).uniform(5, 60, (2000, 3)).astype(np.float32)
    for place in (1, 3):
        files[place] = str(tmp_path / f"{place}.npy")
        np.save(files[place], far)
    common = ["register", *files, *INTRINSICS, *LOOKING_AHEAD, "--output"]
    main([*common, str(tmp_path / "by itself")])
    assert "note:" not in capsys.readouterr().err
    main([*common, str(tmp_path / "asked for"), "--config", "rgbd"])
    assert capsys.readouterr().err.startswith("note: the data holds scans that reach far, but the configuration")


@pytest.mark.parametrize(
    ("changed", "content", "options", "words"),
    [
        ("nowhere.png", None, [], "nowhere.png does not exist"),
        ("target.png", b"no image", [], "cannot be read as an image"),
        ("depth.png", b"no image", [], "found no image, expected one channel of 16-bit units or float metres"),
        ("scan.npy", b"", LOOKING_AHEAD, "scan.npy cannot be read as a scan"),
        ("scan.npy", b"no scan", LOOKING_AHEAD, "scan.npy cannot be read as a scan"),
        ("scan.bin", bytes(20), LOOKING_AHEAD, "scan.bin cannot be read as a scan"),
        ("scan.bin", bytes(160), [], "needs --extrinsics X Y Z"),
        ("scan.bin", bytes(160), ["--extrinsics", *["0"] * 7], "0.0), expected a finite one of length 1; check"),
        ("scan.bin", bytes(160), ["--extrinsics", *["nan"] * 7], "finite"),
        ("", b"", ["--output", "."], "exists already and is not overwritten"),
    ],
)
def test_what_cannot_be_registered_is_usage(changed, content, options, words, files, tmp_path, capsys) -> None:
    if changed:
        if content is not None:
            (tmp_path / changed).write_bytes(content)
        files[0 if changed.startswith("target") else 1] = str(tmp_path / changed)
    assert main(["register", *files, *INTRINSICS, *options]) == ExitCode.USAGE
    assert words in capsys.readouterr().err
