# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Start and end of the process: arguments, what is missing, signals, exit codes."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
from types import FrameType
from typing import NoReturn

USAGE = 2
DESCRIPTION = "Registers camera frames with depth, online, as a ROS 2 node. Parameters and remappings: --ros-args."
EPILOG = """examples:
  registrar --ros-args -p geometry:=depth -r rgb/image:=/camera/camera/color/image_raw \\
      -r rgb/camera_info:=/camera/color/camera_info -r depth/image:=/camera/aligned_depth_to_color/image_raw
  registrar --ros-args -p config:=lidar -r rgb/image:=/camera/image_raw \\
      -r rgb/camera_info:=/camera/camera_info -r points:=/lidar/points

Recorded bags need no node: vigg replay BAG"""

NO_ROS = (
    "registrar: ROS 2 is missing ({error}). Source a ROS 2 Jazzy installation (. /opt/ros/jazzy/setup.bash), "
    "or install its wheels: pip install '.[ros]'"
)
NO_LIBRARY = "registrar: a library is missing ({error}). Install the package with what it needs: pip install vigg_ros"


class StopSignals:
    """SIGINT and SIGTERM as an event; before ``defer`` is called they end the process at once, with exit code 0."""

    def __init__(self) -> None:
        self.received = threading.Event()
        self._deferred = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._handle)

    def defer(self) -> None:
        """From now on somebody looks at the event often."""
        self._deferred = True

    def _handle(self, number: int, frame: FrameType | None) -> None:
        self.received.set()
        if not self._deferred:
            _leave(0)


def run(arguments: list[str] | None = None) -> int:
    """Run the node until a signal ends it. Exit codes: 0 ended by a signal, 2 a start that cannot succeed."""
    signals = StopSignals()
    words = sys.argv[1:] if arguments is None else arguments
    if _parse(words).parameters:
        from vigg_ros.node.settings import parameters_table

        print(parameters_table(), end="")
        return 0
    try:
        from vigg_ros.node.spinning import spin
        from vigg_ros.registration.errors import ConfigError
    except ImportError as error:
        print((NO_ROS if _is_of_ros(error) else NO_LIBRARY).format(error=error), file=sys.stderr)
        return USAGE
    try:
        ended = spin(words, signals)
    except ConfigError as error:
        print(f"registrar: {error}", file=sys.stderr)
        return USAGE
    if not ended:  # a registration still runs, in C code that cannot be interrupted
        _leave(0)
    return 0


def _is_of_ros(error: ImportError) -> bool:
    top = (error.name or "").partition(".")[0]
    return top in ("rclpy", "std_srvs", "builtin_interfaces", "rcl_interfaces", "rpyutils") or top.endswith("_msgs")


def _parse(words: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="registrar",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--parameters", action="store_true", help="print a table of all parameters and end")
    # Unknown arguments are let through: ros2 run and launch add --ros-args and more.
    return parser.parse_known_args(words)[0]


def _leave(code: int) -> NoReturn:
    """End without waiting for threads and without what they would print on the way out."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
