# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What decoders of images refuse, one message a line, by its code before it costs memory; and what they note."""

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
from vigg_ros_testing.decoder_samples import assert_refused, cases, rectified_camera
from vigg_ros_testing.message_samples import (
    camera_info,
    cloud,
    compressed,
    image,
    jpeg,
    png,
    png_payload,
    rvl_payload,
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


def compressed_each(*pairs: tuple[bytes, str]) -> list[Any]:
    return [compressed(*pair) for pair in pairs]


DEPTH_TEXTS = (AS_PNG, "32FC1; compressedDepth rvl", "16UC1; png compressed ")
NO_QUANTISATIONS = ((np.nan, 0.0), (1.0, np.inf), (0.0, 0.0), (-1.0, 5.0))
QUANTISED = [(png_payload(MILLIMETRES, *numbers), "32FC1; compressedDepth") for numbers in NO_QUANTISATIONS]
SHORT_HEADERS = [(b"\0" * size, text) for text in (AS_PNG, AS_RVL) for size in (0, 1, 11, 12)]
COLOURED = [
    (jpeg(NOISE), "rgb8; jpeg compressed bgr8"),
    *((b"\0" * 12 + png(pixels), AS_PNG) for pixels in (NOISE, NOISE[:, :, 0])),
]
OTHER_FORMATS = [
    (jpeg(NOISE), "16UC1; jpeg compressed "),
    *((PNG_DEPTH, text) for text in ("16UC1; compressedDepth zstd", "64FC1; compressedDepth png")),
    (RVL_DEPTH, AS_PNG),
]
STRANGE = [(PNG_DEPTH, text) for text in ("jpeg", "", "z" * 10_000)]
COMPRESSED_IMAGES = [
    (decode_compressed_image, "COMPRESSED_BROKEN", COMPRESSED, jpegs(*CUTS, *HEADERS_ALONE)),
    (decode_compressed_image, "COMPRESSED_FORMAT", COMPRESSED, jpegs(*NO_IMAGES)),
    (decode_compressed_image, "IMAGE_DIMENSIONS", COMPRESSED, jpegs(*BOMBS, jpeg_of_size(9_000, 7_000))),
    (decode_compressed_image, "IMAGE_IS_DEPTH", WRONG_TOPIC, [compressed(png(NOISE), text) for text in DEPTH_TEXTS]),
    (decode_compressed_depth, "IMAGE_DIMENSIONS", COMPRESSED, [compressed(b"\0" * 12 + png, AS_PNG) for png in BOMBS]),
    (decode_compressed_depth, "DEPTH_QUANTISATION", (), compressed_each(*QUANTISED)),
    (decode_compressed_depth, "DEPTH_HEADER", COMPRESSED, compressed_each(*SHORT_HEADERS, (RVL_DEPTH[:20], AS_RVL))),
    (decode_compressed_depth, "IMAGE_DIMENSIONS", COMPRESSED, rvls((0, 0), (0, 3), (U32, U32), (4_000, 4_000))),
    (decode_compressed_depth, "RVL_OVERRUN", COMPRESSED, rvls((4, 2), (4, 4), (5, 3), (3, 3))),
    (decode_compressed_depth, "RVL_OVERRUN", COMPRESSED, [compressed(RVL_DEPTH[:n], AS_RVL) for n in (21, 24, 28)]),
    (decode_compressed_depth, "DEPTH_IS_COLOUR", WRONG_TOPIC, compressed_each(*COLOURED)),
    (decode_compressed_depth, "COMPRESSED_FORMAT", WRONG_TOPIC, compressed_each(*OTHER_FORMATS)),
    (decode_compressed_depth, "DEPTH_ENCODING", WRONG_TOPIC, compressed_each(*STRANGE)),
    (decode_compressed_depth, "NO_DEPTH", (), [compressed(rvl_payload(np.zeros((3, 4), "u2")), AS_RVL)]),
    (decode_compressed_depth, "COMPRESSED_BROKEN", (), [compressed(WRONG_CHECKSUM, AS_PNG)]),
]


@pytest.mark.parametrize(("decode", "message", "code"), cases(IMAGES, COMPRESSED_IMAGES))
def test_what_cannot_be_used_is_refused(decode: Callable[[Any], Any], message: Any, code: str) -> None:
    assert_refused(decode, message, code)


POINTS = xyz_table(np.arange(1.0, 13.0).reshape(4, 3))
LONG = pytest.mark.hostile("PointCloud2: data shorter than row_step * height R, longer N")
UNIT = pytest.mark.hostile("Image: implausible depth unit (median over 100 m or under 5 cm) N")


def mostly(value: float, encoding: str) -> Any:
    """Depth of this value; a median, so what a few pixels say does not matter."""
    values = np.full((120, 160), value, "<f4" if encoding == "32FC1" else "<u2")
    values[:10] = 1000
    return image(values, encoding)


NO_HEADER = (AS_PNG, "16UC1; png compressed ")
P_OF_STEREO = [400.0, 0, 300, -40, 0, 410, 200, 0, 0, 0, 1, 0]
NOTED = [
    (decode_image, "DATA_LONG", DATA, [image(COLOUR, "rgb8", data=COLOUR.tobytes() + b"\xff" * 3)]),
    (decode_depth, "DATA_LONG", DATA, [image(DEPTH * 1000, "16UC1", data=(DEPTH * 1000).tobytes() + b"\0")]),
    (decode_points, "DATA_LONG", LONG, [cloud(POINTS, data=POINTS.tobytes() + b"\1")]),
    (decode_points, "CLOUD_ROW_STEP", (), [cloud(POINTS, row_step=0)]),
    (decode_image, "DARK_16_BIT", (), [image(DEPTH * 4095, "mono16")]),
    (decode_depth, "DEPTH_UNIT", UNIT, [mostly(value, "32FC1") for value in (1500.0, 101.0)]),
    (decode_depth, "DEPTH_UNIT", UNIT, [mostly(value, "16UC1") for value in (2, 49)]),
    (decode_depth, "", UNIT, [mostly(99.0, "32FC1"), mostly(51, "16UC1")]),
    (decode_compressed_depth, "DEPTH_HEADER_MISSING", (), [compressed(png(MILLIMETRES), text) for text in NO_HEADER]),
    (rectified_camera, "STEREO_OFFSET", (), [camera_info(p=P_OF_STEREO)]),
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
