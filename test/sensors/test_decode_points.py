# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PointCloud2: every legal layout gives the same points. The others are in test_message_refusals.py."""

import numpy as np
import pytest

from vigg_ros.sensors.point_cloud import decode_points
from vigg_ros_testing.message_samples import STAMP_NS, cloud, header, xyz_table

POINTS = np.array([[1.0, 2.0, 3.0], [-4.0, 5.5, -6.25], [7.0, 0.0, 0.0], [0.0, -8.0, 9.0]])


@pytest.mark.hostile("PointCloud2: organised and unorganised A")
@pytest.mark.hostile("PointCloud2: big-endian A")
@pytest.mark.hostile("PointCloud2: float64 xyz A, integer xyz R")
@pytest.mark.parametrize("dtype", ["<f4", ">f4", "<f8", ">f8"])
@pytest.mark.parametrize("shape", [4, (2, 2)])
def test_both_byte_orders_and_both_float_types_are_read_row_by_row(dtype, shape):
    assert decode_points(cloud(xyz_table(POINTS, dtype).reshape(shape))).times_s is None
    times = np.array([0.0, 0.01, 0.02, 0.03], dtype[0] + "f4")
    decoded = decode_points(cloud(xyz_table(POINTS, dtype, time=times).reshape(shape)))
    np.testing.assert_array_equal(decoded.points, POINTS)
    assert decoded.points.dtype == np.float32
    assert decoded.points.dtype.isnative
    np.testing.assert_array_equal(decoded.times_s, times)
    assert (decoded.stamp_ns, decoded.frame_id, decoded.notes) == (STAMP_NS, "lidar", ())


@pytest.mark.hostile("PointCloud2: padding in point_step and row_step A")
def test_padding_between_points_and_rows_and_any_order_of_fields_is_read():
    layout = np.dtype(
        {
            "names": ["z", "ring", "x", "y", "intensity"],
            "formats": ["<f4", "<u2", "<f4", "<f4", "<f4"],
            "offsets": [1, 6, 9, 17, 24],
            "itemsize": 31,
        }
    )
    table = np.zeros((2, 2), layout)
    for i, axis in enumerate("xyz"):
        table[axis] = POINTS[:, i].reshape(2, 2)
    rows = np.full((2, 2 * 31 + 7), 255, "u1")
    rows[:, :-7] = np.frombuffer(table.tobytes(), "u1").reshape(2, -1)
    decoded = decode_points(cloud(table, row_step=rows.shape[1], data=rows.tobytes()))
    np.testing.assert_array_equal(decoded.points, POINTS)
    assert decoded.notes == ()


@pytest.mark.hostile("PointCloud2: NaN or Inf points dropped with all their attributes")
@pytest.mark.hostile("PointCloud2: 1e30 dropped")
@pytest.mark.hostile("PointCloud2: (0,0,0) dropped")
@pytest.mark.parametrize(
    ("bad", "dtype"),
    [
        *((bad, dtype) for dtype in ("<f4", "<f8") for bad in ([np.nan, 1, 1], [1, np.inf, 1], [1, 1, -np.inf])),
        *((bad, dtype) for dtype in ("<f4", "<f8") for bad in ([1e30, 1, 1], [0, 0, 0], [1e19] * 3, [10_001, 0, 0])),
        # Beyond float32, without a warning.
        *((bad, dtype) for dtype in ("<f8", ">f8") for bad in ([1e300, 0, 0], [-1e300, 1e-300, np.nan])),
    ],
)
def test_points_that_are_none_are_dropped_with_their_times(bad, dtype):
    points = np.insert(POINTS, [0, 2, 4], bad, axis=0)
    times = np.array([9, 0.01, 0.02, 9, 0.03, 0.04, 9], dtype[0] + "f4")
    decoded = decode_points(cloud(xyz_table(points, dtype, time=times)))
    np.testing.assert_array_equal(decoded.points, POINTS)
    np.testing.assert_array_equal(decoded.times_s, np.float32([0.01, 0.02, 0.03, 0.04]))


