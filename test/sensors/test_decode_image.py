# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Images: every encoding by pixels worked out by hand, and what must be refused before it costs memory."""

from __future__ import annotations

import array

import numpy as np
import pytest

from vigg_ros.sensors.colour_image import decode_image
from vigg_ros.sensors.depth_image import decode_depth
from vigg_ros_testing.message_samples import STAMP_NS, image, reject

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


@pytest.mark.hostile("Image: step too short R")
@pytest.mark.parametrize("step", [0, 5, 17])
def test_a_step_shorter_than_the_row_is_refused(step):
    assert reject(decode_image, image(plane(R, G, B), "rgb8", step=step)).code == "IMAGE_STEP"


@pytest.mark.hostile("Image: data short R, long N")
@pytest.mark.parametrize(("encoding", "channels"), [("rgb8", 3), ("uyvy", 2), ("mono8", 1)])
def test_data_that_ends_early_is_refused_and_a_surplus_noted(encoding, channels):
    pixels = plane(*[R] * channels)
    msg = image(pixels, encoding)
    assert reject(decode_image, image(pixels, encoding, data=msg.data[:-1])).code == "IMAGE_DATA_SHORT"
    assert reject(decode_image, image(pixels, encoding, data=b"")).code == "IMAGE_DATA_SHORT"
    longer = decode_image(image(pixels, encoding, data=msg.data + b"\xff" * 3))
    assert [note.code for note in longer.notes] == ["DATA_LONG"]
    np.testing.assert_array_equal(longer.image, decode_image(msg).image)


@pytest.mark.hostile("Image: data short R, long N")
def test_the_chroma_of_a_planar_image_may_not_be_missing():
    msg = image(semi_planar("uv")[:4], "nv12")
    assert reject(decode_image, msg).code == "IMAGE_DATA_SHORT"


@pytest.mark.hostile("Image: 0x0 R")
@pytest.mark.parametrize("size", [(0, 0), (0, 4), (4, 0)])
@pytest.mark.parametrize("decode", [decode_image, decode_depth])
def test_an_image_without_pixels_is_refused(decode, size):
    encoding = "mono8" if decode is decode_image else "16UC1"
    msg = image(np.zeros((4, 4), "u1"), encoding, width=size[0], height=size[1], data=b"")
    assert reject(decode, msg).code == "IMAGE_DIMENSIONS"


@pytest.mark.hostile("Image: dimensions to 2^32-1 R before any allocation (cap 64 Mpx)")
@pytest.mark.parametrize(
    ("width", "height"),
    [(2**32 - 1, 2**32 - 1), (2**32 - 1, 1), (1, 2**32 - 1), (32_767, 1), (1, 32_767), (8_001, 8_000)],
)
@pytest.mark.parametrize("encoding", ["rgb8", "nv12", "16UC1"])
def test_sizes_beyond_the_cap_are_refused(width, height, encoding):
    decode = decode_depth if encoding == "16UC1" else decode_image
    msg = image(np.zeros((4, 4), "u1"), encoding, width=width, height=height, step=2**32 - 1)
    assert reject(decode, msg).code == "IMAGE_DIMENSIONS"


@pytest.mark.hostile("Image: empty, unknown or 10 kB encoding R, shown truncated")
@pytest.mark.parametrize("encoding", ["", "RGB8", "rgb8 ", "8UC2", "h264", "\n\x1b[31m", "x" * 10_000])
def test_an_unknown_encoding_is_refused_and_shown_cut_and_escaped(encoding):
    error = reject(decode_image, image(plane(R), encoding))
    assert error.code == "IMAGE_ENCODING"
    assert len(error.found) < 100
    assert error.found.isprintable()
    assert encoding[:5].strip() in error.found or not encoding.isprintable()


@pytest.mark.hostile("Image: odd-width yuv R")
@pytest.mark.parametrize(
    ("encoding", "width", "height"), [("uyvy", 5, 4), ("yuv422", 5, 4), ("yuyv", 5, 4), ("nv12", 5, 4), ("nv21", 6, 3)]
)
def test_pixels_that_share_colours_come_in_pairs(encoding, width, height):
    msg = image(plane(R, G), encoding, width=width, height=height)
    assert reject(decode_image, msg).code == "IMAGE_DIMENSIONS"


@pytest.mark.parametrize("size", [(1, 9), (2, 2)])
def test_a_mosaic_too_small_to_interpolate_is_refused(size):
    assert reject(decode_image, image(np.ones(size, "u1"), "bayer_rggb8")).code == "IMAGE_DIMENSIONS"


@pytest.mark.hostile("Image: depth 16UC1 mono16 32FC1 64FC1 A, colour on the depth topic R, depth on the image topic R")
@pytest.mark.parametrize("encoding", ["16UC1", "32FC1", "64FC1"])
def test_depth_on_the_image_topic_is_refused(encoding):
    error = reject(decode_image, image(np.ones((4, 4), "f8"), encoding))
    assert error.code == "IMAGE_IS_DEPTH"
    assert "depth/image" in error.remedy


def test_low_bits_in_a_16_bit_image_are_noted():
    decoded = decode_image(image(plane(4095, dtype="<u2"), "mono16"))
    assert [note.code for note in decoded.notes] == ["DARK_16_BIT"]


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
