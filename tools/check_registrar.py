#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether an installed registrar starts, answers ~/reset and ends well: python tools/check_registrar.py COMMAND ...

Exit code 0 if it does. Needs rclpy.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import rclpy
from dds_domain import own_domain
from std_srvs.srv import Trigger

TIMEOUT_S = 180.0
"""Kernels may have to be compiled first."""


def main(command: list[str]) -> int:
    """Start the command as a node, ask it, end it."""
    if not command:
        print(__doc__, file=sys.stderr)
        return 2
    os.environ["ROS_DOMAIN_ID"] = str(own_domain())
    process = subprocess.Popen([*command, "--ros-args", "-p", "geometry:=depth"])
    try:
        message = ask(Trigger, "registrar/reset")
        process.send_signal(signal.SIGINT)
        code = process.wait(20.0)
    finally:
        process.kill()
    print(f"~/reset answered {message!r}; exit code {code} on SIGINT")
    return 0 if message and code == 0 else 1


def ask(kind: type[Trigger], name: str) -> str:
    """What a service answers; empty if it does not, or says no."""
    rclpy.init()
    node = rclpy.create_node("check_registrar")
    client = node.create_client(kind, name)
    try:
        if not client.wait_for_service(TIMEOUT_S):
            return ""
        future = client.call_async(kind.Request())
        rclpy.spin_until_future_complete(node, future, timeout_sec=TIMEOUT_S)
        answer = future.result()
        return str(answer.message) if answer is not None and answer.success else ""
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
