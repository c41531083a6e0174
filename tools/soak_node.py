#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Does the node grow or slow down? python tools/soak_node.py [--frames N]

Starts a node, publishes small rendered frames to it in a loop over DDS, each once the one before was answered, and
prints the node's memory and its time from arrival to answer, by tenths of the run. Needs rclpy.
"""

from __future__ import annotations

import argparse
import itertools
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import rclpy
from dds_domain import own_domain
from diagnostic_msgs.msg import DiagnosticStatus
from play_frames import FRAMES, messages, rendered
from rclpy.qos import QoSProfile

from vigg_ros.messages.fields import RCLPY, build
from vigg_ros.node.ros_classes import class_of

TYPES = {"rgb/camera_info": "CameraInfo", "rgb/image": "Image", "depth/image": "Image"}
START_NS, STEP_NS = 1_700_000_000_000_000_000, 66_666_667
PARAMETERS = ("geometry:=depth", "visual.detector:=orb", "geometric.voxel_size_m:=0.06", "geometric.sample_k:=800")


class Soak:
    """A publisher that waits for answers."""

    def __init__(self, process: subprocess.Popen[bytes], width_px: int) -> None:
        self._process = process
        self._width_px = width_px
        self._views = list(rendered(width_px))
        self._node = rclpy.create_node("soak")
        self._publishers = {
            name: self._node.create_publisher(class_of(f"sensor_msgs/msg/{kind}"), name, QoSProfile(depth=10))
            for name, kind in TYPES.items()
        }
        self._answers: list[DiagnosticStatus] = []
        self._node.create_subscription(
            DiagnosticStatus, "registrar/status", self._answers.append, QoSProfile(depth=100)
        )

    def run(self, count: int) -> tuple[list[float], list[float], dict[str, int]]:
        """Memory (MB) and latency (ms) after each frame, and how often which state was answered."""
        while not all(publisher.get_subscription_count() for publisher in self._publishers.values()):
            time.sleep(0.1)
        memory_mb, latency_ms, states = [], [], {}
        order = itertools.cycle([*range(FRAMES), *range(FRAMES - 2, 0, -1)])
        for number, place in zip(range(count), order, strict=False):
            values = self._answer_to(place, START_NS + number * STEP_NS)
            states[values["state"]] = states.get(values["state"], 0) + 1
            memory_mb.append(resident_mb(self._process.pid))
            latency_ms.append(float(values.get("ms_total", "nan")))
            if (number + 1) % 1000 == 0:
                print(f"{number + 1} frames, {memory_mb[-1]:.1f} MB", file=sys.stderr)
        return memory_mb, latency_ms, states

    def _answer_to(self, place: int, stamp_ns: int) -> dict[str, str]:
        for name, message in messages(self._views[place], stamp_ns, self._width_px).items():
            self._publishers[name].publish(build(message, class_of, RCLPY))
        end_s = time.monotonic() + 30.0
        while time.monotonic() < end_s:
            rclpy.spin_once(self._node, timeout_sec=0.1)
            for status in self._answers:
                values = {pair.key: pair.value for pair in status.values}
                if values.get("stamp_ns") == str(stamp_ns):
                    self._answers.clear()
                    return values
        raise SystemExit(f"no answer to the frame at {stamp_ns} ns in 30 s")


def resident_mb(pid: int) -> float:
    """Resident memory of a process."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def main() -> int:
    """Run and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--frames", type=int, default=10_000)
    parser.add_argument("--width", type=int, default=160, help="of the images, 4:3 (default: 160)")
    arguments = parser.parse_args()
    os.environ["ROS_DOMAIN_ID"] = str(own_domain())
    command = [sys.executable, "-m", "vigg_ros.node", "--ros-args"]
    process = subprocess.Popen([*command, *(word for text in PARAMETERS for word in ("-p", text))])
    rclpy.init()
    try:
        memory_mb, latency_ms, states = Soak(process, arguments.width).run(arguments.frames)
    finally:
        process.terminate()
        process.wait()
        rclpy.try_shutdown()
    settled = min(500, arguments.frames // 2)
    print(f"{arguments.frames} frames: {states}; exit code of the node {process.returncode}")
    then_mb, end_mb = memory_mb[settled], memory_mb[-1]
    print(f"memory: {then_mb:.1f} MB after {settled} frames, {end_mb:.1f} MB at the end ({end_mb / then_mb - 1:+.1%})")
    tenths = [f"{np.nanmedian(part):.1f}" for part in np.array_split(latency_ms, 10)]
    print(f"arrival to answer, median of each tenth of the run, ms: {', '.join(tenths)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
