# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What stands around the package for those who work on it agrees with the package."""

import importlib
import importlib.util
import re
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

ROOT = Path(__file__).parents[1]

import site_pages  # noqa: E402

VERSION = ElementTree.parse(ROOT / "package.xml").findtext("version")
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "bags").glob("*.md")]
PACKAGE = ROOT / "vigg_ros"
ROOMS = {path.name for path in PACKAGE.iterdir() if path.is_dir()}
OLD_PAGES = {"CHANGELOG.md"}
"""Which tell of modules that are gone."""


class MkdocsLoader(yaml.SafeLoader):
    """mkdocs.yml names a Python function by a tag of its own."""


MkdocsLoader.add_multi_constructor("tag:yaml.org,2002:python/", lambda loader, suffix, node: suffix)


def settings(name: str) -> dict[str, object]:
    loaded = yaml.load((ROOT / name).read_text(encoding="utf-8"), Loader=MkdocsLoader)
    assert isinstance(loaded, dict)
    return loaded


def test_the_citation_has_the_version_and_licence_of_the_package() -> None:
    citation = settings("CITATION.cff")
    assert citation["version"] == VERSION
    assert citation["license"] == "Apache-2.0"


def test_a_release_reads_the_version_as_we_do() -> None:
    steps = (ROOT / ".github" / "workflows" / "release.yml").read_text(encoding="utf-8")
    command = re.search(r"version=\$\((sed .*)\)", steps)
    assert command is not None
    printed = subprocess.run(command[1], shell=True, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert printed.strip() == VERSION


@pytest.mark.parametrize("path", sorted((ROOT / ".github").rglob("*.yml")), ids=lambda path: path.name)
def test_settings_of_github_can_be_read(path: Path) -> None:
    assert settings(str(path.relative_to(ROOT)))


def test_hooks_run_what_make_lint_runs() -> None:
    (local,) = (one for one in settings(".pre-commit-config.yaml")["repos"] if one["repo"] == "local")  # type: ignore[attr-defined]
    hooks = [hook["entry"] for hook in local["hooks"]]
    lint = (ROOT / "Makefile").read_text(encoding="utf-8").partition("\nlint:")[2].partition("\n\n")[0]
    tools = re.findall(r"python -m (\w+)", lint)
    assert len(tools) == len(hooks)
    assert all(any(f"-m {tool}" in entry for entry in hooks) for tool in tools)


def test_the_site_has_every_page() -> None:
    pages = {next(iter(entry.values())) for entry in settings("mkdocs.yml")["nav"]}  # type: ignore[attr-defined]
    written = {path.name for path in (ROOT / "docs").glob("*.md")}
    assert pages == written | set(site_pages.ROOT_PAGES.values())


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_modules_that_a_page_names_exist(page: Path) -> None:
    if page.name in OLD_PAGES:
        return
    text = page.read_text(encoding="utf-8").partition("### What it was in the first round")
    told = text[0] + text[2].partition("\n## ")[2]  # what stands between tells of modules that are gone
    dotted = set(re.findall(r"vigg_ros(?:\.[a-z_]+)+", told))
    files = set(re.findall(rf"`((?:{'|'.join(ROOMS)})/[\w/]+\.py)`", told))
    assert [name for name in dotted if not resolves(name)] == []
    assert [name for name in files if not (PACKAGE / name).is_file()] == []


def resolves(name: str) -> bool:
    """Whether there is a module of this name, or a module with an attribute of the last one."""
    parent, _, last = name.rpartition(".")
    try:
        if importlib.util.find_spec(name) is not None:
            return True
    except ModuleNotFoundError:
        return False
    return hasattr(importlib.import_module(parent), last)


@pytest.mark.parametrize(
    ("markdown", "source", "expected"),
    [
        ("[node](docs/node.md)", "README.md", "[node](node.md)"),
        ("[a](docs/node.md#topics)", "README.md", "[a](node.md#topics)"),
        ("[how](CONTRIBUTING.md)", "README.md", "[how](CONTRIBUTING.md)"),
        ("[home](../README.md)", "docs/node.md", "[home](index.md)"),
        ("[data](data.md#stamps)", "docs/node.md", "[data](data.md#stamps)"),
        ("![a room](docs/images/a.jpg)", "README.md", "![a room](images/a.jpg)"),
        ("[code](../vigg_ros/pipeline.py)", "docs/method.md", "code"),
        ("[web](https://example.org)", "README.md", "[web](https://example.org)"),
    ],
)
def test_links_lead_to_the_pages_of_the_site(markdown: str, source: str, expected: str) -> None:
    assert site_pages.site_links(markdown, source, repository="") == expected
    if expected == "code":  # a file leads into the repository where that is known
        known = site_pages.site_links(markdown, source, repository="https://example.org/r/")
        assert known == "[code](https://example.org/r/blob/main/vigg_ros/pipeline.py)"
