# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The executable ``registrar``. The ROS 2 node itself is not part of this release yet."""

from __future__ import annotations

import argparse
import sys

NOT_YET = (
    "registrar: the online node comes with a later release of vigg_ros. "
    "To register a recorded bag now, run: vigg replay BAG"
)


def main(arguments: list[str] | None = None) -> int:
    """Say that there is no node yet and what to use instead; the exit code is 2, as nothing was run."""
    parser = argparse.ArgumentParser(
        prog="registrar",
        description="Registers camera frames with depth, online, as a ROS 2 node.",
        epilog=NOT_YET,
    )
    # Unknown arguments are let through: ros2 run and launch add --ros-args and more.
    parser.parse_known_args(arguments)
    print(NOT_YET, file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
