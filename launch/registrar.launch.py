# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Starts the registrar node for a sensor or a bag.

    ros2 launch vigg_ros registrar.launch.py sensor:=realsense
    ros2 launch vigg_ros registrar.launch.py sensor:=ouster camera:=/camera     (or sensor:=velodyne)
    ros2 launch vigg_ros registrar.launch.py bag:=/path/to/bag rviz:=true

The drivers of the sensors are not started; docs/node.md says with which options they fit.
"""

from __future__ import annotations

import os
import sys

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, LogInfo, OpaqueFunction, SetEnvironmentVariable
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from vigg_ros.bags.reader import BagReader
from vigg_ros.cli.node_command import NodeArguments, arguments_for_bag
from vigg_ros.node.player.dds_profile import VARIABLE, find_shared_file, set_profile

SENSORS = {
    "realsense": {
        "camera": "/camera/camera",
        "image": "{camera}/color/image_raw",
        "camera_info": "{camera}/color/camera_info",
        "depth": "{camera}/aligned_depth_to_color/image_raw",
    },
    "ouster": {
        "camera": "/camera",
        "image": "{camera}/image_raw",
        "camera_info": "{camera}/camera_info",
        "points": "/ouster/points",
    },
    "velodyne": {
        "camera": "/camera",
        "image": "{camera}/image_raw",
        "camera_info": "{camera}/camera_info",
        "points": "/velodyne_points",
    },
}
"""Topics as the drivers' own launch files name them; {camera} is the camera's namespace."""

INPUTS = {"image": "rgb/image", "camera_info": "rgb/camera_info", "depth": "depth/image", "points": "points"}
"""The launch argument of each topic, and the node's own name of it."""

TEXTS = ("base_frame", "odom_frame", "extrinsics", "image_transport", "config")
"""Parameters of the node that are passed on as they are; empty leaves the node's default."""

ARGUMENTS = {
    "sensor": ("realsense", f"one of {', '.join(SENSORS)}: which topics to use"),
    "bag": ("", "play this bag instead; its topics and extrinsics are found in it"),
    "rate": ("1.0", "speed at which the bag is played"),
    "camera": ("", "namespace of the camera's topics (default: by the sensor)"),
    "image": ("", "topic of the colour images (default: by the sensor)"),
    "camera_info": ("", "topic of their calibration"),
    "depth": ("", "topic of depth images aligned to the colour images; chooses geometry depth"),
    "points": ("", "topic of clouds; chooses geometry points"),
    "config": ("", "preset of the method's options, rgbd or lidar, or a YAML file (default: by the sensor)"),
    "params_file": ("", "ROS parameter file for the node"),
    "base_frame": ("", "frame whose pose is published, such as base_link (default: the sensor's)"),
    "odom_frame": ("", "frame in which poses are given (default: odom)"),
    "publish_tf": ("false", "true to publish odom_frame to base_frame on /tf"),
    "extrinsics": ("", "where the camera stands, x y z qx qy qz qw, if TF does not say so"),
    "image_transport": ("", "raw or compressed (default: what is published)"),
    "max_rate": ("0.0", "frames per second at most; 0 for all"),
    "namespace": ("", "namespace of the node"),
    "use_sim_time": ("false", "true to take the time from /clock, which something else publishes"),
    "rviz": ("false", "true to start RViz with config/registrar.rviz"),
}


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch` asks for."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])


def start(context: LaunchContext) -> list[object]:
    """The actions, now that the arguments are known."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    found = of_bag(given["bag"]) if given["bag"] else of_sensor(given["sensor"], given["camera"])
    return [*profile(), node(given, found), *player(given), *viewer(given)]


def of_bag(bag: str) -> NodeArguments:
    """What fits the bag; errors name what is missing in it."""
    with BagReader(bag) as reader:
        return arguments_for_bag(reader)


def of_sensor(sensor: str, camera: str) -> NodeArguments:
    """Topics and preset of a sensor."""
    if sensor not in SENSORS:
        raise ValueError(f"sensor:={sensor} is not known; expected one of {', '.join(SENSORS)}")
    topics = dict(SENSORS[sensor])
    default_camera = topics.pop("camera")
    namespace = "/" + (camera or default_camera).strip("/")
    remappings = {INPUTS[name]: topic.format(camera=namespace) for name, topic in topics.items()}
    by_points = "points" in topics
    return NodeArguments(
        remappings, {"geometry": "points" if by_points else "depth", "config": "lidar" if by_points else "rgbd"}
    )


def node(given: dict[str, str], found: NodeArguments) -> Node:
    """The registrar, with what was given over what was found."""
    parameters: dict[str, object] = {**found.parameters}
    parameters |= {name: given[name] for name in TEXTS if given[name]}
    parameters |= {name: given[name].lower() == "true" for name in ("publish_tf", "use_sim_time")}
    parameters["max_rate"] = float(given["max_rate"])
    for argument, geometry in (("depth", "depth"), ("points", "points")):
        if given[argument]:
            parameters["geometry"] = geometry
    remappings = found.remappings | {INPUTS[name]: given[name] for name in INPUTS if given[name]}
    return Node(
        package="vigg_ros",
        executable="registrar",
        name="registrar",
        namespace=given["namespace"],
        output="screen",
        parameters=[parameters, *filter(None, [given["params_file"]])],
        remappings=list(remappings.items()),
    )


def player(given: dict[str, str]) -> list[ExecuteProcess]:
    """The bag, where one was given; it waits for the node."""
    if not given["bag"]:
        return []
    # Not `vigg`: colcon puts executables where no PATH leads.
    command = [sys.executable, "-m", "vigg_ros.cli.main", "play", given["bag"], "--rate", given["rate"]]
    return [ExecuteProcess(cmd=command, output="screen")]


def viewer(given: dict[str, str]) -> list[Node]:
    """RViz, where it was asked for."""
    if given["rviz"].lower() != "true":
        return []
    displays = find_shared_file("config/registrar.rviz")
    return [Node(package="rviz2", executable="rviz2", arguments=["-d", str(displays)] if displays else [])]


def profile() -> list[object]:
    """The Fast DDS profile, unless the user has set one, or why it is not used."""
    environment = dict(os.environ)
    actions: list[object] = [LogInfo(msg=note) for note in set_profile(environment)]
    if VARIABLE in environment and VARIABLE not in os.environ:
        actions.append(SetEnvironmentVariable(VARIABLE, environment[VARIABLE]))
    return actions
