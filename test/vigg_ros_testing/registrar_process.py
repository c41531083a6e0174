# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The real node as a process on a DDS domain of its own."""

import importlib.util
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from dds_domain import own_domain

from vigg_ros_testing.short_recordings import CHEAP

ROOT = Path(__file__).parents[2]

HAS_ROS = all(importlib.util.find_spec(name) for name in ("rclpy", "nav_msgs", "diagnostic_msgs", "std_srvs"))
NO_ROS = "needs rclpy: pip install '.[ros]' (x86-64), or source a ROS 2 Jazzy installation"

# Nodes of other machines in the network are none of ours.
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"

START_TIMEOUT_S = 120.0
"""Where kernels must be compiled first, on a machine that is busy."""


def parameters(**values: object) -> list[str]:
    """Arguments that set parameters; two underscores stand for the dot of a section."""
    return [word for name, value in values.items() for word in ("-p", f"{name.replace('__', '.')}:={_yaml(value)}")]


def depth_arguments(*more: str, **values: object) -> Sequence[str]:
    """Arguments for a quick node with depth images."""
    return [*parameters(**CHEAP, geometry="depth", **values), *more]


def _yaml(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


class NodeProcess:
    """Started with these arguments after --ros-args; its output goes to a log file."""

    def __init__(self, arguments: Sequence[str], log: Path, *, environment: dict[str, str] | None = None) -> None:
        self._log = log
        variables = os.environ | {
            "ROS_DOMAIN_ID": str(own_domain()),
            "PYTHONPATH": os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]),
            "ROS_HOME": str(log.parent / "ros_home"),
            "PYTHONUNBUFFERED": "1",
        }
        self.started_s = time.monotonic()
        with log.open("w") as file:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "vigg_ros.node", "--ros-args", *arguments],
                stdout=file,
                stderr=subprocess.STDOUT,
                env=variables | (environment or {}),
            )

    @property
    def log(self) -> str:
        """All that it has said so far."""
        return self._log.read_text()

    def wait_for(self, text: str, timeout_s: float = START_TIMEOUT_S) -> str:
        """The first line with this text. Raises AssertionError with the log if there is none in time."""
        end_s = time.monotonic() + timeout_s
        while time.monotonic() < end_s:
            found = next((line for line in self.log.splitlines() if text in line), None)
            if found is not None:
                return found
            if self.process.poll() is not None:
                break
            time.sleep(0.02)
        raise AssertionError(f"no line with {text!r}; exit code {self.process.poll()}, log:\n{self.log}")

    def wait_until_ready(self) -> "NodeProcess":
        """Until the kernels are loaded and the topics subscribed."""
        self.wait_for("ready: ")
        return self

    def wait_until_it_catches(self, number: int) -> None:
        """Until the process handles this signal itself; before that the interpreter is still starting."""
        while True:
            status = Path(f"/proc/{self.process.pid}/status").read_text()
            caught = int(next(line for line in status.splitlines() if line.startswith("SigCgt")).split()[1], 16)
            # SIGINT is caught by the interpreter from its beginning, SIGTERM by nobody but the node.
            if caught >> (number - 1) & 1 and caught >> (signal.SIGTERM - 1) & 1:
                return
            time.sleep(0.005)

    def memory_mb(self) -> float:
        """Resident memory."""
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 2**20

    def exit_code(self, timeout_s: float = 30.0) -> int:
        """Of a process that ends by itself."""
        return self.process.wait(timeout_s)

    def stop(self, number: int = signal.SIGINT) -> tuple[int, float]:
        """Send a signal; exit code and seconds until the end."""
        begun_s = time.monotonic()
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            code = self.process.wait(20.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
        return code, time.monotonic() - begun_s
