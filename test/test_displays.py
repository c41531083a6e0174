# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The displays for RViz and Foxglove show topics that the node has, with fitting types and qualities."""

import json
import re
from pathlib import Path
from typing import Any

import yaml

CONFIG = Path(__file__).parents[1] / "config"

OUTPUTS = {
    "/registrar/pose": "Pose",
    "/registrar/relative_pose": "PoseWithCovariance",
    "/registrar/odom": "Odometry",
    "/registrar/path": "Path",
    "/registrar/keyframe_points": "PointCloud2",
    "/registrar/matches": "Image",
    "/registrar/status": "",
    "/diagnostics": "",
}
"""The node's outputs and RViz' name for their type."""

LATCHED = {"/registrar/path", "/registrar/keyframe_points"}
BEST_EFFORT = {"/registrar/matches"}


def test_rviz_shows_the_outputs_in_the_odometry_frame() -> None:
    manager = yaml.safe_load((CONFIG / "registrar.rviz").read_text())["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == "odom"
    shown = {one["Topic"]["Value"]: one for one in manager["Displays"] if "Topic" in one}
    assert set(shown) == set(OUTPUTS) - {"/registrar/relative_pose", "/registrar/status", "/diagnostics"}
    for topic, display in shown.items():
        assert display["Class"] == f"rviz_default_plugins/{OUTPUTS[topic]}"
        durability = "Transient Local" if topic in LATCHED else "Volatile"
        reliability = "Best Effort" if topic in BEST_EFFORT else "Reliable"
        assert display["Topic"]["Durability Policy"] == durability
        assert display["Topic"]["Reliability Policy"] == reliability
    assert "rviz_default_plugins/TF" in {one["Class"] for one in manager["Displays"]}


def test_foxglove_shows_topics_of_the_node_only_each_panel_in_its_place() -> None:
    layout = json.loads((CONFIG / "registrar.foxglove.json").read_text())
    panels = layout["configById"]
    shown = set(re.findall(r'"(/[a-z_]+(?:/[a-z_]+)?)', json.dumps(panels)))
    assert shown <= set(OUTPUTS)
    assert {"/registrar/matches", "/registrar/status", "/registrar/path", "/diagnostics"} <= shown
    assert sorted(leaves(layout["layout"])) == sorted(panels)
    assert {name.partition("!")[0] for name in panels} >= {"3D", "Image", "Plot", "DiagnosticSummary"}


def leaves(tree: str | dict[str, Any]) -> list[str]:
    return [tree] if isinstance(tree, str) else [*leaves(tree["first"]), *leaves(tree["second"])]
