# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command line as a user meets it: exit codes, one-line errors, files left behind."""

import csv
import json
import shlex
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.writer import BagWriter
from vigg_ros.bench.catalogue import expand
from vigg_ros.cli.main import COMMANDS, _parser, main
from vigg_ros.messages.pose_messages import encode_pose
from vigg_ros.messages.sensor_messages import encode_camera_info, encode_image
from vigg_ros_testing.doctor_bags import VIEWED_BY

START_NS = 1_700_000_000_123_456_789
PERIOD_NS = 100_000_000


def write_views(path: Path, views) -> Path:
    with BagWriter(path) as writer:
        for k, (image, depth_m, pose) in enumerate(views):
            stamp_ns = START_NS + k * PERIOD_NS
            stamp = {"stamp_ns": stamp_ns, "frame_id": "camera"}
            writer.write("/camera_info", encode_camera_info(VIEWED_BY, **stamp), log_ns=stamp_ns)
            writer.write("/image", encode_image(image, **stamp), log_ns=stamp_ns)
            writer.write("/depth", encode_image(depth_m, **stamp), log_ns=stamp_ns)
            writer.write("/ground_truth", encode_pose(pose, stamp_ns=stamp_ns, frame_id="map"), log_ns=stamp_ns)
    return path


@pytest.fixture(scope="module")
def bag(views, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_views(tmp_path_factory.mktemp("cli") / "room", views)


def test_help_names_every_command_and_imports_none() -> None:
    code = "import sys; from vigg_ros.cli.main import main\ntry: main(['--help'])\nexcept SystemExit: pass\n"
    code += "print([m for m in ('numpy', 'cv2', 'numba', 'rosbags', 'scipy') if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.splitlines()[-1] == "[]"
    assert all(f"\n    {name}" in out for name in COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_explains_itself(name: str, capsys) -> None:
    with pytest.raises(SystemExit) as stop:
        main([name, "--help"])
    assert stop.value.code == 0
    assert f"vigg {name}" in capsys.readouterr().out


@pytest.mark.parametrize("command", ["replay", "register", "convert", "evaluate pairs", "evaluate rendered"])
def test_help_ends_with_examples_that_the_command_takes(command: str, capsys) -> None:
    words = command.split()
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


def test_replay_leaves_what_the_design_lists_and_the_same_bytes_again(bag: Path, tmp_path: Path, capsys) -> None:
    output = tmp_path / "out"
    assert main(["replay", str(bag), "--output", str(output), "--output-bag"]) == 0
    shown = capsys.readouterr()
    assert "100.0%: 4 of 4 colour images" in shown.out
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
    assert main(["replay", str(bag), "--output", str(tmp_path / "again")]) == 0
    assert (tmp_path / "again" / "trajectory.tum").read_bytes() == (output / "trajectory.tum").read_bytes()


def test_an_existing_output_is_refused_and_kept(bag: Path, tmp_path: Path, capsys) -> None:
    (tmp_path / "kept").write_text("mine")
    assert main(["replay", str(bag), "--output", str(tmp_path)]) == 2
    assert "exists already" in capsys.readouterr().err
    assert (tmp_path / "kept").read_text() == "mine"


NEEDS_ROS = pytest.mark.skipif(
    find_spec("rclpy") is None, reason="needs ROS 2: source Jazzy, or pip install '.[ros]'"
)


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        *(
            pytest.param([command, *options], code, words, marks=NEEDS_ROS)
            for command, options, code, words in (
                ("play", ["nowhere"], 3, "nowhere does not exist"),
                ("play", ["{bag}", "--image-topic", "/nope"], 2, "/nope is not in the bag"),
                ("live", ["nowhere"], 3, "nowhere does not exist"),
                ("live", ["{bag}", "--config", "rgdb"], 2, "did you mean rgbd"),
                ("live", ["{bag}", "--set", "visual.topk=3"], 2, "did you mean visual.top_k"),
                ("live", ["{bag}", "--ground-truth", "nowhere.tum"], 2, "nowhere.tum"),
            )
        ),
        (["replay", "nowhere"], 3, "nowhere"),
        (["replay", "{bag}", "--config", "rgdb"], 2, "did you mean rgbd"),
        (["replay", "{bag}", "--set", "visual.top_k=many"], 2, "expected int"),
        (["replay", "{bag}", "--image-topic", "/nope"], 2, "/nope"),
        (["replay", "{bag}", "--ground-truth", "nowhere.tum"], 2, "nowhere.tum"),
        (["convert", "7scenes", "nowhere", "-o", "{tmp}/x"], 3, "nowhere"),
        (["doctor", "{tmp}"], 3, "is not a bag"),
    ],
)
def test_mistakes_get_one_line_and_a_code(arguments, code, words, bag, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", "")
    assert main([argument.format(bag=bag, tmp=tmp_path) for argument in arguments]) == code
    shown = capsys.readouterr()
    assert words in shown.err
    assert "Traceback" not in shown.err
    assert not list(tmp_path.iterdir())


def test_a_bag_of_one_frame_has_nothing_to_pair(views, tmp_path: Path, capsys) -> None:
    bag = write_views(tmp_path / "one", views[:1])
    assert main(["replay", str(bag), "--output", str(tmp_path / "out")]) == 5
    assert "vigg doctor" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
