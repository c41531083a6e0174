# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the documentation shows is what the code does: tables, examples, names and links."""

import re
from pathlib import Path

import numpy as np
import pytest

from vigg_ros.acceptance.checks import CHECKS
from vigg_ros.bench.datasets.convert import LAYOUTS
from vigg_ros.bench.worlds import HandheldLoop
from vigg_ros.cli.console import ExitCode
from vigg_ros.cli.main import COMMANDS
from vigg_ros.cli.show_config import commented_yaml
from vigg_ros.registration import Config, Reason
from vigg_ros.registration.rigid import angle_rad, inverse
from vigg_ros.report.replay_files import write_frames
from vigg_ros.tracking import FrameResult, State

ROOT = Path(__file__).parents[1]

import checks_tables  # noqa: E402
import columns_table  # noqa: E402
import docs_tables  # noqa: E402
import hostile_table  # noqa: E402
import readme_table  # noqa: E402
import refusal_table  # noqa: E402


@pytest.mark.parametrize("page", docs_tables.PAGES)
def test_the_tables_are_up_to_date(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    assert docs_tables.updated(page, text) == text, "run: python tools/docs_tables.py"


def test_every_reason_is_explained_and_every_limit_of_a_check_is_listed() -> None:
    table = checks_tables.reasons()
    assert all(f"| `{reason.value}` |" in table for reason in Reason)
    named = {name for check in CHECKS for name in check.limit_text.split(", ") if name.isupper()}
    assert named
    assert all(f"| `{name}` |" in checks_tables.limits() for name in named)


def test_a_check_is_shown_with_its_limit_in_both_presets() -> None:
    row = "| `DEGENERATE` | `motion_sigma_m` | at most 0.1 (lidar: 0.6) | `cliques.inlier_threshold_m` |"
    assert row in checks_tables.checks().splitlines()


def test_the_columns_are_those_of_a_file(tmp_path: Path) -> None:
    write_frames([FrameResult(1, 0, State.LOST, timings_ms={"cliques": 1.0})], tmp_path / "frames.csv")
    written = (tmp_path / "frames.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    shown = re.findall(r"^\| `(\w+)(?:\.\.\.)?` \|", columns_table.table(), re.MULTILINE)
    assert shown == [re.sub("^ms_cliques$", "ms_", name) for name in written]


def test_the_figures_of_the_readme_are_those_of_the_results() -> None:
    page = (
        "<!-- generated: rendered -->\n| rooms | room (4 pairs) | street (2 pairs) | wrong |\n|---|---|---|---|\n"
        "| `paper` | 9 / 9 / 9 | 9 / 9 / 9 | 9 |\n| `default` | 0.07 / 0.30 / 75.0 | - / - / 0 | 1 |\n"
        "<!-- end: rendered -->\n<!-- generated: rendered failures -->\n- room, source 1, target 2: 0.1 deg, 120 cm\n"
        "<!-- end: rendered failures -->\n"
    )
    others = "".join(f"<!-- generated: {name} -->\n<!-- end: {name} -->\n" for name in ("kitchen", "kitti"))
    rows = readme_table.table(page + others).splitlines()
    assert "| rendered: furnished rooms | 4 | 0.07 | 0.30 | 75.0 % | 1 |" in rows
    assert "| rendered: streets, camera and LiDAR | 2 | - | - | 0 % | 0 |" in rows
    assert "not measured" in next(row for row in rows if "KITTI" in row)


def test_every_mark_names_a_row_of_the_list() -> None:
    unknown = {row: tests for row, tests in hostile_table.marked_tests().items() if row not in hostile_table.rows()}
    assert not unknown
    assert len(hostile_table.rows()) == len(set(hostile_table.rows()))


def test_marks_are_those_that_pytest_sees(request: pytest.FixtureRequest) -> None:
    """Reading the source finds what importing it gives, for all tests collected in this run."""
    read = {(file, name, row) for row, tests in hostile_table.marked_tests().items() for file, name in tests}
    seen = {
        (str(item.path.relative_to(ROOT / "test")), item.originalname, mark.args[0])
        for item in request.session.items
        for mark in item.iter_markers("hostile")
    }
    assert seen <= read


@pytest.mark.parametrize(
    "source",
    [
        '@pytest.mark.hostile("A: b")\ndef test_it(): ...',
        'ROW = pytest.mark.hostile("A: b")\n@ROW\ndef test_it(): ...',
        'TEXT = "A: b"\n@pytest.mark.hostile(TEXT)\ndef test_it(): ...',
        'CASES = [pytest.param(1, marks=pytest.mark.hostile("A: " "b"))]\n'
        '@pytest.mark.parametrize("x", CASES)\ndef test_it(x): ...',
    ],
)
def test_a_mark_is_found_wherever_it_stands(source: str) -> None:
    assert list(hostile_table.marks_in(source)) == [("test_it", "A: b")]


def test_a_page_without_markers_is_an_error() -> None:
    with pytest.raises(ValueError, match="needs the markers"):
        docs_tables.updated("docs/data.md", "# Data\n")


def test_every_code_of_the_source_is_in_the_table() -> None:
    documented = set(re.findall(r"^\| `([A-Z_0-9]+)` \|", refusal_table.table(), re.MULTILINE))
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "vigg_ros" / "sensors").glob("*.py")]
    # Every text in capitals with an underscore, however it is used: a code that a new helper raises is found too.
    written = {code for source in sources for code in re.findall(r'"([A-Z][A-Z0-9]*(?:_[A-Z0-9]+)+)"', source)}
    assert written - {"MAX_PIXELS", "MAX_POINTS", "MAX_RANGE_M"} <= documented


def test_every_exit_code_and_layout_is_on_the_page() -> None:
    text = (ROOT / "docs" / "data.md").read_text(encoding="utf-8")
    assert all(f"\n| {int(code)} | " in text for code in ExitCode)
    assert all(f"`{layout}`" in text for layout in LAYOUTS)


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
    assert set(targets) - set(listed) == {"help"}  # it lists the others
    assert set(listed) <= set(targets)


def test_links_between_pages_lead_somewhere() -> None:
    for page in [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]:
        for link in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
            assert (page.parent / link).exists(), f"{page.name} links to {link}"
