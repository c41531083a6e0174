# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What each decoder refuses, one message a line: by its code, in a short line, before it costs memory."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from vigg_ros.sensors.colour_image import decode_image
from vigg_ros.sensors.compressed_depth import decode_compressed_depth
from vigg_ros.sensors.compressed_image import decode_compressed_image
from vigg_ros.sensors.depth_image import decode_depth
from vigg_ros.sensors.point_cloud import decode_points
from vigg_ros.sensors.stamped_pose import decode_pose, decode_transform
from vigg_ros_testing.decoder_samples import EACH_SENSOR, raw_camera, rectified_camera
from vigg_ros_testing.message_samples import (
    camera_info,
    cloud,
    compressed,
    header,
    image,
    jpeg,
    png,
    png_payload,
    point_field,
    pose_stamped,
    region,
    reject,
    rvl_payload,
    transform_stamped,
    xyz_table,
)

STEP = pytest.mark.hostile("Image: step too short R")
DATA = pytest.mark.hostile("Image: data short R, long N")
EMPTY = pytest.mark.hostile("Image: 0x0 R")
CAP = pytest.mark.hostile("Image: dimensions to 2^32-1 R before any allocation (cap 64 Mpx)")
ENCODING = pytest.mark.hostile("Image: empty, unknown or 10 kB encoding R, shown truncated")
ODD = pytest.mark.hostile("Image: odd-width yuv R")
WRONG_TOPIC = pytest.mark.hostile(
    "Image: depth 16UC1 mono16 32FC1 64FC1 A, colour on the depth topic R, depth on the image topic R"
)
COMPRESSED = pytest.mark.hostile(
    "Image: compressed: truncated or not an image R; compressedDepth PNG and RVL A; header under 12 bytes, "
    "dimensions 0 or far beyond the payload, RVL overrun, PNG bomb R"
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
GREY, COLOUR, DEPTH = np.ones((4, 6), "u1"), np.full((4, 6, 3), 200, "u1"), np.ones((4, 6), "<u2")
NO_SIZES = ((0, 0), (0, 4), (4, 0))
SIZES_BEYOND = ((U32, U32), (U32, 1), (1, U32), (32_767, 1), (1, 32_767), (8_001, 8_000))
UNKNOWN_ENCODINGS = ("", "RGB8", "rgb8 ", "8UC2", "h264", "\n\x1b[31m", "x" * 10_000)
COLOUR_ENCODINGS = ("rgb8", "bgr8", "mono8", "bayer_rggb8", "yuyv", "nv12", "8UC1")
ODD_SIZES = (("uyvy", 5, 4), ("yuv422", 5, 4), ("yuyv", 5, 4), ("nv12", 5, 4), ("nv21", 6, 3))
NOTHING_FAR = np.array([[0, np.nan, np.inf, -1, 1e30, 1, 2]])


def cut(pixels: np.ndarray, encoding: str, end: int) -> Any:
    return image(pixels, encoding, data=pixels.tobytes()[:end])


def sized(pixels: np.ndarray, encoding: str, width: int, height: int, **changes: Any) -> Any:
    return image(pixels, encoding, width=width, height=height, **changes)


IMAGES = [
    (decode_image, "IMAGE_STEP", STEP, [image(COLOUR, "rgb8", step=step) for step in (0, 5, 17)]),
    (decode_depth, "IMAGE_STEP", STEP, [image(DEPTH, "16UC1", step=5)]),
    (decode_image, "IMAGE_DATA_SHORT", DATA, [cut(COLOUR, "rgb8", end) for end in (-1, 0)]),
    (decode_image, "IMAGE_DATA_SHORT", DATA, [cut(COLOUR[:, :, :2].copy(), "uyvy", end) for end in (-1, 0)]),
    (decode_image, "IMAGE_DATA_SHORT", DATA, [cut(GREY, "mono8", end) for end in (-1, 0)]),
    (decode_image, "IMAGE_DATA_SHORT", DATA, [image(GREY, "nv12")]),  # its colours are missing
    (decode_depth, "IMAGE_DATA_SHORT", DATA, [cut(DEPTH, "16UC1", -1)]),
    (decode_image, "IMAGE_DIMENSIONS", EMPTY, [sized(GREY, "mono8", *size, data=b"") for size in NO_SIZES]),
    (decode_depth, "IMAGE_DIMENSIONS", EMPTY, [sized(DEPTH, "16UC1", *size, data=b"") for size in NO_SIZES]),
    (decode_image, "IMAGE_DIMENSIONS", CAP, [sized(COLOUR, "rgb8", *size, step=U32) for size in SIZES_BEYOND]),
    (decode_image, "IMAGE_DIMENSIONS", CAP, [sized(GREY, "nv12", *size, step=U32) for size in SIZES_BEYOND]),
    (decode_depth, "IMAGE_DIMENSIONS", CAP, [sized(DEPTH, "16UC1", *size, step=U32) for size in SIZES_BEYOND]),
    (decode_image, "IMAGE_ENCODING", ENCODING, [image(GREY, text) for text in UNKNOWN_ENCODINGS]),
    (decode_depth, "DEPTH_ENCODING", ENCODING, [image(DEPTH, text) for text in ("", "16SC1", "32FC2", "y" * 10_000)]),
    (decode_image, "IMAGE_DIMENSIONS", ODD, [sized(COLOUR, *size) for size in ODD_SIZES]),
    (decode_image, "IMAGE_DIMENSIONS", (), [image(np.ones(size, "u1"), "bayer_rggb8") for size in ((1, 9), (2, 2))]),
    (decode_image, "IMAGE_IS_DEPTH", WRONG_TOPIC, [image(DEPTH, text) for text in ("16UC1", "32FC1", "64FC1")]),
    (decode_depth, "DEPTH_IS_COLOUR", WRONG_TOPIC, [image(COLOUR, text) for text in COLOUR_ENCODINGS]),
    (decode_depth, "NO_DEPTH", (), [image(NOTHING_FAR, "64FC1")]),
]

NOISE = np.random.default_rng(1).integers(0, 255, (48, 64, 3), dtype=np.uint8)
MILLIMETRES = np.array([[0, 1000, 1500, 2000], [65_535, 0, 0, 3000], [40_000, 39_999, 1, 0]], "u2")
PNG_DEPTH, RVL_DEPTH = png_payload(MILLIMETRES), rvl_payload(MILLIMETRES)
AS_PNG, AS_RVL = "16UC1; compressedDepth png", "16UC1; compressedDepth rvl"
CUTS = [data[: int(len(data) * share)] for data in (jpeg(NOISE), png(NOISE)) for share in (0.1, 0.5, 0.9, 0.999)]
NO_IMAGES = (b"", b"\xff", b"\xff\xd8", b"\x89PNG", b"GIF89a" + b"\0" * 50, b"II*\0" + b"\0" * 50, b"x" * 999)
HEADERS_ALONE = [
    *(b"\xff\xd8\xff", b"\xff\xd8\xff\xd9", b"\xff\xd8" + b"\xff\xff" * 500),
    *(b"\xff\xd8" + segment * 5000 + b"\xff\xd9" for segment in (b"\xff\xe0\0\2", b"\xff\xe0\0\0")),
    *(b"\x89PNG\r\n\x1a\n", b"\x89PNG\r\n\x1a\n" + b"\0" * 100 + b"\0\0\0\0IEND"),
    png(np.ones((40, 40), "u1"), claimed=(40, 80)),
]
BOMB_SIZES = ((0, 0), (0, 4), (2**31, 2**31), (30_000, 30_000), (8_000, 7_999))
BOMBS = [png(np.zeros((4, 4), "u1"), claimed=size) for size in BOMB_SIZES]
WRONG_CHECKSUM = PNG_DEPTH[:-14] + bytes((PNG_DEPTH[-14] ^ 0xFF,)) + PNG_DEPTH[-13:]
"""The last 12 bytes are the end, the 4 before them the checksum of the pixels."""


def jpeg_of_size(width: int, height: int) -> bytes:
    head, mark, tail = jpeg(np.zeros((16, 16), "u1")).partition(b"\xff\xc0")
    return head + mark + tail[:3] + struct.pack(">HH", height, width) + tail[7:]


def jpegs(*datas: bytes) -> list[Any]:
    return [compressed(data, "jpeg") for data in datas]


def rvls(*sizes: tuple[int, int]) -> list[Any]:
    return [compressed(RVL_DEPTH[:12] + struct.pack("<II", *size) + RVL_DEPTH[20:], AS_RVL) for size in sizes]


COMPRESSED_IMAGES = [
    (decode_compressed_image, "COMPRESSED_BROKEN", COMPRESSED, jpegs(*CUTS, *HEADERS_ALONE)),
    (decode_compressed_image, "COMPRESSED_FORMAT", COMPRESSED, jpegs(*NO_IMAGES)),
    (decode_compressed_image, "IMAGE_DIMENSIONS", COMPRESSED, jpegs(*BOMBS, jpeg_of_size(9_000, 7_000))),
    (decode_compressed_depth, "IMAGE_DIMENSIONS", COMPRESSED, [compressed(b"\0" * 12 + png, AS_PNG) for png in BOMBS]),
    (
        decode_compressed_image,
        "IMAGE_IS_DEPTH",
        WRONG_TOPIC,
        [compressed(png(NOISE), text) for text in (AS_PNG, "32FC1; compressedDepth rvl", "16UC1; png compressed ")],
    ),
    (
        decode_compressed_depth,
        "DEPTH_QUANTISATION",
        (),
        [
            compressed(png_payload(MILLIMETRES, a, b), "32FC1; compressedDepth")
            for a, b in ((np.nan, 0.0), (1.0, np.inf), (0.0, 0.0), (-1.0, 5.0))
        ],
    ),
    (
        decode_compressed_depth,
        "DEPTH_HEADER",
        COMPRESSED,
        [compressed(b"\0" * size, text) for text in (AS_PNG, AS_RVL) for size in (0, 1, 11, 12)],
    ),
    (decode_compressed_depth, "DEPTH_HEADER", COMPRESSED, [compressed(RVL_DEPTH[:20], AS_RVL)]),
    (decode_compressed_depth, "IMAGE_DIMENSIONS", COMPRESSED, rvls((0, 0), (0, 3), (U32, U32), (4_000, 4_000))),
    (decode_compressed_depth, "RVL_OVERRUN", COMPRESSED, rvls((4, 2), (4, 4), (5, 3), (3, 3))),
    (decode_compressed_depth, "RVL_OVERRUN", COMPRESSED, [compressed(RVL_DEPTH[:n], AS_RVL) for n in (21, 24, 28)]),
    (
        decode_compressed_depth,
        "DEPTH_IS_COLOUR",
        WRONG_TOPIC,
        [
            compressed(jpeg(NOISE), "rgb8; jpeg compressed bgr8"),
            compressed(b"\0" * 12 + png(NOISE), AS_PNG),
            compressed(b"\0" * 12 + png(NOISE[:, :, 0]), AS_PNG),
        ],
    ),
    (
        decode_compressed_depth,
        "COMPRESSED_FORMAT",
        WRONG_TOPIC,
        [
            compressed(jpeg(NOISE), "16UC1; jpeg compressed "),
            compressed(PNG_DEPTH, "16UC1; compressedDepth zstd"),
            compressed(PNG_DEPTH, "64FC1; compressedDepth png"),
            compressed(RVL_DEPTH, AS_PNG),
        ],
    ),
    (
        decode_compressed_depth,
        "DEPTH_ENCODING",
        WRONG_TOPIC,
        [compressed(PNG_DEPTH, text) for text in ("jpeg", "", "z" * 10_000)],
    ),
    (decode_compressed_depth, "NO_DEPTH", (), [compressed(rvl_payload(np.zeros((3, 4), "u2")), AS_RVL)]),
    (decode_compressed_depth, "COMPRESSED_BROKEN", (), [compressed(WRONG_CHECKSUM, AS_PNG)]),
]

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


def cases(*tables: list[tuple[Any, ...]]) -> list[Any]:
    return [
        pytest.param(decode, message, code, marks=marks, id=f"{decode.__name__} {code}")
        for decode, code, marks, messages in (row for table in tables for row in table)
        for message in messages
    ]


@pytest.mark.parametrize(
    ("decode", "message", "code"), cases(IMAGES, COMPRESSED_IMAGES, CLOUDS, CALIBRATIONS, POSES, HEADERS)
)
def test_what_cannot_be_used_is_refused(decode: Callable[[Any], Any], message: Any, code: str) -> None:
    error = reject(decode, message)
    assert error.code == code
    assert len(error.found) < 300
    assert error.found.isprintable()


@MISSING
def test_a_cloud_without_coordinates_is_refused_by_the_names_it_has() -> None:
    fields = [point_field("range", 0), point_field("azimuth", 4), point_field("z", 8)]
    assert "'range', 'azimuth', 'z'" in reject(decode_points, cloud(TABLE, fields=fields)).found
