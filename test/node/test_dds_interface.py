# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The topics and services of the running node are those of docs/node.md."""

import re

from vigg_ros_testing.registrar_process import ROOT, parameters
from vigg_ros_testing.ros_peer import Peer

OF_EVERY_NODE = {"/rosout", "/parameter_events"}


def documented(section: str) -> dict[str, tuple[str, str]]:
    """Names of a table of docs/node.md with the two cells behind them."""
    page = (ROOT / "docs" / "node.md").read_text()
    (found,) = re.findall(rf"{section}\n\|---.*?\n((?:\|.*\n)+)", page)
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in found.splitlines()]
    return {row[0].strip("`"): (row[1], row[2]) for row in rows}


def full(name: str) -> str:
    """The name as the graph has it."""
    return name.replace("~", "/registrar") if name.startswith(("~", "/")) else f"/{name}"


def short(types: list[str]) -> str:
    return types[0].replace("/msg/", "/").replace("/srv/", "/")


def subscribed(peer: Peer, name: str) -> dict[str, list[str]]:
    """The topics of a node with their types."""
    return dict(peer.node.get_subscriber_names_and_types_by_node(name, "/"))


def test_published_topics_have_the_documented_types_and_qos(node, peer):
    table = documented(r"\| topic \| type \| QoS \| meaning \|")
    found = peer.node.get_publisher_names_and_types_by_node("registrar", "/")
    actual = {name: short(types) for name, types in found if name not in OF_EVERY_NODE}
    assert actual == {full(name): kind for name, (kind, _) in table.items() if name != "/tf"}
    for name, (_, qos) in table.items():
        for info in peer.node.get_publishers_info_by_topic(full(name)):
            said = "best effort" if info.qos_profile.reliability.name == "BEST_EFFORT" else "reliable"
            said = "transient local" if info.qos_profile.durability.name == "TRANSIENT_LOCAL" else said
            assert qos.startswith(said)


def test_services_are_documented(node, peer):
    found = peer.node.get_service_names_and_types_by_node("registrar", "/")
    own = {name: short(types) for name, types in found if types[0].startswith("std_srvs/")}
    assert own == {full(name): kind for name, (kind, _) in documented(r"\| service \| type \| what it does \|").items()}


def test_subscribed_topics_are_documented(start, node, peer):
    table = documented(r"\| topic \| type \| notes \|")
    for name, (kinds, _) in table.items():
        if name != "points":
            assert short(subscribed(peer, "registrar")[full(name)]) in kinds
    cloud = start(*parameters(extrinsics="0 0 0 0 0 0 1"), "-r", "__node:=cloud").wait_until_ready()
    peer.wait(lambda: "cloud" in peer.node.get_node_names(), "the other node")
    points = peer.wait(lambda: subscribed(peer, "cloud").get("/points"), "a subscription of points")
    assert short(points) == table["points"][0]
    assert "/depth/image" not in subscribed(peer, "cloud")
    assert cloud.stop()[0] == 0
