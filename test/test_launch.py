# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The launch file, with stand-ins for launch and launch_ros: those are in no wheel, only in a ROS installation.

The stand-ins record what is made; whether ROS does with it what is meant is not tested here.
"""

import runpy
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from vigg_ros.node.player import dds_profile
from vigg_ros.node.settings import Settings

ROOT = Path(__file__).parents[1]
STREET = str(ROOT / "bags" / "street_lidar")
PROFILE = "FASTRTPS_DEFAULT_PROFILES_FILE"


def recorder(kind: str) -> Callable[..., SimpleNamespace]:
    """Makes any action: its kind, and what it was made with."""
    return lambda *positional, **keywords: SimpleNamespace(kind=kind, positional=positional, **keywords)


@pytest.fixture
def launch_file(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    actions = ("DeclareLaunchArgument", "ExecuteProcess", "LogInfo", "OpaqueFunction", "SetEnvironmentVariable")
    stand_ins: dict[str, dict[str, Any]] = {
        "launch": {"LaunchContext": dict, "LaunchDescription": list},
        "launch.actions": {kind: recorder(kind) for kind in actions},
        "launch.substitutions": {
            "LaunchConfiguration": lambda name: SimpleNamespace(perform=lambda context: context[name])
        },
        "launch_ros": {},
        "launch_ros.actions": {"Node": recorder("Node")},
    }
    for name, contents in stand_ins.items():
        stand_in = ModuleType(name)
        stand_in.__dict__.update(contents)
        monkeypatch.setitem(sys.modules, name, stand_in)
    monkeypatch.delenv(PROFILE, raising=False)
    module = ModuleType("registrar_launch")
    module.__dict__.update(runpy.run_path(str(ROOT / "launch" / "registrar.launch.py")))
    return module


def started(launch_file: ModuleType, **given: str) -> list[SimpleNamespace]:
    """The actions for these arguments, the others at their defaults."""
    *declared, opaque = launch_file.generate_launch_description()
    context = {action.positional[0]: action.default_value for action in declared}
    assert set(given) <= set(context)
    return opaque.function(context | given)


def node_of(actions: list[SimpleNamespace]) -> tuple[dict[str, str], dict[str, Any]]:
    """Remappings and parameters of the registrar."""
    (node,) = [action for action in actions if action.kind == "Node" and action.executable == "registrar"]
    assert (node.package, node.name) == ("vigg_ros", "registrar")
    return dict(node.remappings), node.parameters[0]


def test_there_are_at_most_20_arguments_and_each_is_explained(launch_file: ModuleType) -> None:
    *declared, _ = launch_file.generate_launch_description()
    assert len(declared) <= 20
    assert all(action.description for action in declared)


REALSENSE = {
    "rgb/image": "/camera/camera/color/image_raw",
    "rgb/camera_info": "/camera/camera/color/camera_info",
    "depth/image": "/camera/camera/aligned_depth_to_color/image_raw",
}
FRONT = {"rgb/image": "/front/image_raw", "rgb/camera_info": "/front/camera_info"}


@pytest.mark.parametrize(
    ("arguments", "topics", "geometry", "config"),
    [
        ({"sensor": "realsense"}, REALSENSE, "depth", "rgbd"),
        ({"sensor": "ouster", "camera": "front/"}, {**FRONT, "points": "/ouster/points"}, "points", "lidar"),
        ({"sensor": "velodyne", "camera": "front/"}, {**FRONT, "points": "/velodyne_points"}, "points", "lidar"),
    ],
)
def test_a_sensor_takes_one_line(launch_file, arguments, topics, geometry, config) -> None:
    remappings, parameters = node_of(started(launch_file, **arguments))
    assert remappings == topics
    assert (parameters["geometry"], parameters["config"]) == (geometry, config)


def test_a_bag_takes_one_line_and_brings_topics_and_extrinsics(launch_file: ModuleType) -> None:
    actions = started(launch_file, bag=STREET, rate="0.5")
    remappings, parameters = node_of(actions)
    assert remappings["points"] == "/lidar/points"
    assert parameters["extrinsics"].startswith("[0.6")
    (player,) = [action for action in actions if action.kind == "ExecuteProcess"]
    assert player.cmd == [sys.executable, "-m", "vigg_ros.cli.main", "play", STREET, "--rate", "0.5"]


def test_what_is_given_counts_more_than_what_is_found(launch_file: ModuleType) -> None:
    given = {"points": "/cloud", "config": "my.yaml", "base_frame": "base_link", "publish_tf": "True", "max_rate": "5"}
    actions = started(launch_file, **given, params_file="/my/params.yaml", namespace="robot")
    remappings, parameters = node_of(actions)
    assert remappings["points"] == "/cloud"
    expected = {"config": "my.yaml", "base_frame": "base_link", "publish_tf": True, "max_rate": 5.0}
    assert expected.items() <= parameters.items()
    assert parameters["geometry"] == "points"
    assert "odom_frame" not in parameters, "what is not given is left to the node"
    (node,) = [action for action in actions if action.kind == "Node"]
    assert node.parameters[1:] == ["/my/params.yaml"]
    assert node.namespace == "robot"


def test_all_parameters_are_those_of_the_node(launch_file: ModuleType) -> None:
    given = {"base_frame": "base", "odom_frame": "start", "image_transport": "raw", "extrinsics": "0 0 1 0 0 0 1"}
    _, parameters = node_of(started(launch_file, bag=STREET, config="lidar", **given))
    assert set(launch_file.TEXTS) <= set(parameters)
    options = Settings.resolve(parameters).options
    assert {name: getattr(options, name) for name in given} == given


def test_an_unknown_sensor_is_refused_with_those_that_are_known(launch_file: ModuleType) -> None:
    with pytest.raises(ValueError, match="expected one of realsense, ouster, velodyne"):
        started(launch_file, sensor="kinect")


def test_the_dds_profile_is_set_where_none_is(launch_file: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dds_profile, "NEEDED_MB", 0)
    first, *_ = started(launch_file)
    assert first.kind == "SetEnvironmentVariable"
    assert first.positional == (PROFILE, str(ROOT / "config" / "fastdds_shm.xml"))
    monkeypatch.setenv(PROFILE, "/etc/mine.xml")
    assert "SetEnvironmentVariable" not in {action.kind for action in started(launch_file)}


def test_rviz_comes_with_our_displays(launch_file: ModuleType) -> None:
    *_, viewer = started(launch_file, rviz="true")
    assert (viewer.package, viewer.executable) == ("rviz2", "rviz2")
    assert viewer.arguments == ["-d", str(ROOT / "config" / "registrar.rviz")]
