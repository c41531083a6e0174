# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command line as a user meets it: exit codes, one-line errors, files left behind."""

from __future__ import annotations

import csv
import json
import shlex
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.writer import BagWriter
from vigg_ros.bench.catalogue import expand
from vigg_ros.bench.worlds import HandheldLoop, render_rgbd, room
from vigg_ros.cli.main import COMMANDS, _parser, main
from vigg_ros.messages.pose_messages import encode_pose
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image
from vigg_ros.registration.camera import Camera

CAMERA = Camera(160, 120, 131.0, 131.0, 79.5, 59.5)
START_NS = 1_700_000_000_123_456_789
PERIOD_NS = 100_000_000


@pytest.fixture(scope="module")
def views() -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Four small views of a room: image, depth (m), pose."""
    world, path = room(seed=2), HandheldLoop()
    poses = [path.T_world_camera(0.1 * k) for k in range(4)]
    return [(*render_rgbd(world, CAMERA, pose), pose) for pose in poses]


@pytest.fixture(scope="module")
def bag(views, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("cli") / "room"
    with BagWriter(path) as writer:
        for k, (image, depth_m, pose) in enumerate(views):
            stamp = {"stamp_ns": START_NS + k * PERIOD_NS, "frame_id": "camera"}
            log_ns = stamp["stamp_ns"]
            writer.write("/camera_info", encode_camera_info(CAMERA, **stamp), log_ns=log_ns)
            writer.write("/image", encode_image(image, **stamp), log_ns=log_ns)
            writer.write("/depth", encode_image(depth_m, **stamp), log_ns=log_ns)
            truth = encode_pose(pose, stamp_ns=log_ns, frame_id="map")
            writer.write("/ground_truth", truth, log_ns=log_ns)
    return path


def test_help_names_every_command_and_imports_none() -> None:
    code = "import sys; from vigg_ros.cli.main import main\ntry: main(['--help'])\nexcept SystemExit: pass\n"
    code += "print([m for m in ('numpy', 'cv2', 'numba', 'rosbags', 'scipy') if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.splitlines()[-1] == "[]"
    assert all(f"\n    {name}" in out for name in COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_explains_itself(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main([name, "--help"])
    assert stop.value.code == 0
    assert f"vigg {name}" in capsys.readouterr().out


@pytest.mark.parametrize(
    "words", [["replay"], ["register"], ["convert"], ["evaluate", "pairs"], ["evaluate", "rendered"]]
)
def test_help_ends_with_examples_that_the_command_takes(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main([*words, "--help"])
    examples = capsys.readouterr().out.partition("examples:\n")[2].splitlines()
    assert len(examples) == 2
    for example in examples:
        vigg, *arguments = shlex.split(example)
        assert vigg == "vigg"
        assert arguments[: len(words)] == words
        taken = _parser(words[0]).parse_args(arguments)
        expand(getattr(taken, "methods", ["default"]), outdoor=False)  # and the methods are ones that there are


def test_replay_leaves_what_the_design_lists(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "out"
    assert main(["replay", str(bag), "--output", str(output), "--output-bag"]) == 0
    shown = capsys.readouterr()
    assert "4 of 4 (100.0%)" in shown.out
    assert "configuration    rgbd, by what the bag holds" in shown.out
    assert json.loads((output / "run.json").read_text())["configuration"] == "rgbd, by what the bag holds"
    assert shown.out.splitlines()[-1] == f"report: {output / 'report.html'}"
    expected = {"trajectory.tum", "frames.csv", "metrics.json", "config.yaml", "run.json", "report.html", "results_bag"}
    assert {path.name for path in output.iterdir()} == expected
    lines = [line for line in (output / "trajectory.tum").read_text().splitlines() if line[0] != "#"]
    assert lines[0].startswith("1700000000.123456789 ")
    rows = list(csv.DictReader((output / "frames.csv").read_text().splitlines()))
    assert [int(row["stamp_ns"]) for row in rows] == [START_NS + k * PERIOD_NS for k in range(4)]
    metrics = json.loads((output / "metrics.json").read_text())
    assert metrics["coverage"] == 1.0
    # Exact depth at 160 x 120: the error is the voxel grid's, a small part of its 25 mm.
    assert metrics["absolute"]["translation_m"]["rmse"] < 0.01
    with BagReader(output / "results_bag") as reader:
        counts = {topic.name: topic.count for topic in reader.topics}
    assert counts["/registrar/pose"] == counts["/tf"] == counts["/registrar/status"] == 4


def test_a_config_for_scans_is_noted_but_taken(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["replay", str(bag), "--config", "lidar", "--output", str(tmp_path / "out")])
    shown = capsys.readouterr()
    assert [line for line in shown.err.splitlines() if line.endswith("leave --config out, or give --config rgbd")]
    assert "configuration    lidar, as asked for" in shown.out


def test_replaying_twice_gives_the_same_bytes(bag: Path, tmp_path: Path) -> None:
    for name in ("first", "second"):
        assert main(["replay", str(bag), "--output", str(tmp_path / name)]) == 0
    first, second = ((tmp_path / name / "trajectory.tum").read_bytes() for name in ("first", "second"))
    assert first == second


def test_an_existing_output_is_refused_and_kept(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "kept").write_text("mine")
    assert main(["replay", str(bag), "--output", str(tmp_path)]) == 2
    assert "exists already" in capsys.readouterr().err
    assert (tmp_path / "kept").read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["replay", "nowhere"], 3, "nowhere"),
        (["replay", "{bag}", "--config", "rgdb"], 2, "did you mean rgbd"),
        (["replay", "{bag}", "--set", "visual.topk=3"], 2, "did you mean visual.top_k"),
        (["replay", "{bag}", "--set", "visual.top_k=many"], 2, "expected int"),
        (["replay", "{bag}", "--set", "visual.top_k"], 2, "OPTION=VALUE"),
        (["replay", "{bag}", "--image-topic", "/nope"], 2, "/nope"),
        (["replay", "{bag}", "--ground-truth", "nowhere.tum"], 2, "nowhere.tum"),
        (["convert", "7scenes", "nowhere", "-o", "{tmp}/x"], 3, "nowhere"),
    ],
)
def test_mistakes_get_one_line_and_a_code(
    arguments: list[str], code: int, words: str, bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([argument.format(bag=bag, tmp=tmp_path) for argument in arguments]) == code
    shown = capsys.readouterr()
    assert words in shown.err
    assert "Traceback" not in shown.err
    assert not list(tmp_path.iterdir())


def test_a_bag_of_one_frame_has_nothing_to_pair(views, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    image, depth_m, _ = views[0]
    stamp = {"stamp_ns": START_NS, "frame_id": "camera"}
    with BagWriter(tmp_path / "one") as writer:
        writer.write("/camera_info", encode_camera_info(CAMERA, **stamp), log_ns=START_NS)
        writer.write("/image", encode_image(image, **stamp), log_ns=START_NS)
        writer.write("/depth", encode_image(depth_m, **stamp), log_ns=START_NS)
    assert main(["replay", str(tmp_path / "one"), "--output", str(tmp_path / "out")]) == 5
    assert "vigg doctor" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def write_pair(views, folder: Path) -> list[str]:
    names = []
    for k in (0, 2):
        image, depth_m, _ = views[k]
        names += [str(folder / f"{k}.png"), str(folder / f"{k}.depth.png")]
        cv2.imwrite(names[-2], image)
        cv2.imwrite(names[-1], np.rint(1000 * depth_m).astype(np.uint16))
    return names


def test_register_prints_the_transform_and_draws(views, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    intrinsics = ["--intrinsics", "131", "131", "79.5", "59.5"]
    assert main(["register", *write_pair(views, tmp_path), *intrinsics, "--output", str(tmp_path / "out")]) == 0
    shown = capsys.readouterr().out.splitlines()
    T_printed = np.array([[float(word) for word in line.split()] for line in shown[1:5]])
    T_truth = np.linalg.inv(views[0][2]) @ views[2][2]
    # Millimetre depth images; the rest is the voxel grid's.
    np.testing.assert_allclose(T_printed, T_truth, atol=0.01)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"matches.png", "aligned.png"}


def test_register_says_why_there_is_no_answer(views, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = write_pair(views, tmp_path)
    cv2.imwrite(names[2], np.full((120, 160, 3), 127, np.uint8))
    intrinsics = ["--intrinsics", "131", "131", "79.5", "59.5"]
    assert main(["register", *names, *intrinsics, "--output", str(tmp_path / "out")]) == 1
    assert "no answer: NO_TEXTURE" in capsys.readouterr().out
