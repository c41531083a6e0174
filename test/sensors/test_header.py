# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stamps and frame names, as every decoder reads them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vigg_ros.sensors.colour_image import decode_image
from vigg_ros.sensors.compressed_depth import decode_compressed_depth
from vigg_ros.sensors.compressed_image import decode_compressed_image
from vigg_ros.sensors.depth_image import decode_depth
from vigg_ros.sensors.header import stamp_ns
from vigg_ros.sensors.point_cloud import decode_points
from vigg_ros_testing.message_samples import cloud, compressed, header, image, png, png_payload, reject, xyz_table

MILLIMETRES = np.full((2, 2), 900, "<u2")
SENSORS = {
    "image": (decode_image, lambda head: image(np.ones((2, 2), "u1"), "mono8", header=head)),
    "depth": (decode_depth, lambda head: image(MILLIMETRES, "16UC1", header=head)),
    "compressed": (decode_compressed_image, lambda head: compressed(png(MILLIMETRES), "png", header=head)),
    "compressedDepth": (
        decode_compressed_depth,
        lambda head: compressed(png_payload(MILLIMETRES), "16UC1; compressedDepth", header=head),
    ),
    "points": (decode_points, lambda head: cloud(xyz_table(np.ones((3, 3))), header=head)),
}
EVERY_SENSOR = pytest.mark.parametrize("sensor", SENSORS)


@pytest.mark.hostile("Stamps: 0 R")
@EVERY_SENSOR
def test_a_stamp_of_zero_is_refused(sensor):
    decode, message = SENSORS[sensor]
    assert reject(decode, message(header(0, 0))).code == "STAMP_ZERO"


@pytest.mark.hostile("Stamps: nanosec >= 1e9 or negative R")
@EVERY_SENSOR
@pytest.mark.parametrize(
    ("sec", "nanosec"), [(1, 10**9), (1, 2**32 - 1), (-1, 5), (-(2**31), 0), (0, -1), (-1, 2**32 - 1)]
)
def test_a_malformed_stamp_is_refused(sensor, sec, nanosec):
    decode, message = SENSORS[sensor]
    assert reject(decode, message(header(sec, nanosec))).code == "STAMP_INVALID"


@pytest.mark.hostile("Stamps: 19-digit nanoseconds kept exactly from message to file")
@EVERY_SENSOR
@pytest.mark.parametrize(
    ("sec", "nanosec", "expected"),
    [
        (1_700_000_000, 123_456_789, 1_700_000_000_123_456_789),
        (2**31 - 1, 999_999_999, 2_147_483_647_999_999_999),
        (0, 1, 1),
    ],
)
def test_nanoseconds_are_kept_exactly(sensor, sec, nanosec, expected):
    decode, message = SENSORS[sensor]
    found = decode(message(header(sec, nanosec))).stamp_ns
    assert found == expected
    assert type(found) is int


@given(st.integers(0, 2**32 - 1), st.integers(0, 10**9 - 1))
def test_any_time_is_read_without_rounding(sec, nanosec):
    if sec == nanosec == 0:
        return
    assert str(stamp_ns(SimpleNamespace(sec=np.uint32(sec), nanosec=np.uint32(nanosec)))) == str(sec * 10**9 + nanosec)


@pytest.mark.hostile("Frames and TF: Empty frame_id N with extrinsics by parameter, else R")
@EVERY_SENSOR
@pytest.mark.parametrize("frame_id", ["", "/"])
def test_an_empty_frame_is_noted(sensor, frame_id):
    """Who asks TF for its place refuses it, see test_extrinsics.py."""
    decode, message = SENSORS[sensor]
    observation = decode(message(header(frame_id=frame_id)))
    assert observation.frame_id == ""
    assert "FRAME_ID_EMPTY" in [note.code for note in observation.notes]


@pytest.mark.hostile("Frames and TF: leading slash stripped N")
@EVERY_SENSOR
@pytest.mark.parametrize("slashes", ["/", "//"])
def test_a_leading_slash_is_stripped_with_a_note(sensor, slashes):
    decode, message = SENSORS[sensor]
    observation = decode(message(header(frame_id=slashes + "robot/lidar")))
    assert observation.frame_id == "robot/lidar"
    assert [note.code for note in observation.notes] == ["FRAME_ID_SLASH"]
    assert "robot/lidar" in str(observation.notes[0])


@EVERY_SENSOR
@pytest.mark.parametrize("frame_id", ["f" * 257, "a\nb", "a\0"])
def test_a_frame_that_cannot_be_shown_is_refused(sensor, frame_id):
    decode, message = SENSORS[sensor]
    error = reject(decode, message(header(frame_id=frame_id)))
    assert error.code == "FRAME_ID_INVALID"
    assert error.found.isprintable()
    assert len(error.found) < 100
