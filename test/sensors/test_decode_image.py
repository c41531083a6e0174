# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Images: every encoding by pixels worked out by hand. What is refused is in test_image_refusals.py."""

from __future__ import annotations

import array

import numpy as np
import pytest

from vigg_ros.sensors.colour_image import decode_image
from vigg_ros_testing.message_samples import STAMP_NS, image

# One colour: red 200, green 100, blue 50. Two columns of it, then two of its opposite in the tests below.
R, G, B, A = 200, 100, 50, 7
BGR = [B, G, R]


def plane(*samples: int, dtype: str = "u1") -> np.ndarray:
    """A 6x4 image (height 4) of one pixel value whose top left pixel is black."""
    pixels = np.tile(np.array(samples, dtype), (4, 6, 1))
    pixels[0, 0] = 0
    return pixels


def bayer(pattern: str, dtype: str = "u1") -> np.ndarray:
    """A mosaic (4, 6) of the colour; the pattern names the first row and then the second."""
    cell = np.array([{"r": R, "g": G, "b": B}[letter] for letter in pattern], dtype).reshape(2, 2)
    return np.tile(cell, (2, 3))


ALL_ENCODINGS = pytest.mark.hostile(
    "Image: encodings mono8 mono16 rgb8 bgr8 rgba8 bgra8 8UC1 8UC3 8UC4, four Bayer, yuv422/yuyv/uyvy, nv12/nv21 A"
)


@ALL_ENCODINGS
@pytest.mark.parametrize(
    ("encoding", "pixels", "expected"),
    [
        ("mono8", plane(R), R),
        ("8UC1", plane(R), R),
        ("mono16", plane(R * 256 + 255, dtype="<u2"), R),
        ("mono16", plane(R * 256 + 255, dtype=">u2"), R),
        ("bgr8", plane(B, G, R), BGR),
        ("8UC3", plane(B, G, R), BGR),
        ("rgb8", plane(R, G, B), BGR),
        ("bgra8", plane(B, G, R, A), BGR),
        ("8UC4", plane(B, G, R, A), BGR),
        ("rgba8", plane(R, G, B, A), BGR),
        ("rgb16", plane(R * 256, G * 256, B * 256, dtype="<u2"), BGR),
        ("bgr16", plane(B * 256, G * 256, R * 256, dtype=">u2"), BGR),
        ("rgba16", plane(R * 256, G * 256, B * 256, A, dtype="<u2"), BGR),
        ("bgra16", plane(B * 256, G * 256, R * 256, A, dtype="<u2"), BGR),
    ],
)
def test_pixels_of_an_encoding_become_bgr_or_grey(encoding, pixels, expected):
    decoded = decode_image(image(pixels, encoding))
    wanted = np.tile(np.array(expected, np.uint8), (4, 6, 1)).squeeze()
    wanted[0, 0] = 0
    np.testing.assert_array_equal(decoded.image, wanted)
    assert decoded.image.dtype == np.uint8
    assert (decoded.stamp_ns, decoded.frame_id, decoded.notes) == (STAMP_NS, "camera", ())


@ALL_ENCODINGS
@pytest.mark.parametrize("pattern", ["rggb", "bggr", "gbrg", "grbg"])
@pytest.mark.parametrize(("bits", "dtype", "scale"), [(8, "u1", 1), (16, "<u2", 256), (16, ">u2", 256)])
def test_a_mosaic_of_one_colour_becomes_that_colour(pattern, bits, dtype, scale):
    # Interpolating equal neighbours gives them back, so the inside is exact; the rim is OpenCV's affair.
    decoded = decode_image(image(bayer(pattern, dtype) * scale, f"bayer_{pattern}{bits}"))
    np.testing.assert_array_equal(decoded.image[1:-1, 1:-1], np.broadcast_to(BGR, (2, 4, 3)))


# ITU-R BT.601 with head room: R = 1.164 (Y - 16) + 1.596 (V - 128), B = 1.164 (Y - 16) + 2.018 (U - 128),
# G = 1.164 (Y - 16) - 0.813 (V - 128) - 0.391 (U - 128).
RED = {"y": 81, "u": 90, "v": 240}  # R 254.4, G -0.5, B -1.0
WHITE = {"y": 235, "u": 128, "v": 128}  # 254.9 each


def packed(order: str) -> np.ndarray:
    """(4, 6, 2): the left two columns red, the rest white, in a packed 4:2:2 order of four samples."""
    cells = [np.array([colour[letter] for letter in order], "u1") for colour in (RED, WHITE, WHITE)]
    return np.tile(np.concatenate(cells), (4, 1)).reshape(4, 6, 2)


def semi_planar(order: str) -> np.ndarray:
    """(6, 6): four rows of Y, then two of interleaved chroma, the left two columns red, the rest white."""
    luma = np.tile(np.array([81, 81, 235, 235, 235, 235], "u1"), (4, 1))
    chroma = [colour[letter] for colour in (RED, WHITE, WHITE) for letter in order]
    return np.vstack((luma, np.tile(np.array(chroma, "u1"), (2, 1))))


@ALL_ENCODINGS
@pytest.mark.parametrize(
    ("encoding", "samples"),
    [
        ("uyvy", packed("uyvy")),
        ("yuv422", packed("uyvy")),
        ("yuyv", packed("yuyv")),
        ("yuv422_yuy2", packed("yuyv")),
        ("nv12", semi_planar("uv")),
        ("nv21", semi_planar("vu")),
    ],
)
def test_yuv_becomes_red_beside_white(encoding, samples):
    decoded = decode_image(image(samples, encoding, height=4, width=6)).image
    assert decoded.shape == (4, 6, 3)
    # OpenCV computes in fixed point: within 2 of the formula.
    np.testing.assert_allclose(decoded[:, :2].astype(int), np.broadcast_to([0, 0, 254], (4, 2, 3)), atol=2)
    np.testing.assert_allclose(decoded[:, 2:].astype(int), 255, atol=2)


@pytest.mark.hostile("Image: step wider than the row A")
@pytest.mark.parametrize("encoding", ["mono8", "rgb8", "mono16"])
def test_padding_behind_the_rows_is_skipped(encoding):
    pixels = {"mono8": plane(R), "rgb8": plane(R, G, B), "mono16": plane(R * 256, dtype="<u2")}[encoding]
    padded = np.full((4, pixels.nbytes // 4 + 5), 255, "u1")
    padded[:, :-5] = pixels.reshape(4, -1).view("u1")
    clean = decode_image(image(pixels, encoding))
    decoded = decode_image(image(pixels, encoding, step=padded.shape[1], data=padded.tobytes()))
    np.testing.assert_array_equal(decoded.image, clean.image)
    assert decoded.notes == ()


@pytest.mark.parametrize("size", [(1, 1), (8, 8)])
@pytest.mark.parametrize("value", [0, 128, 255])
def test_images_without_texture_are_still_images(size, value):
    decoded = decode_image(image(np.full(size, value, "u1"), "mono8"))
    np.testing.assert_array_equal(decoded.image, np.full(size, value))


def test_bytes_are_shared_with_the_message_and_cannot_be_written():
    data = array.array("B", plane(B, G, R).tobytes())
    decoded = decode_image(image(plane(B, G, R), "bgr8", data=data)).image
    assert np.shares_memory(decoded, np.frombuffer(data, np.uint8))
    with pytest.raises(ValueError, match="read-only"):
        decoded[0, 0] = 1
