# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What each decoder refuses, one message a line: by its code, in a short line, before it costs memory."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from vigg_ros.sensors.point_cloud import decode_points
from vigg_ros.sensors.stamped_pose import decode_pose, decode_transform
from vigg_ros_testing.decoder_samples import EACH_SENSOR, assert_refused, cases, raw_camera, rectified_camera
from vigg_ros_testing.message_samples import (
    camera_info,
    cloud,
    header,
    point_field,
    pose_stamped,
    region,
    reject,
    transform_stamped,
    xyz_table,
)

TYPES = pytest.mark.hostile("PointCloud2: float64 xyz A, integer xyz R")
SHORT = pytest.mark.hostile("PointCloud2: data shorter than row_step * height R, longer N")
MISSING = pytest.mark.hostile("PointCloud2: xyz missing R with the fields listed")
COUNT = pytest.mark.hostile("PointCloud2: count other than 1 on x, y, z R")
TWICE = pytest.mark.hostile("PointCloud2: duplicate field names R if xyz")
OFFSET = pytest.mark.hostile("PointCloud2: offset beyond the step R")
OVERFLOW = pytest.mark.hostile("PointCloud2: point_step 0 or overflowing sizes R before allocation")
NO_POINTS = pytest.mark.hostile("PointCloud2: 0 points R")
K_ZERO = pytest.mark.hostile("CameraInfo: K zero R")
FOCAL = pytest.mark.hostile("CameraInfo: NaN, focal length <= 0 R")
SIZES = pytest.mark.hostile("CameraInfo: size differs from the image: binning and ROI consistent A, else R")
MODELS = pytest.mark.hostile(
    "CameraInfo: plumb_bob with 0, 4 or 5, rational_polynomial with 8, 12 or 14, equidistant with 4 "
    "coefficients A, others R unless all D are 0"
)
QUATERNION = pytest.mark.hostile("Frames and TF: quaternion of norm 0 or NaN R")
ZERO = pytest.mark.hostile("Stamps: 0 R")
MALFORMED = pytest.mark.hostile("Stamps: nanosec >= 1e9 or negative R")

U32 = 2**32 - 1
POINTS = np.array([[1.0, 2.0, 3.0], [-4.0, 5.5, -6.25], [7.0, 0.0, 0.0], [0.0, -8.0, 9.0]])
TABLE = xyz_table(POINTS, intensity=np.zeros(4, "<f4"))
FIELD_LISTS = ([], [point_field("n" * 10_000, 0)] * 3, [point_field("x", 0)] * 300)


def with_field(index: int, **changes: Any) -> Any:
    """Points whose field x, y, z or intensity is another one."""
    message = cloud(TABLE)
    vars(message.fields[index]).update(changes)
    return message


CLOUDS = [
    (decode_points, "CLOUD_FIELD_TYPE", TYPES, [with_field(1, datatype=kind) for kind in range(1, 7)]),
    (decode_points, "CLOUD_FIELD_TYPE", (), [with_field(2, datatype=kind) for kind in (0, 9, 255)]),
    (decode_points, "CLOUD_FIELD_TYPE", COUNT, [with_field(axis, count=n) for axis in range(3) for n in (0, 2)]),
    (decode_points, "CLOUD_LAYOUT", COUNT, [with_field(axis, count=U32) for axis in range(3)]),
    (decode_points, "CLOUD_FIELDS", TWICE, [with_field(3, name=axis) for axis in "xyz"]),
    (decode_points, "CLOUD_FIELDS", MISSING, [cloud(TABLE, fields=fields) for fields in FIELD_LISTS]),
    (decode_points, "CLOUD_LAYOUT", OFFSET, [with_field(axis, offset=n) for axis in (0, 2) for n in (13, 16, U32)]),
    (decode_points, "CLOUD_DATA_SHORT", SHORT, [cloud(TABLE, data=b"\0" * size) for size in (0, 63)]),
    (decode_points, "CLOUD_LAYOUT", OVERFLOW, [cloud(TABLE, point_step=0), cloud(TABLE, height=2, row_step=11)]),
    (decode_points, "CLOUD_DATA_SHORT", OVERFLOW, [cloud(TABLE, point_step=U32, row_step=U32, width=1)]),
    (decode_points, "CLOUD_DATA_SHORT", OVERFLOW, [cloud(TABLE, width=16_000_000, row_step=U32)]),
    (decode_points, "CLOUD_TOO_LARGE", OVERFLOW, [cloud(TABLE, width=U32, height=U32)]),
    (decode_points, "CLOUD_TOO_LARGE", OVERFLOW, [cloud(TABLE, width=2**31, height=2, row_step=0)]),
    (decode_points, "CLOUD_TOO_LARGE", OVERFLOW, [cloud(TABLE, width=16_000_001)]),
    (decode_points, "CLOUD_EMPTY", NO_POINTS, [cloud(TABLE, width=0, row_step=0, data=b""), cloud(TABLE, height=0)]),
    (decode_points, "CLOUD_EMPTY", NO_POINTS, [cloud(xyz_table(np.full((5, 3), np.nan)))]),
]

