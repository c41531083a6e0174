# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg evaluate``: its parts from the command line to the files they leave."""

import csv
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from vigg_ros.bags.writer import BagWriter
from vigg_ros.bench.worlds import HandheldLoop
from vigg_ros.cli.console import ExitCode
from vigg_ros.cli.main import main
from vigg_ros.messages.pose_messages import encode_pose

ROOM = Path(__file__).parents[2] / "bags" / "room_rgbd"
STREET = ROOM.with_name("street_lidar")


def rows_of(folder: Path, name: str = "pairs") -> list[dict[str, str]]:
    return list(csv.DictReader((folder / f"{name}.csv").read_text().splitlines()))


def evaluate_pairs(folder: Path, output: Path, *more: str) -> int:
    arguments = ["--gaps", "1", "--every", "1", "--output", str(output), *more]
    return main(["evaluate", "pairs", "7scenes", str(folder), *arguments])


def test_pairs_of_a_folder(scene_folder: Path, tmp_path: Path, capsys) -> None:
    output = tmp_path / "out"
    assert evaluate_pairs(scene_folder, output, "--gaps", "1", "2", "--methods", "default", "paper") == ExitCode.OK
    printed = capsys.readouterr().out
    rows = rows_of(output)
    pairs = [("1", "0", "1"), ("1", "1", "2"), ("2", "0", "2")]
    assert [(row["method"], row["group"], row["source"], row["target"]) for row in rows] == [
        (method, *pair) for method in ("default", "paper") for pair in pairs
    ]
    assert all(float(row["translation_error_m"]) < 0.02 and not row["reason"] for row in rows)
    assert [line.split()[:3] for line in printed.splitlines()[3:7]] == [
        ["default", "1", "2"], ["paper", "1", "2"], ["default", "2", "1"], ["paper", "2", "1"],
    ]  # fmt: skip
    summary = json.loads((output / "pairs.json").read_text())
    assert [one["recall"] for one in summary["summaries"]] == [100.0] * 4
    assert summary["limits"]["recall_deg"] == 15
    assert summary["command"].startswith("vigg")
    assert cv2.imread(str(output / "pairs.png")) is not None
    # The same once more: nothing is run again, so that even the times are equal.
    (scene_folder / "frame-000001.depth.png").write_bytes(b"cut")
    assert evaluate_pairs(scene_folder, output, "--gaps", "1", "2", "--methods", "default", "paper") == ExitCode.OK
    assert rows_of(output) == rows
    # Without an output folder nothing is kept.
    assert main(["evaluate", "pairs", "7scenes", str(scene_folder), "--gaps", "2", "--every", "1"]) == ExitCode.OK
    assert "without an answer" not in capsys.readouterr().out


def test_frames_that_cannot_be_read_or_used_cost_their_pairs_alone(scene_folder: Path, tmp_path: Path, capsys) -> None:
    (scene_folder / "frame-000002.depth.png").write_bytes(b"cut")
    assert evaluate_pairs(scene_folder, tmp_path / "unreadable") == ExitCode.OK
    assert [row["reason"] for row in rows_of(tmp_path / "unreadable")] == ["", "UNREADABLE"]
    assert "without an answer, default: UNREADABLE 1" in capsys.readouterr().out
    cv2.imwrite(str(scene_folder / "frame-000002.depth.png"), np.full((60, 80), 1000, np.uint16))
    assert evaluate_pairs(scene_folder, tmp_path / "unusable") == ExitCode.OK
    first, second = (row["reason"] for row in rows_of(tmp_path / "unusable"))
    assert first == ""
    assert second.isupper()
    capsys.readouterr()
    (scene_folder / "frame-000001.depth.png").write_bytes(b"cut")  # of both pairs: the table has no figures
    assert evaluate_pairs(scene_folder, tmp_path / "none") == ExitCode.OK
    assert capsys.readouterr().out.splitlines()[3].split()[-2:] == ["-", "-"]


def test_pairs_of_a_bag(tmp_path: Path) -> None:
    arguments = ["--gaps", "5", "--every", "40", "--output", str(tmp_path / "out")]
    assert main(["evaluate", "pairs", "bag", str(ROOM), *arguments]) == ExitCode.OK
    rows = rows_of(tmp_path / "out")
    assert [(row["source"], row["target"]) for row in rows] == [("0", "5"), ("40", "45")]
    assert all(float(row["translation_error_m"]) < 0.02 for row in rows)


def test_the_preset_follows_from_the_data(tmp_path: Path, capsys) -> None:
    arguments = ["evaluate", "pairs", "bag", str(STREET), "--gaps", "2", "--every", "40"]
    assert main([*arguments, "--output", str(tmp_path / "by itself")]) == ExitCode.OK
    assert "note:" not in capsys.readouterr().err
    assert float(rows_of(tmp_path / "by itself")[0]["translation_error_m"]) < 0.3
    main([*arguments, "--config", "rgbd", "--output", str(tmp_path / "asked for")])
    assert "note: the bag holds scans that reach far, but the configuration is made" in capsys.readouterr().err


def test_what_cannot_be_evaluated_as_asked_is_said(scene_folder: Path, tmp_path: Path, capsys) -> None:
    for arguments, said in (
        (["7scenes", str(scene_folder), "--gaps", "99"], "no pairs of frames with poses at the gaps [99]"),
        (["7scenes", str(scene_folder), "--apart", "50"], "no pairs of frames with poses 50 m apart"),
        (["7scenes", str(scene_folder), "--gaps", "1", "--methods", "magic"], "unknown method 'magic'"),
        (["bag", str(ROOM), "--apart", "1"], "--apart is for data set folders"),
        (["7scenes", str(scene_folder), "--gaps", "1", "--every", "1", "--output", str(ROOM / "metadata.yaml")],
         "cannot be made"),
    ):  # fmt: skip
        assert main(["evaluate", "pairs", *arguments]) == ExitCode.USAGE
        assert said in capsys.readouterr().err


