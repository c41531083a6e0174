# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""JPEG, PNG and compressedDepth: files made by their specifications, and files that lie."""

from __future__ import annotations

import struct

import cv2
import numpy as np
import pytest

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.compressed_depth import decode_compressed_depth
from vigg_ros.sensors.compressed_image import decode_compressed_image
from vigg_ros_testing.message_samples import STAMP_NS, compressed, png, png_payload, reject, rvl_payload

COMPRESSED = (
    "Image: compressed: truncated or not an image R; compressedDepth PNG and RVL A; header under 12 bytes, "
    "dimensions 0 or far beyond the payload, RVL overrun, PNG bomb R"
)
RGB = np.array([[[200, 100, 50], [1, 2, 3]], [[255, 0, 0], [0, 0, 255]]], "u1")
BGR = [[[50, 100, 200], [3, 2, 1]], [[0, 0, 255], [255, 0, 0]]]


def jpeg(pixels: np.ndarray, quality: int = 95) -> bytes:
    return cv2.imencode(".jpg", pixels, (cv2.IMWRITE_JPEG_QUALITY, quality))[1].tobytes()


@pytest.mark.parametrize("text", ["png", "bgr8; png compressed bgr8", "rgb8; png compressed bgr8"])
@pytest.mark.parametrize("scale", [1, 257])
def test_png_gives_its_exact_colours(text, scale):
    pixels = RGB if scale == 1 else RGB.astype("u2") * scale
    decoded = decode_compressed_image(compressed(png(pixels), text))
    np.testing.assert_array_equal(decoded.image, BGR)
    assert decoded.image.dtype == np.uint8
    assert (decoded.stamp_ns, decoded.frame_id, decoded.notes) == (STAMP_NS, "camera", ())


@pytest.mark.parametrize("text", ["jpeg", "rgb8; jpeg compressed bgr8"])
def test_jpeg_gives_its_colours(text):
    pixels = np.zeros((32, 48, 3), "u1")
    pixels[:, :24] = (0, 0, 255)
    pixels[:, 24:] = (255, 0, 0)
    decoded = decode_compressed_image(compressed(jpeg(pixels), text)).image
    # The blocks of 16 next to the edge between the colours are left out; JPEG rounds the rest by up to 2.
    np.testing.assert_allclose(decoded[:, :8].astype(int), pixels[:, :8], atol=2)
    np.testing.assert_allclose(decoded[:, -8:].astype(int), pixels[:, -8:], atol=2)


def test_a_grey_jpeg_stays_grey():
    decoded = decode_compressed_image(compressed(jpeg(np.full((16, 16), 77, "u1")), "jpeg")).image
    assert decoded.shape == (16, 16)
    np.testing.assert_allclose(decoded.astype(int), 77, atol=1)


def test_a_mosaic_that_was_compressed_as_grey_gets_its_colours():
    mosaic = np.tile(np.array([[200, 100], [100, 50]], "u1"), (3, 3))
    decoded = decode_compressed_image(compressed(png(mosaic), "bayer_rggb8; png compressed ")).image
    np.testing.assert_array_equal(decoded[1:-1, 1:-1], np.broadcast_to([50, 100, 200], (4, 4, 3)))


def test_an_orientation_tag_does_not_turn_the_image():
    # EXIF orientation 6 asks viewers for a quarter turn; the camera's calibration is of the pixels.
    tag = struct.pack(">HHIHH", 0x0112, 3, 1, 6, 0)
    tiff = b"MM\0\x2a\0\0\0\x08" + struct.pack(">H", 1) + tag + b"\0\0\0\0"
    exif = b"Exif\0\0" + tiff
    data = jpeg(np.zeros((16, 32, 3), "u1"))
    data = data[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + data[2:]
    assert decode_compressed_image(compressed(data, "jpeg")).image.shape == (16, 32, 3)


NOISE = np.random.default_rng(1).integers(0, 255, (48, 64, 3), dtype=np.uint8)


@pytest.mark.hostile(COMPRESSED)
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.999])
@pytest.mark.parametrize("encode", [jpeg, png])
def test_a_cut_image_is_refused(encode, share):
    data = encode(NOISE)
    error = reject(decode_compressed_image, compressed(data[: int(len(data) * share)], "jpeg"))
    assert error.code == "COMPRESSED_BROKEN"


