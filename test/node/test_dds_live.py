# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``vigg live`` over real DDS: with ``fake_node.py``, whose answers are known, and with the real node."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from dds_domain import claim_domain

import vigg_ros_testing
from vigg_ros.cli.main import main
from vigg_ros.node.player import live_run
from vigg_ros.node.player.dds_profile import VARIABLE
from vigg_ros_testing.bag_samples import COLOUR, DEPTH, FRAMES, INFO, rgbd_entries, write_bag

BAGS = Path(__file__).parents[2] / "bags"
FAKE_NODE = [sys.executable, str(Path(vigg_ros_testing.__file__).with_name("fake_node.py"))]


@pytest.fixture
def bag(tmp_path):
    """Frame k stands at x = k metres."""
    return str(write_bag(tmp_path / "bag", rgbd_entries()))


@pytest.fixture
def domain(monkeypatch):
    """One that no test has used: a node that crashed is remembered for a while."""
    monkeypatch.setenv(VARIABLE, os.environ.get(VARIABLE, ""))  # the command sets it, and here it is taken back
    return f"--domain-id={claim_domain()}"


@pytest.fixture
def fake(monkeypatch):
    monkeypatch.setattr(live_run, "NODE", FAKE_NODE)


def rows_of(text):
    """Name and text of each row, without the sentence below the table."""
    return dict(re.split("  +", line, maxsplit=1) for line in text.splitlines() if "  " in line)


@pytest.mark.usefixtures("fake")
def test_the_table_says_what_the_node_answered(bag, domain, capsys):
    assert main(["live", bag, domain]) == 0
    shown = capsys.readouterr()
    assert shown.out.splitlines()[-1] == "2 of 12 frames were dropped because newer ones came; try --rate 0.8"
    assert "were dropped so far" not in shown.err
    rows = rows_of(shown.out)
    assert rows["frames sent"].startswith(f"{FRAMES} in ")
    assert rows["poses received"].startswith("10 (83.3%, ")
    assert rows["without a pose"] == "DROPPED NEWER_FRAME: 2"
    assert rows["without an answer"] == "none"
    # Of the answered frames one is 5 cm off, and the rest exact.
    assert rows["position error"].startswith("median 0.00 cm, max 5.00 cm, over 10 frames, aligned")
    assert re.match(r"median \d+ ms, p95 \d+ ms", rows["latency"])
    assert re.match(r"CPU \d+ % of one core in the mean, memory \d+ MB at most", rows["node"])
    assert {f"rgb/image:={COLOUR}", f"rgb/camera_info:={INFO}", f"depth/image:={DEPTH}"} < set(shown.err.split())


@pytest.mark.usefixtures("fake")
@pytest.mark.parametrize(
    ("behaviour", "code", "words"),
    [
        ("mute", 5, "no frame got a pose"),
        ("crash", 1, "ended by itself with exit code 7; it said:\nready\nRuntimeError: as asked for"),
        ("stubborn", 1, "the node ended with exit code 3, expected 0"),
        ("deaf", 1, f"the node did not subscribe to {COLOUR}, {INFO}, {DEPTH} within 2 s"),
    ],
)
def test_a_node_that_fails_is_told(behaviour, code, words, bag, domain, capsys, monkeypatch):
    monkeypatch.setenv("FAKE_NODE", behaviour)
    monkeypatch.setattr(live_run, "QUIET_S", 0.3)
    monkeypatch.setattr(live_run, "READY_S", 2 if behaviour == "deaf" else live_run.READY_S)
    assert main(["live", bag, domain]) == code
    shown = capsys.readouterr()
    assert words in shown.err
    assert "Traceback" not in shown.err


@pytest.mark.usefixtures("fake")
def test_another_registrar_in_the_domain_is_refused(bag, domain, capsys):
    environment = os.environ | {"ROS_DOMAIN_ID": domain.partition("=")[2]}
    with subprocess.Popen(FAKE_NODE, stdout=subprocess.PIPE, env=environment) as other:
        other.stdout.readline()
        code = main(["live", bag, domain])
        other.kill()
    assert code == 1
    assert "another registrar runs on ROS_DOMAIN_ID=" in capsys.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_can_be_interrupted_and_takes_the_node_with_it(number, bag, domain, tmp_path):
    mark = str(tmp_path)  # in the node's command line, by which it is found
    code = (
        "import sys\nfrom vigg_ros.node.player import live_run\nfrom vigg_ros.cli.main import main\n"
        f"live_run.NODE = {[*FAKE_NODE, mark]!r}\n"
        f"sys.exit(main(['live', {bag!r}, {domain!r}, '--rate', '0.05']))"
    )
    command = [sys.executable, "-c", code]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while "poses received" not in process.stderr.readline():
        assert process.poll() is None
    process.send_signal(number)
    table, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "vigg live: interrupted" in errors.splitlines()
    assert "Traceback" not in errors
    assert 0 < int(rows_of(table)["frames sent"].split()[0]) < FRAMES
    assert not [one for one in running_commands() if mark in one]


def running_commands():
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            found.append(path.read_bytes().decode(errors="replace"))
        except OSError:  # it has ended meanwhile
            continue
    return found


@pytest.mark.parametrize(
    ("bag", "frames", "largest_cm"),
    [("room_rgbd", 76, 3.0), pytest.param("street_lidar", 25, 50.0, marks=pytest.mark.slow)],
)
def test_the_real_node_answers_the_bundled_bags(bag, frames, largest_cm, domain, capsys):
    assert main(["live", str(BAGS / bag), domain]) == 0
    rows = rows_of(capsys.readouterr().out)
    assert rows["frames sent"].startswith(f"{frames} in ")
    # On a busy machine frames are dropped, and by that some lost; none may be so without a word.
    causes = rows["without a pose"]
    assert "REFUSED" not in causes
    assert "INTERNAL_ERROR" not in causes
    failed = sum(map(int, re.findall(r"[A-Z]: (\d+)", causes)))
    assert int(rows["poses received"].split()[0]) + failed == frames
    assert rows["without an answer"] == "none"
    # Replay's largest errors are 1 cm and 15 cm; without alignment, and with frames left out, they are larger.
    _, _, _, word, value, _ = rows["position error"].split()[:6]
    assert word == "max"
    assert float(value) < largest_cm
