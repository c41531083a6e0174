# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A child process: started, measured, stopped; here any program, as it need not be the node."""

import os
import sys
import time
from pathlib import Path

import pytest

from vigg_ros.node.player import node_process
from vigg_ros.node.player.node_process import NodeFailed, NodeProcess

OBEDIENT = "import signal, sys; signal.signal(2, lambda *_: sys.exit({code})); print('up', flush=True); signal.pause()"
DEAF = "import signal, time; signal.signal(2, signal.SIG_IGN); print('up', flush=True); time.sleep(60)"
BUSY = """import time
x = bytearray(50_000_000)
while time.process_time() < 1: pass
print('up', flush=True)
time.sleep(60)
"""


def program(code, folder):
    return NodeProcess([sys.executable, "-c", code], folder / "node.log", os.environ)


def wait_for(text, folder):
    end_s = time.monotonic() + 20
    while text not in (folder / "node.log").read_text():
        assert time.monotonic() < end_s
        time.sleep(0.01)


@pytest.mark.parametrize(("program_text", "code"), [(OBEDIENT.format(code=3), 3), (DEAF, -9)])
def test_it_is_stopped_by_sigint_or_else_killed(program_text, code, tmp_path, monkeypatch):
    monkeypatch.setattr(node_process, "STOP_S", 0.2 if code == -9 else node_process.STOP_S)
    with program(program_text, tmp_path) as node:
        wait_for("up", tmp_path)
        node.check()
        assert node.stop() == code
        assert node.stop() == code, "stopping twice does no harm"


def test_it_does_not_outlive_its_block_and_what_it_said_is_quoted(tmp_path):
    with program(OBEDIENT.format(code=4), tmp_path) as node:
        wait_for("up", tmp_path)
    with pytest.raises(NodeFailed, match="exit code 4; it said:\nup"):
        node.check()


def test_warnings_are_told_once_without_times_and_colours(tmp_path):
    lines = [
        "[INFO] [1.5] [registrar]: ready",
        "\x1b[33m[WARN] [1.5] [registrar]: 3 of 4 dropped\x1b[0m",
        "[WARN] [2.5] [registrar]: 30 of 41 dropped",
        "RuntimeError: odd",
    ]
    with program(f"print({chr(10).join(lines)!r}, flush=True)", tmp_path) as node:
        wait_for("odd", tmp_path)
        assert node.warnings() == ["[WARN] [registrar]: 30 of 41 dropped", "RuntimeError: odd"]


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="this system has no /proc")
def test_cpu_time_and_memory_are_those_of_the_process(tmp_path):
    with program(BUSY, tmp_path) as node:
        wait_for("up", tmp_path)
        usage = node.usage()
    assert usage.cpu_s == pytest.approx(1.0, abs=0.2)  # in ticks of 10 ms, with the end of the interpreter's start
    assert usage.peak_rss_mb > 47
    assert node.usage() is None, "it has ended"