@pytest.mark.hostile(COMPRESSED)
@pytest.mark.parametrize(
    "data", [b"", b"\xff", b"\xff\xd8", b"\x89PNG", b"GIF89a" + b"\0" * 50, b"II*\0" + b"\0" * 50, b"x" * 999]
)
def test_what_is_no_image_is_refused(data):
    assert reject(decode_compressed_image, compressed(data, "jpeg")).code == "COMPRESSED_FORMAT"


@pytest.mark.hostile(COMPRESSED)
@pytest.mark.parametrize(
    "data",
    [
        b"\xff\xd8\xff",
        b"\xff\xd8\xff\xd9",
        b"\xff\xd8" + b"\xff\xff" * 500,
        b"\xff\xd8" + b"\xff\xe0\0\2" * 5000 + b"\xff\xd9",
        b"\xff\xd8" + b"\xff\xe0\0\0" * 5000 + b"\xff\xd9",
        b"\x89PNG\r\n\x1a\n",
        b"\x89PNG\r\n\x1a\n" + b"\0" * 100 + b"\0\0\0\0IEND",
    ],
)
def test_headers_without_an_image_are_refused(data):
    assert reject(decode_compressed_image, compressed(data, "jpeg")).code == "COMPRESSED_BROKEN"


@pytest.mark.hostile(COMPRESSED)
@pytest.mark.parametrize("claimed", [(0, 0), (0, 4), (2**31, 2**31), (30_000, 30_000), (8_000, 7_999)])
def test_a_png_bomb_is_refused_by_its_header(claimed):
    data = png(np.zeros((4, 4), "u1"), claimed=claimed)
    assert reject(decode_compressed_image, compressed(data, "png")).code == "IMAGE_DIMENSIONS"
    depth = compressed(b"\0" * 12 + data, "16UC1; compressedDepth png")
    assert reject(decode_compressed_depth, depth).code == "IMAGE_DIMENSIONS"


@pytest.mark.hostile(COMPRESSED)
def test_a_jpeg_that_claims_too_much_is_refused_by_its_header():
    data = bytearray(jpeg(np.zeros((16, 16), "u1")))
    at = data.index(b"\xff\xc0")
    data[at + 5 : at + 9] = struct.pack(">HH", 7_000, 9_000)
    assert reject(decode_compressed_image, compressed(bytes(data), "jpeg")).code == "IMAGE_DIMENSIONS"


def test_the_emptiest_images_are_within_the_claim_limit():
    for data in (png(np.zeros((1500, 1500), "u1")), jpeg(np.zeros((1500, 1500), "u1"), quality=1)):
        assert decode_compressed_image(compressed(data, "png")).image.shape == (1500, 1500)


def test_a_png_that_holds_less_than_it_says_is_refused():
    data = png(np.ones((40, 40), "u1"), claimed=(40, 80))
    assert reject(decode_compressed_image, compressed(data, "png")).code == "COMPRESSED_BROKEN"


@pytest.mark.hostile("Image: depth 16UC1 mono16 32FC1 64FC1 A, colour on the depth topic R, depth on the image topic R")
@pytest.mark.parametrize("text", ["16UC1; compressedDepth png", "32FC1; compressedDepth rvl", "16UC1; png compressed "])
def test_depth_on_the_image_topic_is_refused(text):
    assert reject(decode_compressed_image, compressed(png(RGB), text)).code == "IMAGE_IS_DEPTH"


