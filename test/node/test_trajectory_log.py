# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The trajectory that is saved on request."""

from datetime import datetime

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vigg_ros.node import trajectory_log
from vigg_ros.node.trajectory_log import SaveError, TrajectoryLog


def moved(x):
    T_odom_frame = np.eye(4)
    T_odom_frame[0, 3] = x
    return T_odom_frame


def with_poses(count, capacity=1000):
    one = TrajectoryLog(capacity)
    for number in range(count):
        one.add(1_772_013_245_123_456_789 + number, 0, moved(number))
    return one


def test_stamps_keep_all_their_digits(tmp_path):
    path = with_poses(2).save(str(tmp_path))
    assert path.read_text() == (
        "# session 0\n"
        "1772013245.123456789 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 1.000000000\n"
        "1772013245.123456790 1.000000000 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 1.000000000\n"
    )


def test_memory_is_bounded_and_what_was_forgotten_is_said():
    one = with_poses(250, capacity=100)
    assert len(one) <= 100
    assert len(one) + one.forgotten == 250
    lines = list(one.lines())
    assert lines[0] == f"# session 0, without its first {one.forgotten} poses"
    assert lines[-1].split()[1] == "249.000000000"
    one.add(5, 3, moved(0))
    assert (len(one), next(one.lines())) == (1, "# session 3"), "a new session begins a new trajectory"


@pytest.mark.parametrize(
    ("poses", "folder", "words"), [(1, "", "output_dir"), (1, "/nowhere/at/all", "output_dir"), (0, ".", "no pose yet")]
)
def test_what_cannot_be_saved_is_said(poses, folder, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SaveError, match=words):
        with_poses(poses).save(folder)
    assert not list(tmp_path.iterdir())


class StoppedClock(datetime):
    """Always the same moment, so that names collide."""

    @classmethod
    def now(cls, tz=None):
        return datetime(2026, 2, 25, 12, 0, 0)


@pytest.mark.hostile(
    "System: disk full, read-only folder, existing path, symlink: an error, never overwritten or deleted"
)
def test_an_existing_file_or_link_is_never_overwritten(tmp_path, monkeypatch):
    monkeypatch.setattr(trajectory_log, "datetime", StoppedClock)
    first = with_poses(1).save(str(tmp_path))
    with pytest.raises(SaveError, match="exists"):
        with_poses(2).save(str(tmp_path))
    assert len(first.read_text().splitlines()) == 2
    first.unlink()
    target = tmp_path / "precious"
    target.write_text("kept")
    first.symlink_to(target)
    with pytest.raises(SaveError, match="exists"):
        with_poses(2).save(str(tmp_path))
    assert target.read_text() == "kept"


def test_a_file_has_its_name_only_when_it_is_complete(tmp_path, monkeypatch):
    one = with_poses(3)
    seen = []

    def lines(log):
        seen.append([path.suffix for path in tmp_path.iterdir()])
        yield "# session 0"
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(TrajectoryLog, "lines", lines)
    with pytest.raises(SaveError, match="No space left on device; check output_dir"):
        one.save(str(tmp_path))
    assert seen == [[".part"]]
    assert not list(tmp_path.iterdir()), "nothing half written is left"


def test_a_copy_stays_as_it_was_while_poses_are_added():
    one = with_poses(250, capacity=100)
    before = list(one.lines())
    copied = one.copy()
    one.add(7, 0, moved(7))
    assert list(copied.lines()) == before
    assert list(one.lines())[-1].startswith("0.000000007 7.0")
    one.add(5, 3, moved(0))
    assert list(copied.lines()) == before


def test_many_poses_are_written_as_each_one_alone(monkeypatch):
    monkeypatch.setattr(trajectory_log, "_BLOCK", 7)
    one, expected = TrajectoryLog(), ["# session 0"]
    for number, rotation in enumerate(Rotation.random(50, random_state=3)):
        T_odom_frame = moved(number)
        T_odom_frame[:3, :3] = rotation.as_matrix()
        one.add(number, 0, T_odom_frame)
        quaternion = rotation.as_quat(canonical=True)
        numbers = (number, 0, 0, *quaternion)
        expected.append(f"0.{number:09d} " + " ".join(f"{value:.9f}" for value in numbers))
    assert list(one.lines()) == expected
