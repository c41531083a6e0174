# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What must agree across the files of the package, and the house's sizes."""

import ast
import re
from importlib import import_module, metadata
from pathlib import Path
from xml.etree import ElementTree

import pytest

import vigg_ros

ROOT = Path(__file__).parents[1]
MANIFEST = ElementTree.parse(ROOT / "package.xml").getroot()
MODULES = sorted((ROOT / "vigg_ros").rglob("*.py"))
# Named folders, not the root: below it also lie .venv and colcon's build and install.
FOLDERS = ("vigg_ros", "test", "tools", "examples", "launch", "bags")
SOURCES = sorted([*ROOT.glob("*.py"), *(path for name in FOLDERS for path in (ROOT / name).rglob("*.py"))])

MAX_FILE_LINES = 300
MAX_FUNCTION_LINES = 60


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def setup_keyword(name: str) -> object:
    """The literal value of a keyword of setup() in setup.py."""
    tree = ast.parse((ROOT / "setup.py").read_text())
    keywords = [k for node in ast.walk(tree) if isinstance(node, ast.Call) for k in node.keywords]
    (value,) = [k.value for k in keywords if k.arg == name]
    return ast.literal_eval(value)


CONSOLE_SCRIPTS = [entry.split(" = ") for entry in setup_keyword("entry_points")["console_scripts"]]


def test_the_manifest_is_an_ament_python_package_of_format_3() -> None:
    assert MANIFEST.get("format") == "3"
    assert [MANIFEST.findtext(tag) for tag in ("name", "license", "export/build_type")] == [
        "vigg_ros", "Apache-2.0", "ament_python",
    ]  # fmt: skip
    assert (ROOT / "resource" / "vigg_ros").is_file()
    dependencies = [element.text for element in MANIFEST if element.tag.endswith("depend")]
    assert len(set(dependencies)) == len(dependencies)


def test_the_version_is_the_same_everywhere() -> None:
    version = MANIFEST.findtext("version")
    assert vigg_ros.__version__ == version
    headings = re.findall(r"^## \[(.+?)\]", (ROOT / "CHANGELOG.md").read_text(), flags=re.MULTILINE)
    assert headings[0] in {"Unreleased", version}


def test_the_installed_version_and_commands_are_those_of_the_source() -> None:
    try:
        installed = metadata.distribution("vigg_ros")
    except metadata.PackageNotFoundError:
        pytest.skip("vigg_ros is not installed here; make test and colcon test install it")
    assert installed.version == vigg_ros.__version__
    commands = [[e.name, e.value] for e in installed.entry_points if e.group == "console_scripts"]
    assert sorted(commands) == sorted(CONSOLE_SCRIPTS)


@pytest.mark.parametrize(("command", "target"), CONSOLE_SCRIPTS)
def test_the_target_of_each_command_exists(command: str, target: str) -> None:
    module, _, function = target.partition(":")
    assert callable(getattr(import_module(module), function)), command


@pytest.mark.parametrize("path", SOURCES, ids=name_of)
def test_the_licence_stands_in_the_first_lines(path: Path) -> None:
    head = "\n".join(path.read_text().splitlines()[:4])
    assert "SPDX-FileCopyrightText:" in head
    assert "SPDX-License-Identifier: Apache-2.0" in head


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_a_module_can_be_read_in_one_sitting(path: Path) -> None:
    source = path.read_text()
    assert len(source.splitlines()) <= MAX_FILE_LINES
    functions = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef)]
    assert not [one.name for one in functions if one.end_lineno - one.lineno + 1 > MAX_FUNCTION_LINES]