MILLIMETRES = np.array([[0, 1000, 1500, 2000], [65_535, 0, 0, 3000], [40_000, 39_999, 1, 0]], "u2")
METRES = [[0, 1, 1.5, 2], [0, 0, 0, 3], [40, 39.999, 0.001, 0]]


@pytest.mark.hostile(COMPRESSED)
@pytest.mark.parametrize(
    ("text", "payload"),
    [
        ("16UC1; compressedDepth", png_payload),
        ("16UC1; compressedDepth png", png_payload),
        ("mono16; compressedDepth png", png_payload),
        ("16UC1", png_payload),
        ("16UC1; compressedDepth rvl", rvl_payload),
    ],
)
def test_sixteen_bits_become_metres(text, payload):
    decoded = decode_compressed_depth(compressed(payload(MILLIMETRES), text))
    np.testing.assert_allclose(decoded.depth_m, METRES, rtol=2e-7)
    assert (decoded.stamp_ns, decoded.frame_id, decoded.notes) == (STAMP_NS, "camera", ())


def test_a_png_without_the_header_is_read_and_noted():
    for text in ("16UC1; compressedDepth png", "16UC1; png compressed "):
        decoded = decode_compressed_depth(compressed(png(MILLIMETRES), text))
        np.testing.assert_allclose(decoded.depth_m, METRES, rtol=2e-7)
        assert [note.code for note in decoded.notes] == ["DEPTH_HEADER_MISSING"]


# The transport's defaults, depth_quantization 100 and depth_max 10: A = 100 * 101, B = 1 - A / 10.
A, B = 10_100.0, -1_009.0


@pytest.mark.hostile(COMPRESSED)
@pytest.mark.parametrize(
    ("text", "payload"),
    [
        ("32FC1; compressedDepth", png_payload),
        ("32FC1; compressedDepth png", png_payload),
        ("32FC1; compressedDepth rvl", rvl_payload),
    ],
)
def test_quantised_inverse_depth_becomes_metres(text, payload):
    # 2 m: 10100 / 2 - 1009 = 4041.  5 m: 2020 - 1009 = 1011.  10100 / (1 + 1009) = 10 m.
    values = np.array([[4041, 1011], [1, 0]], "u2")
    decoded = decode_compressed_depth(compressed(payload(values, A, B), text))
    np.testing.assert_allclose(decoded.depth_m, [[2, 5], [10, 0]], rtol=1e-6)


def test_inverse_depth_behind_the_pole_is_no_depth():
    # With B = 3 the values 1, 2 and 3 stand for negative and infinite depths.
    values = np.array([[1, 2, 3, 4], [5, 7, 13, 0]], "u2")
    decoded = decode_compressed_depth(compressed(png_payload(values, 10.0, 3.0), "32FC1; compressedDepth"))
    np.testing.assert_allclose(decoded.depth_m, [[0, 0, 0, 10], [5, 2.5, 1, 0]], rtol=1e-6)


@pytest.mark.parametrize(("a", "b"), [(np.nan, 0.0), (1.0, np.inf), (0.0, 0.0), (-1.0, 5.0)])
def test_a_quantisation_that_is_none_is_refused(a, b):
    msg = compressed(png_payload(MILLIMETRES, a, b), "32FC1; compressedDepth")
    assert reject(decode_compressed_depth, msg).code == "DEPTH_QUANTISATION"


@pytest.mark.hostile(COMPRESSED)
@pytest.mark.parametrize("codec", ["png", "rvl"])
@pytest.mark.parametrize("size_bytes", [0, 1, 11, 12])
def test_a_header_that_is_cut_is_refused(codec, size_bytes):
    msg = compressed(b"\0" * size_bytes, f"16UC1; compressedDepth {codec}")
    assert reject(decode_compressed_depth, msg).code == "DEPTH_HEADER"


