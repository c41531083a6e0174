# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Options of the command line, and files: what is odd is refused before anything is read, with exit code 2."""

from argparse import Namespace
from pathlib import Path

import pytest

from vigg_ros.bags.reader import BagReader
from vigg_ros.bags.topics import TopicRequest, choose_topics
from vigg_ros.cli.config_arguments import ChosenConfig, choose_config, load_config
from vigg_ros.cli.console import ExitCode
from vigg_ros.cli.main import main
from vigg_ros.registration.config import Config

BAG = Path(__file__).parents[2] / "bags" / "room_rgbd"


RANGE = pytest.mark.hostile("Parameters: NaN or out of range F, or refused at run time with the old value kept")
UNKNOWN = pytest.mark.hostile("Parameters: unknown key F with a suggestion")
CONTRADICTION = pytest.mark.hostile("Parameters: inconsistent set refused as a whole")
REVERSED = ["--set", "geometric.min_range_m=5", "--set", "geometric.max_range_m=4"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        *(
            pytest.param(["--set", f"geometric.max_range_m={value}"], ("max_range_m is", "expected"), marks=RANGE)
            for value in (".nan", ".inf", "-1", "1000000", "true", "'wide'")
        ),
        pytest.param(["--set", "geometric.max_rnage_m=6"], ("did you mean geometric.max_range_m?",), marks=UNKNOWN),
        pytest.param(["--config", "{tmp}/mine.yaml"], ("did you mean visual.top_k?",), marks=UNKNOWN),
        pytest.param(REVERSED, ("min_range_m is 5.0", "max_range_m is 4.0"), marks=CONTRADICTION),
        (["--set", "visual.top_k"], ("visual.top_k", "OPTION=VALUE")),
        (["--set", "visual.top_k=["], ("visual.top_k",)),
        (["--set", "visual.top_k=3=4"], ("visual.top_k",)),
        *((["--config", name], (f"{name} does not exist",)) for name in ("nowhere.yaml", "./rgbd", "nowhere/mine")),
    ],
)
def test_what_is_wrong_stops_the_start_in_one_line(options, words: tuple[str, ...], tmp_path: Path, capsys) -> None:
    (tmp_path / "mine.yaml").write_text("visual:\n  top_q: 3\n")
    output = tmp_path / "out"
    options = [option.format(tmp=tmp_path) for option in options]
    assert main(["replay", str(BAG), "--output", str(output), *options]) == ExitCode.USAGE
    said = capsys.readouterr().err
    assert not output.exists()
    assert said.count("\n") == 1, "one line, no traceback"
    assert all(word in said for word in words), said


@pytest.mark.parametrize("value", ["0.00005", "1e-4", "1.0E-03", "0.001", "1"])
def test_a_printed_configuration_is_read_back(value: str, tmp_path: Path, capsys) -> None:
    assert main(["config", "--set", f"input.depth_scale_m={value}", "--set", "acceptance.enabled=false"]) == 0
    (tmp_path / "mine.yaml").write_text(capsys.readouterr().out)
    config = load_config(Namespace(config=str(tmp_path / "mine.yaml"), set=[]))
    assert config.input.depth_scale_m == float(value)
    assert not config.acceptance.enabled


def test_a_file_does_not_hide_a_preset(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "lidar").write_text("visual:\n  top_k: 7\n")
    monkeypatch.chdir(tmp_path)
    assert load_config(Namespace(config="lidar", set=[])) == Config.preset("lidar")
    assert load_config(Namespace(config="./lidar", set=[])).visual.top_k == 7


def chosen(name: str, config: str | None, *assignments: str) -> ChosenConfig:
    with BagReader(BAG.parent / name) as reader:
        choice = choose_topics(reader.topics, TopicRequest(), encodings=reader.encodings())
        return choose_config(Namespace(config=config, set=list(assignments)), reader, choice)


@pytest.mark.parametrize(("name", "preset"), [("room_rgbd", "rgbd"), ("street_lidar", "lidar")])
def test_without_a_config_the_bag_says_which(name: str, preset: str) -> None:
    found = chosen(name, None, "visual.top_k=77")
    assert found.config == Config.preset(preset).replace({"visual.top_k": 77})
    assert found.source == f"{preset}, by what the bag holds"
    assert found.notes == ()


def test_a_config_is_taken_as_given_with_a_note_where_it_does_not_suit() -> None:
    found = chosen("street_lidar", "rgbd")
    assert found.config == Config.preset("rgbd")
    assert found.source == "rgbd, as asked for"
    (note,) = found.notes
    assert "holds scans that reach far" in note
    assert "--config lidar" in note
    assert chosen("street_lidar", "rgbd", "geometric.voxel_size_m=0.2").notes == ()
    assert chosen("room_rgbd", "rgbd_paper").notes == ()
