# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What each decoder refuses, one message a line: by its code, in a short line, before it costs memory."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from vigg_ros.sensors.colour_image import decode_image
from vigg_ros.sensors.compressed_depth import decode_compressed_depth
from vigg_ros.sensors.depth_image import decode_depth
from vigg_ros.sensors.point_cloud import decode_points
from vigg_ros_testing.decoder_samples import cases, rectified_camera
from vigg_ros_testing.message_samples import camera_info, cloud, compressed, image, png, xyz_table

COLOUR, DEPTH = np.full((4, 6, 3), 200, "u1"), np.ones((4, 6), "<u2")
MILLIMETRES = np.array([[0, 1000, 1500, 2000], [65_535, 0, 0, 3000], [40_000, 39_999, 1, 0]], "u2")
AS_PNG = "16UC1; compressedDepth png"
POINTS = xyz_table(np.arange(1.0, 13.0).reshape(4, 3))
LONG = pytest.mark.hostile("Image: data short R, long N")
LONG_CLOUD = pytest.mark.hostile("PointCloud2: data shorter than row_step * height R, longer N")
UNIT = pytest.mark.hostile("Image: implausible depth unit (median over 100 m or under 5 cm) N")


def mostly(value: float, encoding: str) -> Any:
    """Depth of this value; a median, so what a few pixels say does not matter."""
    values = np.full((120, 160), value, "<f4" if encoding == "32FC1" else "<u2")
    values[:10] = 1000
    return image(values, encoding)


NOTED = [
    (decode_image, "DATA_LONG", LONG, [image(COLOUR, "rgb8", data=COLOUR.tobytes() + b"\xff" * 3)]),
    (decode_depth, "DATA_LONG", LONG, [image(DEPTH * 1000, "16UC1", data=(DEPTH * 1000).tobytes() + b"\0")]),
    (decode_points, "DATA_LONG", LONG_CLOUD, [cloud(POINTS, data=POINTS.tobytes() + b"\1")]),
    (decode_points, "CLOUD_ROW_STEP", (), [cloud(POINTS, row_step=0)]),
    (decode_image, "DARK_16_BIT", (), [image(DEPTH * 4095, "mono16")]),
    (decode_depth, "DEPTH_UNIT", UNIT, [mostly(value, "32FC1") for value in (1500.0, 101.0)]),
    (decode_depth, "DEPTH_UNIT", UNIT, [mostly(value, "16UC1") for value in (2, 49)]),
    (decode_depth, "", UNIT, [mostly(99.0, "32FC1"), mostly(51, "16UC1")]),
    (
        decode_compressed_depth,
        "DEPTH_HEADER_MISSING",
        (),
        [compressed(png(MILLIMETRES), text) for text in (AS_PNG, "16UC1; png compressed ")],
    ),
    (rectified_camera, "STEREO_OFFSET", (), [camera_info(p=[400.0, 0, 300, -40, 0, 410, 200, 0, 0, 0, 1, 0])]),
]


@pytest.mark.parametrize(("decode", "message", "code"), cases(NOTED))
def test_what_is_odd_is_taken_with_a_note(decode: Callable[[Any], Any], message: Any, code: str) -> None:
    notes = decode(message).notes
    assert [note.code for note in notes] == ([code] if code else [])
    assert all(note.remedy in str(note) for note in notes)


def test_a_surplus_and_a_useless_row_step_change_nothing() -> None:
    longer = image(COLOUR, "rgb8", data=COLOUR.tobytes() + b"\xff" * 3)
    np.testing.assert_array_equal(decode_image(longer).image, COLOUR)
    for odd in (cloud(POINTS, data=POINTS.tobytes() + b"\1"), cloud(POINTS, row_step=0)):
        np.testing.assert_array_equal(decode_points(odd).points, np.arange(1.0, 13.0).reshape(4, 3))
