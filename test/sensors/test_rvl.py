# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""RVL: a stream worked out by hand, round trips, and the kernel against its twin on any bytes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.rvl import MAX_NIBBLES, decode_rvl, fill_from_rvl_plain
from vigg_ros.sensors.rvl_kernel import fill_from_rvl
from vigg_ros_testing.message_samples import rvl_stream

BOTH = pytest.mark.parametrize("fill", [fill_from_rvl, fill_from_rvl_plain])


def as_bytes(stream: bytes) -> np.ndarray:
    return np.frombuffer(stream, np.uint8)


@BOTH
def test_a_stream_by_hand(fill):
    # 2 without depth, 2 with: nibbles 2, 2. 0 -> 5 is zigzag 10 = 0b1_010: A (2 and more), 1. 5 -> 4 is
    # zigzag 1. Then 1 without: 1, and 1 with: 1; 4 -> 7 is zigzag 6. The word 22A11116, lowest byte first.
    stream = as_bytes(bytes.fromhex("1611a122"))
    image = np.zeros(6, np.uint16)
    assert fill(stream, image, MAX_NIBBLES)
    np.testing.assert_array_equal(image, [0, 0, 5, 4, 0, 7])


@given(hnp.arrays(np.uint16, hnp.array_shapes(min_dims=2, max_dims=2, max_side=12)))
def test_any_image_survives(pixels):
    height, width = pixels.shape
    stream = as_bytes(rvl_stream(pixels))
    np.testing.assert_array_equal(decode_rvl(stream, width_px=width, height_px=height), pixels)
    plain = np.zeros(pixels.size, np.uint16)
    assert fill_from_rvl_plain(stream, plain, MAX_NIBBLES)
    np.testing.assert_array_equal(plain, pixels.reshape(-1))


@given(st.binary(max_size=64), st.integers(1, 300))
def test_the_kernel_and_its_twin_agree_on_any_bytes(stream, pixels):
    compiled, plain = np.zeros(pixels, np.uint16), np.zeros(pixels, np.uint16)
    good = fill_from_rvl(as_bytes(stream), compiled, MAX_NIBBLES)
    assert good == fill_from_rvl_plain(as_bytes(stream), plain, MAX_NIBBLES)
    if good:
        np.testing.assert_array_equal(compiled, plain)


@given(
    hnp.arrays(np.uint16, (6, 9), elements=st.sampled_from([0, 900, 901, 60_000])),
    st.integers(0, 500),
    st.integers(0, 255),
)
def test_they_agree_on_a_stream_with_a_wrong_byte(pixels, at, value):
    stream = bytearray(rvl_stream(pixels))
    stream[at % len(stream)] = value
    compiled, plain = np.zeros(54, np.uint16), np.zeros(54, np.uint16)
    good = fill_from_rvl(as_bytes(stream), compiled, MAX_NIBBLES)
    assert good == fill_from_rvl_plain(as_bytes(stream), plain, MAX_NIBBLES)
    if good:
        np.testing.assert_array_equal(compiled, plain)


@BOTH
@pytest.mark.parametrize(
    "nibbles", ["ffffffffffff1000", "0fffffffffffffff", "88888888888f1000", "0188888888888100"]
)
def test_a_number_without_end_is_refused(fill, nibbles):
    words = bytes.fromhex(nibbles)
    stream = words[3::-1] + words[7:3:-1]
    assert not fill(as_bytes(stream), np.zeros(1, np.uint16), MAX_NIBBLES)


def test_the_error_says_what_was_announced():
    with pytest.raises(DataError, match="exactly the 10x10 pixels"):
        decode_rvl(as_bytes(b"\0" * 40), width_px=10, height_px=10)
