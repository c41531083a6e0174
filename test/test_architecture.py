# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The flow has one direction: a room of the package imports only from the rooms before it."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "vigg_ros"

METHOD = {"registration", "acceptance"}
MAY_IMPORT: dict[str, set[str]] = {
    "registration": set(),
    "acceptance": {"registration"},
    "sensors": {"registration"},
    "tracking": {*METHOD, "sensors"},
    "pipeline": {*METHOD, "sensors", "tracking"},
    "messages": {*METHOD, "sensors", "tracking"},  # what leaves as messages: for topics and bags alike
    "bags": {"registration", "sensors", "messages"},  # storage: rosbag2 and ROS 1 files
    "pictures": set(),  # drawing, for reports and for the node
    "report": {*METHOD, "sensors", "tracking", "pipeline", "messages", "bags", "pictures"},
    "node": {*METHOD, "sensors", "tracking", "pipeline", "messages", "pictures"},
    "player": {*METHOD, "sensors", "tracking", "messages", "bags", "report"},
    "vigg_ros": {"pipeline"},  # vigg_ros/__init__.py, on demand: importing the package loads nothing
}
MAY_IMPORT["cli"] = {*MAY_IMPORT} - {"node"}
MAY_IMPORT["bench"] = {*MAY_IMPORT} - {"node"}  # and nothing imports bench: `vigg` finds its commands by name

ABOVE = {"vigg_ros.registration.vigg": {"acceptance"}}
"""The algorithm box composes the method and what decides on its answers."""

MAY_IMPORT_ROS = {"node", "player"}  # player stands in the node's folder: nothing outside it imports ROS
ROS = {"rclpy", "tf2_ros", "std_srvs", "builtin_interfaces", "rcl_interfaces", "cv_bridge"}  # and *_msgs


def room_of(module: str) -> str:
    """vigg_ros.bags.reader -> bags; vigg_ros.pipeline -> pipeline; vigg_ros -> vigg_ros; ...node.player.x -> player."""
    if module.split(".")[1:3] == ["node", "player"]:
        return "player"
    return (module.split(".") + ["vigg_ros"])[1] if "." in module else module


def imported_names(source: str, module: str, *, is_package: bool) -> Iterator[tuple[str, int]]:
    """Absolute dotted names that the source imports anywhere, in functions too, with their lines."""
    here = module.split(".")
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            up = node.level - is_package
            base = [*here[: len(here) - up]] if node.level else []
            base += node.module.split(".") if node.module else []
            yield from ((".".join([*base, alias.name]), node.lineno) for alias in node.names)


def violations(source: str, module: str, *, is_package: bool = False) -> list[str]:
    """What the source of this module imports against the house's order, one sentence each."""
    room = room_of(module)
    if room not in MAY_IMPORT:
        return [f"{module}: {room} is not a room of the house; give it its place in MAY_IMPORT"]
    allowed = {room, *MAY_IMPORT[room], *ABOVE.get(module, ())}
    found = []
    for name, line in imported_names(source, module, is_package=is_package):
        top, *rest = name.split(".")
        other = room_of(name) if rest else ""
        if (top in ROS or top.endswith("_msgs")) and room not in MAY_IMPORT_ROS:
            found.append(f"{module}:{line} imports {name}; only node may import ROS")
        if top == "rosbags" and room != "bags":
            found.append(f"{module}:{line} imports {name}; only bags may import rosbags")
        if top == "vigg_ros" and other in MAY_IMPORT and other not in allowed:
            found.append(f"{module}:{line}: {room} imports {name}, against the flow")
    return found


def module_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=module_of)
def test_imports_follow_the_flow(path: Path) -> None:
    found = violations(path.read_text(), module_of(path), is_package=path.name == "__init__.py")
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("module", "source", "count"),
    [
        ("registration.cliques", "from vigg_ros.acceptance import checks", 1),
        ("registration.vigg", "import numpy\nfrom vigg_ros.acceptance.checks import judge", 0),
        ("registration.vigg", "def f():\n    import vigg_ros.bags.reader", 1),
        ("registration.kernels.zone", "from ...tracking import pairing", 1),
        ("sensors.colour_image", "from sensor_msgs.msg import Image", 1),
        ("tracking.registrar", "import tf2_ros", 1),
        ("bags.reader", "import rosbags.rosbag2", 0),
        ("cli.replay", "from rosbags.highlevel import AnyReader\nfrom vigg_ros.report import page", 1),
        ("node.scheduler", "import rclpy\nfrom vigg_ros import pipeline\nfrom vigg_ros.bags import writer", 1),
        ("node.player.live", "from vigg_ros.cli.console import UsageError", 1),
        ("cli.main", "from vigg_ros import node\nfrom vigg_ros.bench import methods", 2),
        ("bench.worlds.render", "from ...registration import Camera\nfrom vigg_ros.cli.console import table", 0),
        ("utils", "", 1),
    ],
)
def test_an_import_against_the_flow_is_found_and_one_along_it_let_through(module: str, source: str, count: int) -> None:
    assert len(violations(source, f"vigg_ros.{module}")) == count


def test_relative_imports_of_a_package_are_resolved_from_the_package_itself() -> None:
    source = "from .reader import Reader\nfrom ..report import page"
    assert violations(source, "vigg_ros.bags", is_package=True) == [
        "vigg_ros.bags:2: bags imports vigg_ros.report.page, against the flow"
    ]


def test_no_two_modules_and_no_two_classes_have_one_name() -> None:
    places: dict[str, list[str]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        if not path.name.startswith("__"):
            places.setdefault(path.name, []).append(module_of(path))
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ClassDef):
                places.setdefault(node.name, []).append(f"{module_of(path)}:{node.lineno}")
    repeated = {name: found for name, found in places.items() if len(found) > 1}
    assert not repeated