@pytest.mark.hostile("PointCloud2: duplicate field names R if xyz")
def test_another_field_may_stand_twice():
    msg = cloud(xyz_table(POINTS, a=np.zeros(4, "<f4"), b=np.zeros(4, "<f4")))
    msg.fields[4].name = "a"
    np.testing.assert_array_equal(decode_points(msg).points, POINTS)


@pytest.mark.hostile("PointCloud2: 10 million points A, downsampled")
def test_ten_million_points_are_read():
    table = np.ones((10_000_000, 3), "<f4")
    msg = cloud(xyz_table(POINTS), width=len(table), row_step=table.nbytes, data=table)
    assert decode_points(msg).points.shape == (10_000_000, 3)


NS = STAMP_NS
CLOCK_S = NS * 1e-9


@pytest.mark.parametrize(
    ("name", "column", "expected_s"),
    [
        # Velodyne: seconds from the stamp, forwards or backwards.
        ("time", np.array([0, 0.025, 0.05, 0.1], "<f4"), [0, 0.025, 0.05, 0.1]),
        ("time", np.array([-0.1, -0.05, -0.025, 0], "<f4"), [-0.1, -0.05, -0.025, 0]),
        # Ouster: nanoseconds from the stamp.
        ("t", np.array([0, 25_000_000, 50_000_000, 99_999_999], "<u4"), [0, 0.025, 0.05, 0.099999999]),
        # Hesai, RoboSense: seconds of the clock. Livox: nanoseconds of the clock.
        ("timestamp", CLOCK_S + np.array([0, 0.025, 0.05, 0.1]), [0, 0.025, 0.05, 0.1]),
        ("timestamp", CLOCK_S - np.array([0.1, 0.05, 0.025, 0]), [-0.1, -0.05, -0.025, 0]),
        ("timestamp", float(NS) + np.array([0, 25e6, 50e6, 1e8]), [0, 0.025, 0.05, 0.1]),
        ("offset_time", np.array([0, 1_000, 50_000_000, 10], "<u4"), [0, 1e-6, 0.05, 1e-8]),
        ("time_stamp", np.array([0, 25_000, 50_000, 99_999], "<u4"), [0, 0.025, 0.05, 0.099999]),
    ],
)
def test_the_times_of_points_are_seconds_from_the_stamp(name, column, expected_s):
    decoded = decode_points(cloud(xyz_table(POINTS, **{name: column})))
    # A clock in float64 has steps of 0.24 us, float32 seconds of 0.1 s of 7 ns.
    atol = 5e-7 if name == "timestamp" else 4e-9
    np.testing.assert_allclose(decoded.times_s, expected_s, rtol=0, atol=atol)
    assert decoded.notes == ()


@pytest.mark.parametrize(
    "column",
    [
        np.array([0, 1, 2, 3], "<f4"),  # 3 s: no scan takes that long
        np.array([0, 100, 200, 900], "<u4"),  # under a millisecond, whatever the unit
        np.array([0, np.nan, 0.1, 0.05], "<f4"),
        np.array([0, np.inf, 0.1, 0.05], "<f4"),
        (CLOCK_S + np.array([0, 0.05, 0.1, 100])).astype("<f4"),  # float32 has no room for a clock
        CLOCK_S - 3600 + np.array([0, 0.025, 0.05, 0.1]),  # another clock
    ],
)
def test_times_that_cannot_be_are_left_out_with_a_note(column):
    decoded = decode_points(cloud(xyz_table(POINTS, time=column)))
    assert decoded.times_s is None
    assert [note.code for note in decoded.notes] == ["POINT_TIMES"]
    # One time for all points is no information, and nothing odd.
    decoded = decode_points(cloud(xyz_table(POINTS, timestamp=np.full_like(column, column[0]))))
    assert (decoded.times_s, decoded.notes) == (None, ())


@pytest.mark.parametrize("begin_s", [0.0, 1.5])
def test_in_the_first_seconds_of_a_simulation_times_of_the_clock_and_from_the_stamp_are_told_apart(begin_s):
    after_s = np.array([0.0, 0.02, 0.06, 0.1])
    msg = cloud(xyz_table(POINTS, timestamp=begin_s + after_s), header=header(1, 500_000_000, "lidar"))
    np.testing.assert_allclose(decode_points(msg).times_s, after_s, atol=1e-9)
