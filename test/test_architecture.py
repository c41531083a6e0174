# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The flow has one direction: a wing of the package imports only from the wings before it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "vigg_ros"

FLOW = ("registration", "tracking", "messages", "bags", "evaluation")
MAY_IMPORT = {wing: set(FLOW[:place]) for place, wing in enumerate(FLOW)} | {
    "worlds": {"registration"},  # rendered worlds: a source of frames, beside the flow
    "pictures": set(),  # drawing, for reports and for the node
    "replay": {*FLOW, "pictures"},  # recordings through the flow, and reports about them
    "player": {*FLOW, "replay"},  # recordings over DDS, and what a node answers
    "commands": {*FLOW, "worlds", "pictures", "replay", "player"},
    "cli": {*FLOW, "worlds", "replay", "commands"},
    "online": {"registration", "tracking", "messages", "pictures"},  # what a node does, without ROS
    "node": {"registration", "tracking", "messages", "online"},  # the ROS shell around online
    "vigg_ros": set(),  # vigg_ros/__init__.py: importing the package loads nothing else
}
MAY_IMPORT["evaluation"].add("worlds")

MAY_IMPORT_ROS = {"node", "player"}  # player stands in the node's folder: nothing outside it imports ROS
ROS = {"rclpy", "tf2_ros", "std_srvs", "builtin_interfaces", "rcl_interfaces", "cv_bridge"}  # and *_msgs


def wing_of(module: str) -> str:
    """vigg_ros.bags.reader -> bags; vigg_ros.cli -> cli; vigg_ros -> vigg_ros; vigg_ros.node.player -> player."""
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
    wing = wing_of(module)
    if wing not in MAY_IMPORT:
        return [f"{module}: {wing} is not a wing of the house; give it its place in MAY_IMPORT"]
    found = []
    for name, line in imported_names(source, module, is_package=is_package):
        top, *rest = name.split(".")
        other = wing_of(name) if rest else ""
        if (top in ROS or top.endswith("_msgs")) and wing not in MAY_IMPORT_ROS:
            found.append(f"{module}:{line} imports {name}; only node may import ROS")
        if top == "rosbags" and wing != "bags":
            found.append(f"{module}:{line} imports {name}; only bags may import rosbags")
        if top == "vigg_ros" and other in MAY_IMPORT and other not in {wing, *MAY_IMPORT[wing]}:
            found.append(f"{module}:{line}: {wing} imports {name}, against the flow")
    return found


def module_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=module_of)
def test_imports_follow_the_flow(path: Path) -> None:
    found = violations(path.read_text(), module_of(path), is_package=path.name == "__init__.py")
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("vigg_ros.registration.vigg", "from vigg_ros.tracking import Registrar"),
        ("vigg_ros.registration.vigg", "def f():\n    import vigg_ros.bags.reader"),
        ("vigg_ros.registration.vigg", "from vigg_ros import worlds"),
        ("vigg_ros.registration.kernels.zone", "from ...tracking import pairing"),
        ("vigg_ros.tracking.pairing", "from ..messages import decode"),
        ("vigg_ros.messages.decode", "from vigg_ros.bags.reader import Reader"),
        ("vigg_ros.bags.reader", "import vigg_ros.evaluation"),
        ("vigg_ros.worlds.render", "import vigg_ros.tracking.pairing"),
        ("vigg_ros.evaluation.report", "from vigg_ros.cli import main"),
        ("vigg_ros.evaluation.metrics", "from vigg_ros.replay.record import Recording"),
        ("vigg_ros.replay.report", "import vigg_ros.commands.console"),
        ("vigg_ros.online.pipeline", "import rclpy"),
        ("vigg_ros.online.pipeline", "from vigg_ros.node import program"),
        ("vigg_ros.online.trail", "from vigg_ros.bags import tum"),
        ("vigg_ros.pictures", "from vigg_ros.registration import Frame"),
        ("vigg_ros.node", "import vigg_ros.cli"),
        ("vigg_ros.node", "from vigg_ros.replay import report"),
        ("vigg_ros.cli", "from vigg_ros import node"),
        ("vigg_ros.cli", "import rclpy"),
        ("vigg_ros.commands.live", "import rclpy"),
        ("vigg_ros.node.player.publishers", "from vigg_ros.commands.console import UsageError"),
        ("vigg_ros.messages.decode", "from sensor_msgs.msg import Image"),
        ("vigg_ros.tracking.registrar", "import tf2_ros"),
        ("vigg_ros.cli", "from rosbags.highlevel import AnyReader"),
        ("vigg_ros.utils", ""),
    ],
)
def test_an_import_against_the_flow_is_found(module: str, source: str) -> None:
    assert len(violations(source, module)) == 1


def test_relative_imports_of_a_package_are_resolved_from_the_package_itself() -> None:
    source = "from .reader import Reader\nfrom ..evaluation import report"
    assert violations(source, "vigg_ros.bags", is_package=True) == [
        "vigg_ros.bags:2: bags imports vigg_ros.evaluation.report, against the flow"
    ]


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("vigg_ros.registration.vigg", "import numpy\nfrom vigg_ros.registration.frame import Frame"),
        ("vigg_ros.evaluation.report", "from vigg_ros.bags import reader\nfrom vigg_ros import __version__"),
        ("vigg_ros.worlds.render", "from ..registration import Camera"),
        ("vigg_ros.bags.reader", "import rosbags.rosbag2"),
        ("vigg_ros.node.inputs", "import rclpy\nfrom sensor_msgs.msg import Image\nfrom vigg_ros import online"),
        ("vigg_ros.online.pictures", "from vigg_ros.pictures import draw_matches"),
        ("vigg_ros.replay.report", "from vigg_ros.evaluation.metrics import measure\nimport vigg_ros.bags.reader"),
        ("vigg_ros.commands.replay", "from vigg_ros.replay import report"),
        ("vigg_ros.cli", "from vigg_ros.evaluation import report"),
    ],
)
def test_an_import_along_the_flow_is_let_through(module: str, source: str) -> None:
    assert violations(source, module) == []
