# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""JPEG, PNG and compressedDepth: files made by their specifications. Those that lie are in test_image_refusals.py."""

import struct

import numpy as np
import pytest

from vigg_ros.sensors.compressed_depth import decode_compressed_depth
from vigg_ros.sensors.compressed_image import decode_compressed_image
from vigg_ros_testing.message_samples import STAMP_NS, compressed, jpeg, png, png_payload, rvl_payload

COMPRESSED = (
    "Image: compressed: truncated or not an image R; compressedDepth PNG and RVL A; header under 12 bytes, "
    "dimensions 0 or far beyond the payload, RVL overrun, PNG bomb R"
)
RGB = np.array([[[200, 100, 50], [1, 2, 3]], [[255, 0, 0], [0, 0, 255]]], "u1")
BGR = [[[50, 100, 200], [3, 2, 1]], [[0, 0, 255], [255, 0, 0]]]


@pytest.mark.parametrize("text", ["png", "bgr8; png compressed bgr8", "rgb8; png compressed bgr8"])
@pytest.mark.parametrize("scale", [1, 257])
def test_png_gives_its_exact_colours(text, scale):
    pixels = RGB if scale == 1 else RGB.astype("u2") * scale
    decoded = decode_compressed_image(compressed(png(pixels), text))
    np.testing.assert_array_equal(decoded.image, BGR)
    assert decoded.image.dtype == np.uint8
    assert (decoded.stamp_ns, decoded.frame_id, decoded.notes) == (STAMP_NS, "camera", ())


@pytest.mark.parametrize("text", ["jpeg", "rgb8; jpeg compressed bgr8"])
def test_jpeg_gives_its_colours_or_grey(text):
    pixels = np.zeros((32, 48, 3), "u1")
    pixels[:, :24] = (0, 0, 255)
    pixels[:, 24:] = (255, 0, 0)
    decoded = decode_compressed_image(compressed(jpeg(pixels), text)).image
    # The blocks of 16 next to the edge between the colours are left out; JPEG rounds the rest by up to 2.
    np.testing.assert_allclose(decoded[:, :8].astype(int), pixels[:, :8], atol=2)
    np.testing.assert_allclose(decoded[:, -8:].astype(int), pixels[:, -8:], atol=2)
    grey = decode_compressed_image(compressed(jpeg(np.full((16, 16), 77, "u1")), text)).image
    np.testing.assert_allclose(grey.astype(int), np.full((16, 16), 77), atol=1)


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


def test_the_emptiest_images_are_within_the_claim_limit():
    for data in (png(np.zeros((1500, 1500), "u1")), jpeg(np.zeros((1500, 1500), "u1"), quality=1)):
        assert decode_compressed_image(compressed(data, "png")).image.shape == (1500, 1500)


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


# The transport's defaults, depth_quantization 100 and depth_max 10: A = 100 * 101, B = 1 - A / 10.
A, B = 10_100.0, -1_009.0


@pytest.mark.hostile(COMPRESSED)
@pytest.mark.parametrize(("text", "payload"), [("", png_payload), (" png", png_payload), (" rvl", rvl_payload)])
def test_quantised_inverse_depth_becomes_metres(text, payload):
    # 2 m: 10100 / 2 - 1009 = 4041.  5 m: 2020 - 1009 = 1011.  10100 / (1 + 1009) = 10 m.
    values = np.array([[4041, 1011], [1, 0]], "u2")
    decoded = decode_compressed_depth(compressed(payload(values, A, B), f"32FC1; compressedDepth{text}"))
    np.testing.assert_allclose(decoded.depth_m, [[2, 5], [10, 0]], rtol=1e-6)
    # With B = 3 the values 1, 2 and 3 stand for negative and infinite depths: behind the pole.
    values = np.array([[1, 2, 3, 4], [5, 7, 13, 0]], "u2")
    decoded = decode_compressed_depth(compressed(payload(values, 10.0, 3.0), f"32FC1; compressedDepth{text}"))
    np.testing.assert_allclose(decoded.depth_m, [[0, 0, 0, 10], [5, 2.5, 1, 0]], rtol=1e-6)
