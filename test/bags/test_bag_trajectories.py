# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stamps without rounding, and poses that are poses."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vigg_ros.bags.trajectories import parse_stamp_ns, read_tum_poses, rows
from vigg_ros.bench.datasets.number_files import read_matrix_pose, read_numbers, stamp_of_number
from vigg_ros.registration.errors import BagError
from vigg_ros_testing.dataset_samples import QUARTER_TURN, pose_at


@pytest.mark.parametrize(
    ("text", "stamp_ns"),
    [
        ("1305031102.175304", 1305031102_175304000),
        ("1700000000.123456789", 1700000000_123456789),  # a float would give ...  .123456716
        ("1.041284e-01", 104128400),
        ("0.000000e+00", 0),
        ("12", 12_000_000_000),
        ("2147483647.999999999", 2147483647_999999999),
    ],
)
def test_stamps_are_exact(text: str, stamp_ns: int) -> None:
    assert parse_stamp_ns(text) == stamp_ns


@given(st.integers(0, 2**31 * 10**9 - 1))
def test_any_stamp_of_ros_survives_as_text(stamp_ns: int) -> None:
    seconds, nanoseconds = divmod(stamp_ns, 10**9)
    assert parse_stamp_ns(f"{seconds}.{nanoseconds:09d}") == stamp_ns


@pytest.mark.parametrize("text", ["", "nan", "inf", "-1", "abc", "1e30", "1e999999999", "1.2.3", "2147483648"])
def test_what_is_no_stamp_is_an_error(text: str) -> None:
    with pytest.raises(ValueError, match=r"no stamp in seconds|seconds that ROS can hold"):
        parse_stamp_ns(text)


def test_numbers_count_at_their_rate_from_one_second_on() -> None:
    # 1 s + k / 30 s, rounded to ns: 33,333,333.3, 66,666,666.7, 3,333,333,333.3
    after_ns = [stamp_of_number(k, 30.0) - 10**9 for k in (0, 1, 2, 3, 100)]
    assert after_ns == [0, 33_333_333, 66_666_667, 100_000_000, 3_333_333_333]


def test_rows_leave_out_comments_and_empty_lines(tmp_path: Path) -> None:
    (tmp_path / "x.txt").write_text("# head\n\n1, 2 # tail\r\n  3\n")
    assert list(rows(tmp_path / "x.txt")) == [(3, ["1", "2"]), (4, ["3"])]


@pytest.mark.parametrize("content", [None, b"\xff\xfe"])
def test_what_is_no_text_is_named(content: bytes | None, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / "x.txt").write_bytes(content)
    with pytest.raises(BagError, match=r"x\.txt cannot be read"):
        list(rows(tmp_path / "x.txt"))


@pytest.mark.parametrize("text", ["-inf " * 16, "nan " * 16, "1 2 3", "0 " * 16, "2 " * 16, ""])
def test_a_pose_that_is_none_is_no_pose(text: str, tmp_path: Path) -> None:
    (tmp_path / "pose.txt").write_text(text)
    assert read_matrix_pose(tmp_path / "pose.txt") is None


def test_tum_rows_keep_the_stamp_as_written(tmp_path: Path) -> None:
    (tmp_path / "t.txt").write_text(f"# c\n0012.50 3 0 0 {QUARTER_TURN}\n1 0 0 0 0 0 0 0\n2 nan 0 0 0 0 0 1\n")
    (stamp, T), zero, nan = read_tum_poses(tmp_path / "t.txt")
    assert stamp == "0012.50"
    np.testing.assert_allclose(T, pose_at(3.0), atol=1e-15)
    assert (zero[1], nan[1]) == (None, None)


def test_what_a_row_must_not_hold_is_named_by_its_line(tmp_path: Path) -> None:
    (tmp_path / "x.txt").write_text("1 2\n3 four\n")
    with pytest.raises(BagError, match="line 2: 'four' is no number"):
        read_numbers(tmp_path / "x.txt")
    with pytest.raises(BagError, match="line 1: 2 columns; expected stamp tx ty tz qx qy qz qw"):
        read_tum_poses(tmp_path / "x.txt")