NO_K = [[0.0] * 9, [0.0, 0, 319.5, 0, 500, 239.5, 0, 0, 1]]
NO_FOCAL_LENGTHS = [
    (at, value) for at in (("k", 0), ("k", 4), ("p", 0), ("p", 5)) for value in (np.nan, np.inf, -500.0)
]
LENSES = [("plumb_bob", 3), ("plumb_bob", 8), ("rational_polynomial", 5), ("equidistant", 5), ("", 5)]
STRANGE_LENSES = [*LENSES, ("thin_prism_fisheye", 8), ("q" * 10_000, 4)]
REGIONS = [(1, 0, 0, 0), (0, 0, 641, 480), (300, 0, 341, 480), (0, U32, 10, U32), (0, 0, 10, 0)]
NO_ROTATIONS = ([1.0] * 9, [-1.0, 0, 0, 0, 1, 0, 0, 0, 1], [2.0, 0, 0, 0, 2, 0, 0, 0, 2])


def with_number(name: str, at: int, value: float) -> Any:
    """A calibration with one number of a matrix replaced."""
    values = list(getattr(camera_info(), name))
    values[at] = value
    return camera_info(**{name: values})


CALIBRATIONS = [
    row
    for kind in (raw_camera, rectified_camera)
    for row in (
        (kind, "BAD_INTRINSICS", K_ZERO, [camera_info(k=k, **p) for k in NO_K for p in ({}, {"p": [0.0] * 12})]),
        (kind, "BAD_INTRINSICS", FOCAL, [with_number(*place, value) for place, value in NO_FOCAL_LENGTHS]),
        (kind, "BAD_INTRINSICS", FOCAL, [with_number(name, 2, np.nan) for name in "dkrp"]),
        (kind, "BAD_INTRINSICS", (), [camera_info(k=[1.0] * 8), camera_info(p=[1.0] * 9), with_number("k", 1, 3.0)]),
        (kind, "IMAGE_DIMENSIONS", (), [camera_info(width=0), camera_info(width=U32, height=U32)]),
        (kind, "STAMP_INVALID", (), [camera_info(header=header(1, 10**9))]),
        (kind, "BAD_REGION", SIZES, [camera_info(roi=region(*window)) for window in REGIONS]),
        (kind, "BAD_BINNING", SIZES, [camera_info(binning_x=641), camera_info(binning_y=U32)]),
    )
] + [
    (raw_camera, "BAD_DISTORTION", MODELS, [camera_info(distortion_model=m, d=[0.01] * n) for m, n in STRANGE_LENSES]),
    (raw_camera, "BAD_RECTIFICATION", (), [camera_info(d=[-0.3, 0.1, 0, 0], r=r) for r in NO_ROTATIONS]),
]

NO_QUATERNIONS = [{"w": 0.0}, {"w": 1e-9}, {"x": np.nan}, {"y": np.inf}, {"w": -np.inf}]
NOWHERE = [{axis: value} for axis in "xyz" for value in (np.nan, np.inf, -np.inf)]
WITHOUT_NAMES = ({"child_frame_id": ""}, {"child_frame_id": "/"}, {"header": header(frame_id="")})

POSES = [
    (decode_pose, "BAD_QUATERNION", QUATERNION, [pose_stamped(orientation=q) for q in NO_QUATERNIONS]),
    (decode_transform, "BAD_QUATERNION", QUATERNION, [transform_stamped(orientation=q) for q in NO_QUATERNIONS]),
    (decode_pose, "BAD_POSITION", (), [pose_stamped(position=place) for place in NOWHERE]),
    (decode_transform, "BAD_POSITION", (), [transform_stamped(position=place) for place in NOWHERE]),
    (decode_transform, "FRAME_ID_EMPTY", (), [transform_stamped(**changes) for changes in WITHOUT_NAMES]),
    (decode_pose, "STAMP_ZERO", (), [pose_stamped(header=header(0, 0))]),
]

MALFORMED_STAMPS = ((1, 10**9), (1, U32), (-1, 5), (-(2**31), 0), (0, -1), (-1, U32))
STRANGE_NAMES = ("f" * 257, "a\nb", "a\0")

HEADERS = [
    row
    for one in EACH_SENSOR
    for row in (
        (one.decode, "STAMP_ZERO", ZERO, [one.changed(header=header(0, 0))]),
        (one.decode, "STAMP_INVALID", MALFORMED, [one.changed(header=header(*stamp)) for stamp in MALFORMED_STAMPS]),
        (one.decode, "FRAME_ID_INVALID", (), [one.changed(header=header(frame_id=name)) for name in STRANGE_NAMES]),
    )
]


@pytest.mark.parametrize(("decode", "message", "code"), cases(CLOUDS, CALIBRATIONS, POSES, HEADERS))
def test_what_cannot_be_used_is_refused(decode: Callable[[Any], Any], message: Any, code: str) -> None:
    assert_refused(decode, message, code)


@MISSING
def test_a_cloud_without_coordinates_is_refused_by_the_names_it_has() -> None:
    fields = [point_field("range", 0), point_field("azimuth", 4), point_field("z", 8)]
    assert "'range', 'azimuth', 'z'" in reject(decode_points, cloud(TABLE, fields=fields)).found
