# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes for tests. Without rclpy they are skipped."""


import pytest

from vigg_ros_testing.registrar_process import HAS_ROS, NO_ROS, NodeProcess, depth_arguments


class WithoutRos(pytest.Module):
    """A module of tests that cannot be imported here."""

    def collect(self):
        """Skip them all, with the reason."""
        pytest.skip(NO_ROS, allow_module_level=True)


def pytest_pycollect_makemodule(module_path, parent):
    """Tests over DDS are skipped where there is no rclpy."""
    if module_path.name.startswith("test_dds_") and not HAS_ROS:
        return WithoutRos.from_parent(parent, path=module_path)
    return None


@pytest.fixture(scope="module")
def start(tmp_path_factory):
    """Starts nodes, and ends those that still run after the tests of the module."""
    started = []

    def begin(*arguments, environment=None):
        log = tmp_path_factory.mktemp("node") / "node.log"
        started.append(NodeProcess(arguments, log, environment=environment))
        return started[-1]

    yield begin
    for node in started:
        if node.process.poll() is None:
            node.process.kill()
            node.process.wait()


@pytest.fixture(scope="module")
def peer():
    """The other side of the graph, for the tests of a module."""
    from vigg_ros_testing.ros_peer import Peer

    one = Peer()
    yield one
    one.close()


@pytest.fixture(scope="module")
def shared_node(start):
    """A node for RGB-D frames that the tests of a module share; each begins with a reset."""
    return start(*depth_arguments()).wait_until_ready()


@pytest.fixture
def node(shared_node, peer):
    """The shared node, with nothing left of the test before."""
    peer.begin_anew()
    yield shared_node
    peer.withdraw()
