# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""RVL: a stream worked out by hand, round trips, and the kernel against its twin on any bytes."""


import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.rvl import decode_rvl, fill_from_rvl_plain
from vigg_ros_testing.message_samples import rvl_stream


def decoded(stream: bytes, shape: tuple[int, int]) -> np.ndarray | None:
    """The image, None if the stream is not one of that shape."""
    try:
        return decode_rvl(np.frombuffer(stream, np.uint8), width_px=shape[1], height_px=shape[0])
    except DataError:
        return None


def read_plainly(stream: bytes, shape: tuple[int, int]) -> np.ndarray | None:
    """As ``decoded``, by the kernel's twin."""
    image = np.zeros(shape[0] * shape[1], np.uint16)
    return image.reshape(shape) if fill_from_rvl_plain(stream, image) else None


def test_a_stream_by_hand():
    # 2 without depth, 2 with: nibbles 2, 2. 0 -> 5 is zigzag 10 = 0b1_010: A (2 and more), 1. 5 -> 4 is
    # zigzag 1. Then 1 without: 1, and 1 with: 1; 4 -> 7 is zigzag 6. The word 22A11116, lowest byte first.
    found = decoded(bytes.fromhex("1611a122"), (2, 3))
    np.testing.assert_array_equal(found, [[0, 0, 5], [4, 0, 7]])


@given(hnp.arrays(np.uint16, hnp.array_shapes(min_dims=2, max_dims=2, max_side=12)))
def test_any_image_survives(pixels):
    stream = rvl_stream(pixels)
    np.testing.assert_array_equal(decoded(stream, pixels.shape), pixels)
    np.testing.assert_array_equal(read_plainly(stream, pixels.shape), pixels)


@given(st.binary(max_size=64), st.integers(1, 300))
def test_any_bytes_are_read_as_by_the_twin(stream, width):
    np.testing.assert_equal(decoded(stream, (1, width)), read_plainly(stream, (1, width)))


@given(
    hnp.arrays(np.uint16, (6, 9), elements=st.sampled_from([0, 900, 901, 60_000])),
    st.integers(0, 500),
    st.integers(0, 255),
)
def test_a_stream_with_a_wrong_byte_is_read_as_by_the_twin(pixels, at, value):
    stream = bytearray(rvl_stream(pixels))
    stream[at % len(stream)] = value
    np.testing.assert_equal(decoded(bytes(stream), (6, 9)), read_plainly(bytes(stream), (6, 9)))


@pytest.mark.parametrize("digits", ["ffffffffffff1000", "0fffffffffffffff", "88888888888f1000", "0188888888888100"])
def test_a_number_without_end_is_refused(digits):
    words = bytes.fromhex(digits)
    stream = words[3::-1] + words[7:3:-1]
    with pytest.raises(DataError, match="exactly the 1x1 pixels"):
        decode_rvl(np.frombuffer(stream, np.uint8), width_px=1, height_px=1)
