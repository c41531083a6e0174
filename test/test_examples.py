# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The examples run, and their answers are right."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

from vigg_ros.bench.worlds import HandheldLoop
from vigg_ros.registration.rigid import inverse
from vigg_ros_testing.doctor_bags import INTRINSICS
from vigg_ros_testing.registrar_process import HAS_ROS, NO_ROS, own_domain
from vigg_ros_testing.short_recordings import short_entries, write_entries

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
TESTED = {"register_two_images", "track_folder", "replay_and_plot", "use_odometry"}
TRUTH_TOLERANCE_M = 0.01
"""The voxel grid leaves less than half of its 25 mm; depth is in whole millimetres."""


def command(name: str, *arguments: object) -> tuple[list[str], dict[str, str]]:
    """The command line of an example, and its environment."""
    path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    return [sys.executable, str(EXAMPLES / f"{name}.py"), *map(str, arguments)], os.environ | {"PYTHONPATH": path}


def run(name: str, *arguments: object, cwd: Path) -> str:
    """What an example prints."""
    words, environment = command(name, *arguments)
    done = subprocess.run(words, cwd=cwd, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def true_motion_m(time_s: float) -> np.ndarray:
    """Where the camera has gone since the first view."""
    path = HandheldLoop()
    return (inverse(path.T_world_camera(0.0)) @ path.T_world_camera(time_s))[:3, 3]


def printed_translation(text: str) -> list[float]:
    """The last column of the first three rows of a printed matrix."""
    rows = re.findall(r"\[+\s*([-\d. e]+)\]", text)
    return [float(row.split()[-1]) for row in rows[:3]]


def test_every_example_is_tested() -> None:
    assert {path.stem for path in EXAMPLES.glob("*.py")} == TESTED


@pytest.mark.parametrize(
    ("name", "arguments", "said"),
    [
        ("register_two_images", ["no.png", "no.png", "no.png", "no.png", *INTRINSICS], "no.png is no readable image"),
        ("replay_and_plot", [ROOT / "bags/street_lidar"], "no frame got a pose; the first one: UNPAIRED: no depth"),
    ],
)
def test_what_gives_no_pose_is_told(name: str, arguments: list[object], said: str, tmp_path: Path) -> None:
    words, environment = command(name, *arguments)
    done = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert said in done.stderr


def test_two_images_are_registered_and_drawn(tmp_path: Path) -> None:
    said = run("register_two_images", cwd=tmp_path)
    assert np.allclose(printed_translation(said), true_motion_m(0.5), atol=TRUTH_TOLERANCE_M)
    picture = cv2.imread(str(tmp_path / "matches.png"))
    assert picture.shape[0] == 240
    assert picture.shape[1] > 2 * 320


def test_two_image_files_are_registered(untouched_folder: Path, tmp_path: Path) -> None:
    files = [untouched_folder / f"frame-00000{number}.{kind}.png" for number in (0, 2) for kind in ("color", "depth")]
    said = run("register_two_images", *files, *INTRINSICS, "--output", "a.png", cwd=tmp_path)
    assert np.allclose(printed_translation(said), true_motion_m(0.2), atol=TRUTH_TOLERANCE_M)
    assert (tmp_path / "a.png").is_file()


def test_a_folder_is_tracked(untouched_folder: Path, tmp_path: Path) -> None:
    said = run("track_folder", untouched_folder, cwd=tmp_path)
    assert "3 of 3 frames got a pose" in said
    poses = np.loadtxt(tmp_path / "trajectory.tum")
    assert np.allclose(poses[:, 1:4], [true_motion_m(0.1 * number) for number in range(3)], atol=TRUTH_TOLERANCE_M)


def test_a_bag_is_replayed_and_plotted(tmp_path: Path) -> None:
    bag = write_entries(tmp_path / "bag", short_entries(ROOT / "bags" / "room_rgbd", frames=8, every=1))
    assert "8 of 8 frames got a pose" in run("replay_and_plot", bag, cwd=tmp_path)
    assert cv2.imread(str(tmp_path / "path.png")).std() > 0


@pytest.mark.skipif(not HAS_ROS, reason=NO_ROS)
def test_odometry_is_summed_up_and_a_loss_is_said() -> None:
    from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
    from nav_msgs.msg import Odometry

    from vigg_ros_testing.ros_peer import Peer

    def status(state: str) -> DiagnosticStatus:
        values = [KeyValue(key="state", value=state), KeyValue(key="session", value="0")]
        return DiagnosticStatus(message=f"{state} NO_TEXTURE", values=values)

    def odometry(x: float) -> Odometry:
        message = Odometry()
        message.pose.pose.position.x = x
        return message

    words, environment = command("use_odometry")
    environment["ROS_DOMAIN_ID"] = str(own_domain())
    peer = Peer()
    with subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True) as example:
        try:
            assert example.stdout is not None
            odom = peer.offer("/registrar/odom", "nav_msgs/msg/Odometry")
            judged = peer.offer("/registrar/status", "diagnostic_msgs/msg/DiagnosticStatus")
            # The peer itself listens too.
            peer.wait(lambda: min(one.get_subscription_count() for one in (odom, judged)) > 1, "the example")
            judged.publish(status("STARTED"))
            time.sleep(0.5)  # two topics have no order among them
            for x, travelled_m in ((0.0, 0.0), (0.25, 0.25), (-0.25, 0.75)):
                odom.publish(odometry(x))
                assert example.stdout.readline() == f"travelled {travelled_m:.2f} m\n"
            judged.publish(status("LOST"))
            assert example.stdout.readline() == "LOST: LOST NO_TEXTURE\n"
        finally:
            example.kill()
            peer.close()
