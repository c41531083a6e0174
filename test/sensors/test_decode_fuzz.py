# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever a message holds, the answer is an observation with finite numbers or a DataError.

Warnings are errors here as everywhere in the tests, so no overflow passes in silence.
"""

import copy
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vigg_ros.registration.errors import DataError
from vigg_ros.sensors.colour_image import COLOUR_ENCODINGS, DEPTH_ENCODINGS
from vigg_ros.sensors.observation import Calibration, Observation
from vigg_ros.sensors.point_cloud import decode_points
from vigg_ros_testing.decoder_samples import SAMPLES
from vigg_ros_testing.message_samples import DATATYPES, allocating_less_than, cloud, point_field, xyz_table

MANY = settings(max_examples=6 * settings().max_examples)

SIZES = st.integers(0, 9) | st.sampled_from([16, 255, 480, 640, 32_767, 2**16, 2**31, 2**32 - 1])
FLOATS = st.floats() | st.sampled_from([0.0, 1.0, -1.0, 1e-300, 1e300, 500.0])
TEXTS = st.text(max_size=20) | st.sampled_from(
    [*COLOUR_ENCODINGS, *DEPTH_ENCODINGS, "equidistant", "plumb_bob", "rational_polynomial", "x", "t", "time"]
    + ["jpeg", "16UC1; compressedDepth rvl", "32FC1; compressedDepth", "x" * 5000]
)


def leaves(message: Any) -> list[tuple[Any, Any]]:
    """All (container, key) of a message whose value is a number, text, bytes or a list of numbers."""
    found: list[tuple[Any, Any]] = []
    for key, value in vars(message).items():
        if isinstance(value, SimpleNamespace):
            found += leaves(value)
        elif key == "fields":
            found += [leaf for item in value for leaf in leaves(item)]
        else:
            found.append((message, key))
    return found


@st.composite
def broken_bytes(draw: Any, data: bytes) -> bytes:
    """Bytes overwritten, cut or continued."""
    changed = bytearray(data)
    for _ in range(draw(st.integers(0, 4))):
        if changed:
            changed[draw(st.integers(0, len(changed) - 1))] = draw(st.integers(0, 255))
    end = draw(st.just(len(changed)) | st.integers(0, len(changed)))
    return bytes(changed[:end]) + draw(st.just(b"") | st.binary(max_size=8))


def broken_value(value: Any) -> st.SearchStrategy[Any]:
    if isinstance(value, bytes):
        return broken_bytes(value)
    if isinstance(value, str):
        return TEXTS
    if isinstance(value, list):
        numbers = st.integers(0, max(0, len(value) - 1)).flatmap(
            lambda at: FLOATS.map(lambda number: [*value[:at], number, *value[at + 1 :]])
        )
        return numbers | st.lists(FLOATS, max_size=14)
    return SIZES | st.integers(-(2**31), 2**31 - 1)


@st.composite
def broken_messages(draw: Any, message: Any) -> Any:
    """A message with one to four of its values replaced."""
    changed = copy.deepcopy(message)
    places = leaves(changed)
    for _ in range(draw(st.integers(1, 4))):
        container, key = places[draw(st.integers(0, len(places) - 1))]
        setattr(container, key, draw(broken_value(getattr(container, key))))
    return changed


def assert_sound(observation: Any) -> None:
    assert isinstance(observation, Observation)
    assert type(observation.stamp_ns) is int
    assert observation.stamp_ns >= 0
    for name in observation.__dataclass_fields__:
        value = getattr(observation, name)
        if isinstance(value, np.ndarray):
            assert np.isfinite(value).all()
            assert value.size
            assert value.dtype in (np.uint8, np.float32, np.float64)
    if isinstance(observation, Calibration) and observation.rectifier is not None:
        raw = observation.rectifier.raw
        if raw.width_px * raw.height_px <= 100_000 and observation.camera.width_px <= 1_000:
            depth_m = observation.rectifier.depth(np.ones((raw.height_px, raw.width_px), np.float32))
            assert np.isfinite(depth_m).all()
            assert (depth_m >= 0).all()


def decoded_or_refused(decode: Any, message: Any) -> None:
    refused: DataError | None = None
    try:
        found = decode(message)
    except DataError as error:
        refused = error
    if refused is None:
        assert_sound(found)
        assert all(len(str(note)) < 1_000 for note in found.notes)
    else:
        assert refused.code.isupper()
        assert len(str(refused)) < 2_000
        assert str(refused).isprintable()


@pytest.mark.parametrize("name", SAMPLES)
@MANY
@given(data=st.data())
def test_broken_messages(name, data):
    message = data.draw(broken_messages(SAMPLES[name].message))
    # The worst that under 2 kB can ask for is 2 MB of RVL and 17 MPx of PNG; most ask for nothing.
    with allocating_less_than(150_000_000):
        decoded_or_refused(SAMPLES[name].decode, message)


@MANY
@given(st.data())
def test_clouds_of_any_layout_and_any_bytes(data):
    names = data.draw(st.permutations(["x", "y", "z", "t", "intensity"]))
    sample = st.sampled_from([*DATATYPES, "f4", "f4", "f4", "f8"])
    fields = [point_field(name, data.draw(st.integers(0, 30)), data.draw(sample)) for name in names]
    changes = {
        "fields": fields,
        "width": data.draw(st.integers(1, 6)),
        "height": data.draw(st.integers(1, 3)),
        "point_step": data.draw(st.integers(20, 40)),
        "row_step": data.draw(st.integers(0, 200)),
        "is_bigendian": data.draw(st.booleans()),
        "data": data.draw(st.binary(min_size=200, max_size=600)),
    }
    decoded_or_refused(decode_points, cloud(xyz_table(np.ones((2, 3))), **changes))
