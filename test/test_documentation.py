# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the documentation shows is what the code does."""

import re
from pathlib import Path

import numpy as np
import pytest

from vigg_ros.bench.worlds import HandheldLoop
from vigg_ros.cli.main import COMMANDS
from vigg_ros.cli.show_config import commented_yaml
from vigg_ros.registration import Config
from vigg_ros.registration.rigid import angle_rad, inverse

ROOT = Path(__file__).parents[1]


def test_the_example_of_the_readme_registers_its_two_frames(capsys: pytest.CaptureFixture[str]) -> None:
    example = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    assert example is not None
    names: dict[str, object] = {}
    exec(compile(example[1], "README.md", "exec"), names)
    assert "0.96" in capsys.readouterr().out
    path = HandheldLoop()
    T_truth = inverse(path.T_world_camera(0.0)) @ path.T_world_camera(0.5)
    T_answer = names["outcome"].T_target_source  # type: ignore[attr-defined]
    # Rendered without noise; what is left is the voxel grid's, far below its 25 mm.
    assert np.linalg.norm(T_answer[:3, 3] - T_truth[:3, 3]) < 0.005
    assert np.rad2deg(angle_rad(T_truth[:3, :3].T @ T_answer[:3, :3])) < 0.2


@pytest.mark.parametrize("name", ["rgbd", "lidar"])
def test_configuration_files_are_the_presets(name: str) -> None:
    path = ROOT / "config" / f"{name}.yaml"
    assert path.read_text().endswith(commented_yaml(Config.preset(name))), (
        f"{path} is out of date; write it again with: vigg config --config {name}"
    )
    assert Config.load(path) == Config.preset(name)


def test_the_readme_names_every_command_and_what_make_offers() -> None:
    page = (ROOT / "README.md").read_text()
    assert [name for name in COMMANDS if f"vigg {name} " not in page] == []
    targets = re.findall(r"^([a-z-]+):.*##", (ROOT / "Makefile").read_text(), re.MULTILINE)
    listed = re.findall(r"^make ([a-z-]+) +#", page, re.MULTILINE)
    # help lists the others, and trials is for who works on the method.
    assert set(targets) - set(listed) == {"help", "trials"}
    assert set(listed) <= set(targets)


def test_links_between_pages_lead_somewhere() -> None:
    for page in [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]:
        for link in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
            assert (page.parent / link).exists(), f"{page.name} links to {link}"