@pytest.mark.hostile(COMPRESSED)
@pytest.mark.parametrize(("width", "height"), [(0, 0), (0, 3), (2**32 - 1, 2**32 - 1), (4_000, 4_000)])
def test_rvl_sizes_that_the_stream_cannot_hold_are_refused(width, height):
    data = bytearray(rvl_payload(MILLIMETRES))
    data[12:20] = struct.pack("<II", width, height)
    msg = compressed(bytes(data), "16UC1; compressedDepth rvl")
    assert reject(decode_compressed_depth, msg).code == "IMAGE_DIMENSIONS"


@pytest.mark.hostile(COMPRESSED)
@pytest.mark.parametrize("change", [(4, 2), (4, 4), (5, 3), (3, 3)])
def test_an_rvl_stream_that_does_not_fill_its_image_exactly_is_refused(change):
    data = bytearray(rvl_payload(MILLIMETRES))
    data[12:20] = struct.pack("<II", *change)
    msg = compressed(bytes(data), "16UC1; compressedDepth rvl")
    assert reject_rvl(msg) == "RVL_OVERRUN"


@pytest.mark.hostile(COMPRESSED)
@pytest.mark.parametrize("kept_bytes", [20, 21, 24, 28])
def test_a_cut_rvl_stream_is_refused(kept_bytes):
    msg = compressed(rvl_payload(MILLIMETRES)[:kept_bytes], "16UC1; compressedDepth rvl")
    assert reject_rvl(msg) in ("RVL_OVERRUN", "DEPTH_HEADER")


def reject_rvl(msg) -> str:
    with pytest.raises(DataError) as caught:  # the first time, compiling takes memory that is not the image's
        decode_compressed_depth(msg)
    return caught.value.code


@pytest.mark.hostile("Image: depth 16UC1 mono16 32FC1 64FC1 A, colour on the depth topic R, depth on the image topic R")
@pytest.mark.parametrize(
    ("data", "text", "code"),
    [
        (jpeg(NOISE), "rgb8; jpeg compressed bgr8", "DEPTH_IS_COLOUR"),
        (b"\0" * 12 + png(NOISE), "16UC1; compressedDepth png", "DEPTH_IS_COLOUR"),
        (b"\0" * 12 + png(NOISE[:, :, 0]), "16UC1; compressedDepth png", "DEPTH_IS_COLOUR"),
        (jpeg(NOISE), "16UC1; jpeg compressed ", "COMPRESSED_FORMAT"),
        (png_payload(MILLIMETRES), "16UC1; compressedDepth zstd", "COMPRESSED_FORMAT"),
        (png_payload(MILLIMETRES), "64FC1; compressedDepth png", "COMPRESSED_FORMAT"),
        (png_payload(MILLIMETRES), "jpeg", "DEPTH_ENCODING"),
        (png_payload(MILLIMETRES), "", "DEPTH_ENCODING"),
        (png_payload(MILLIMETRES), "z" * 10_000, "DEPTH_ENCODING"),
        (rvl_payload(MILLIMETRES), "16UC1; compressedDepth png", "COMPRESSED_FORMAT"),
    ],
)
def test_what_is_no_compressed_depth_is_refused(data, text, code):
    error = reject(decode_compressed_depth, compressed(data, text))
    assert error.code == code
    assert len(error.found) < 150


def test_compressed_depth_without_depth_is_refused():
    msg = compressed(rvl_payload(np.zeros((3, 4), "u2")), "16UC1; compressedDepth rvl")
    assert reject_rvl(msg) == "NO_DEPTH"


def test_a_png_with_a_wrong_checksum_is_refused():
    data = bytearray(png_payload(MILLIMETRES))
    data[-14] ^= 0xFF  # the last 12 bytes are the end, the 4 before them the checksum of the pixels
    msg = compressed(bytes(data), "16UC1; compressedDepth")
    assert reject(decode_compressed_depth, msg).code == "COMPRESSED_BROKEN"
