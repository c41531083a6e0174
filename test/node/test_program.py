# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The executable where there is nothing to run: help, tables, and missing libraries. Needs no ROS."""

import subprocess
import sys

import pytest

from vigg_ros_testing.registrar_process import HAS_ROS, NO_ROS, ROOT


def registrar(*arguments, without):
    """Run it in a process in which a module cannot be imported."""
    code = f"import sys; sys.modules[{without!r}] = None; from vigg_ros.node import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)


def test_without_ros_there_is_one_line_with_both_remedies():
    ended = registrar("--ros-args", "-p", "geometry:=depth", without="rclpy")
    assert ended.returncode == 2
    assert len(ended.stderr.splitlines()) == 1
    assert "Source a ROS 2 Jazzy installation" in ended.stderr
    assert "pip install '.[ros]'" in ended.stderr


@pytest.mark.skipif(not HAS_ROS, reason=NO_ROS)
def test_another_missing_library_is_not_called_ros():
    ended = registrar(without="numba")
    assert ended.returncode == 2
    assert "ROS" not in ended.stderr
    assert "pip install vigg_ros" in ended.stderr


@pytest.mark.parametrize("missing", ["rclpy", "numpy"])
def test_help_needs_neither_ros_nor_libraries(missing):
    ended = registrar("--help", without=missing)
    assert ended.returncode == 0
    assert "--ros-args -p geometry:=depth" in ended.stdout
    assert "vigg replay BAG" in ended.stdout
    if missing == "rclpy":
        assert "| `max_rate` (dynamic) | 0.0 | 0 to 1000 Hz |" in registrar("--parameters", without=missing).stdout
