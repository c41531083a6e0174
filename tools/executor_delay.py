#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How late a 50 Hz timer is in the node's process while it registers: python tools/executor_delay.py [--seconds S]

Small rendered frames come over DDS from another process, faster than they can be registered, so that the worker
never rests; the timer runs in the executor of the node. Needs rclpy.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import rclpy
from dds_domain import own_domain
from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor

from vigg_ros.node.registrar_node import RegistrarNode

PERIOD_S = 0.02
PLAYER = Path(__file__).parent / "play_frames.py"


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=40.0)
    parser.add_argument("--rate", type=float, default=30.0, help="frames published per second")
    parser.add_argument("--set", action="append", default=[], metavar="NAME:=VALUE", help="parameters of the node")
    arguments = parser.parse_args()
    os.environ["ROS_DOMAIN_ID"] = str(own_domain())
    parameters = [word for text in ("geometry:=depth", *arguments.set) for word in ("-p", text)]
    context = rclpy.Context()
    rclpy.init(args=["registrar", "--ros-args", *parameters], context=context)
    node = RegistrarNode(context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node.ros)
    node.start()
    calls_s: list[float] = []
    steady = Clock(clock_type=ClockType.STEADY_TIME)
    node.ros.create_timer(PERIOD_S, lambda: calls_s.append(time.monotonic()), clock=steady)
    player = subprocess.Popen([sys.executable, str(PLAYER), "--rate", str(arguments.rate)])
    try:
        end_s = time.monotonic() + arguments.seconds
        while time.monotonic() < end_s:
            executor.spin_once(timeout_sec=0.1)
    finally:
        player.terminate()
        player.wait()
    late_ms = 1e3 * (np.diff(calls_s[50:]) - PERIOD_S)
    print(f"answers: {dict(node.statistics.states)}")
    spread = ", ".join(f"p{share} {np.percentile(late_ms, share):.1f}" for share in (50, 95, 99))
    print(f"50 Hz timer, {len(late_ms)} intervals, longer than 20 ms by {spread}, max {late_ms.max():.1f} ms")
    node.end(2.0)
    context.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