def test_rendered_pairs_are_reported_by_kind_and_by_overlap(tmp_path: Path, capsys) -> None:
    command = ["evaluate", "rendered", "--pairs", "2", "--seed", "5", "--output", str(tmp_path / "out")]
    assert main(command) == ExitCode.OK
    (room,), (street,) = rows_of(tmp_path / "out", "rooms"), rows_of(tmp_path / "out", "streets")
    assert (room["group"], street["group"]) == ("room", "street")
    assert rows_of(tmp_path / "out", "rooms_by_overlap")[0]["group"] == "20% to 45%"
    printed = capsys.readouterr().out
    assert "recall at 5 deg and 60 cm" in printed
    assert "wrong/1000: wrong answers per 1,000 answers" in printed
    rows = rows_of(tmp_path / "out", "reliability")
    assert [(row["group"], row["pairs"]) for row in rows] == [("room", "1"), ("street", "1"), ("all", "2")]
    content = json.loads((tmp_path / "out" / "reliability.json").read_text())
    # The only answer in the room is right: at most 97.5 % are wrong, 1 - p = 2.5 %.
    assert content["reliability"][0]["wrong_per_1000_high"] == pytest.approx(975)
    assert content["reliability"][0]["nees"] == pytest.approx(float(room["nees"]), rel=1e-5)


def test_rendered_kinds_are_chosen_by_name(tmp_path: Path, capsys) -> None:
    command = ["evaluate", "rendered", "--pairs", "1", "--kinds", "small motion", "--output", str(tmp_path)]
    assert main(command) == ExitCode.OK
    assert [row["group"] for row in rows_of(tmp_path, "rooms")] == ["small motion"]
    assert main(["evaluate", "rendered", "--kinds", "room,garden"]) == ExitCode.USAGE
    assert "found kinds garden; expected some of: room, street" in capsys.readouterr().err


def test_all_methods_are_listed(capsys) -> None:
    assert main(["evaluate", "methods"]) == ExitCode.OK
    listed = [line.split()[0] for line in capsys.readouterr().out.splitlines()[2:]]
    assert {"default", "paper", "floor", "kiss-matcher", "baselines", "whole:noise-0.01,"} <= set(listed)


def write_walk(path: Path, *, offset_m: float = 0.0, count: int = 20) -> None:
    """A walk as a TUM file, every second pose lifted by an offset."""
    from scipy.spatial.transform import Rotation

    rows = []
    for i in range(count):
        T = HandheldLoop().T_world_camera(0.1 * i)
        x, y, z = T[:3, 3]
        rows.append((100 + 0.1 * i, x, y, z + offset_m * (i % 2), *Rotation.from_matrix(T[:3, :3]).as_quat()))
    np.savetxt(path, rows, fmt="%.9f")


def test_a_trajectory_comes_with_its_coverage_and_its_alignment(tmp_path: Path, capsys) -> None:
    replay = tmp_path / "replay"
    replay.mkdir()
    write_walk(tmp_path / "truth.txt")
    write_walk(replay / "trajectory.tum", offset_m=0.02, count=11)
    (replay / "frames.csv").write_text("stamp,state\n" + "1,TRACKING\n" * 25)
    command = ["evaluate", "trajectory", str(replay / "trajectory.tum"), str(tmp_path / "truth.txt")]
    assert main([*command, "--json", str(tmp_path / "errors.json")]) == ExitCode.OK
    printed = capsys.readouterr().out
    # 11 of 20 poses at 10 Hz: 1.0 of 1.9 s.
    assert "11 poses of 25 frames received, 11 of them compared; they cover 52.6%" in printed
    assert "ATE after SE(3) alignment of the positions" in printed
    found = json.loads((tmp_path / "errors.json").read_text())
    # Up and down by 2 cm, of which an alignment takes out at most the mean of 1 cm.
    assert 0.009 < found["ate_m"]["rmse"] < 0.0101
    assert found["rpe_m"]["median"] == pytest.approx(0.02, abs=1e-6)
    assert found["frames_received"] == 25


def test_trajectories_of_bags_are_read_by_their_topic(tmp_path: Path, capsys) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        for i in range(20):
            stamp_ns = 100_000_000_000 + 100_000_000 * i
            message = encode_pose(HandheldLoop().T_world_camera(0.1 * i), stamp_ns=stamp_ns, frame_id="odom")
            for topic in ("/a", "/b"):
                writer.write(topic, message, log_ns=stamp_ns)
    write_walk(tmp_path / "truth.tum")
    command = ["evaluate", "trajectory", str(tmp_path / "bag"), str(tmp_path / "truth.tum")]
    assert main(command) == ExitCode.USAGE
    assert "has poses on /a, /b; choose one with --topic" in capsys.readouterr().err
    assert main([*command, "--topic", "/b"]) == ExitCode.OK
    assert "20 poses, 20 of them compared; they cover 100.0%" in capsys.readouterr().out
    assert main([*command, "--topic", "/c"]) == ExitCode.USAGE
    assert "--topic /c has no poses" in capsys.readouterr().err
    assert main(["evaluate", "trajectory", "missing.tum", str(tmp_path / "truth.tum")]) == ExitCode.UNREADABLE
