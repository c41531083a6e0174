# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Images of colours and depth: each encoding by hand. What is refused is in test_image_refusals.py."""

import array

import numpy as np
import pytest

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.colour_image import decode_image
from vigg_ros.sensors.depth_image import decode_depth
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


def test_bytes_are_shared_with_the_message_and_cannot_be_written():
    data = array.array("B", plane(B, G, R).tobytes())
    decoded = decode_image(image(plane(B, G, R), "bgr8", data=data)).image
    assert np.shares_memory(decoded, np.frombuffer(data, np.uint8))
    with pytest.raises(ValueError, match="read-only"):
        decoded[0, 0] = 1


TYPES_ROW = pytest.mark.hostile(
    "Image: depth 16UC1 mono16 32FC1 64FC1 A, colour on the depth topic R, depth on the image topic R"
)
MILLIMETRES = np.array([[1000, 1500, 2000], [2500, 750, 40_000]])
METRES = np.array([[1.0, 1.5, 2.0], [2.5, 0.75, 40.0]])


@TYPES_ROW
@pytest.mark.hostile("Image: big-endian 16UC1/32FC1 A")
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(
    ("encoding", "values", "dtype"),
    [("16UC1", MILLIMETRES, "u2"), ("mono16", MILLIMETRES, "u2"), ("32FC1", METRES, "f4"), ("64FC1", METRES, "f8")],
)
def test_each_type_becomes_metres(encoding, values, dtype, order):
    decoded = decode_depth(image(values.astype(order + dtype), encoding))
    # 16 bits are multiplied with 0.001 in float32: one rounding.
    np.testing.assert_allclose(decoded.depth_m, METRES, rtol=2e-7)
    assert decoded.depth_m.dtype == np.float32
    assert decoded.depth_m.dtype.isnative
    assert (decoded.stamp_ns, decoded.frame_id, decoded.notes) == (STAMP_NS, "camera", ())


@pytest.mark.parametrize(("encoding", "dtype"), [("16UC1", "<u2"), ("32FC1", "<f4")])
def test_a_scale_that_is_given_holds_for_every_type(encoding, dtype):
    decoded = decode_depth(image(MILLIMETRES.astype(dtype), encoding), depth_scale_m=0.0002)
    np.testing.assert_allclose(decoded.depth_m, MILLIMETRES * 0.0002, rtol=2e-7)


def test_padding_and_odd_steps_are_read_right():
    padded = np.zeros((2, 9), "u1")
    padded[:, :6] = MILLIMETRES.astype("<u2").view("u1")
    msg = image(MILLIMETRES.astype("<u2"), "16UC1", step=9, data=padded.tobytes())
    np.testing.assert_allclose(decode_depth(msg).depth_m, METRES, rtol=2e-7)


@pytest.mark.hostile("Image: depth of 0, NaN, Inf, negative, 65535: no point there; too few left: NO_DEPTH")
@pytest.mark.parametrize(
    ("encoding", "dtype", "nothing"),
    [
        ("16UC1", "<u2", [0, 65_535]),
        ("32FC1", "<f4", [0, np.nan, np.inf, -np.inf, -1, -0.0, 1e30, 10_001]),
        ("64FC1", ">f8", [0, np.nan, np.inf, -np.inf, -1, 1e300, -1e300]),
    ],
)
def test_what_is_no_distance_is_zero(encoding, dtype, nothing):
    values = np.array([[1, 2, 3], [0, 0, 0]] + [[value, 2, 3] for value in nothing]).astype(dtype)
    # With half a millimetre per unit 65535 would be a depth of 33 m.
    scale_m = 0.0005 if encoding == "16UC1" else 1.0
    decoded = decode_depth(image(values, encoding), depth_scale_m=scale_m).depth_m
    expected = np.array([[1, 2, 3], [0, 0, 0]] + [[0, 2, 3]] * len(nothing)) * scale_m
    np.testing.assert_allclose(decoded, expected, rtol=2e-7)

    with pytest.raises(DataError) as caught:
        decode_depth(image(np.array([[*nothing, 1, 2]]).astype(dtype), encoding))
    assert caught.value.code == "NO_DEPTH"
    assert "2 pixels" in caught.value.found
