# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The buffer of keyframes is bounded, keeps the reference, and offers all others in turn."""


import numpy as np
import pytest

from vigg_ros.registration import Evidence, Registration
from vigg_ros.registration.options import KeyframeConfig
from vigg_ros.tracking.chain import UncertainPose
from vigg_ros.tracking.keyframes import KeyframeBuffer, is_far


def at(x):
    T_odom_frame = np.eye(4)
    T_odom_frame[0, 3] = x
    return UncertainPose(T_odom_frame, np.zeros((6, 6)))


def filled(buffer_size, positions):
    """A buffer to which keyframes at these places were added; frames and features are not looked at."""
    buffer = KeyframeBuffer(KeyframeConfig(buffer_size=buffer_size))
    nothing = None
    return buffer, [buffer.add(nothing, nothing, at(x), np.zeros(6)) for x in positions]


@pytest.mark.parametrize("size", [1, 2, 5])
def test_the_oldest_makes_room(size):
    buffer, keyframes = filled(size, list(range(9)))
    assert len(buffer) == size
    assert buffer.reference is keyframes[-1]
    assert [keyframe.id for keyframe in keyframes] == list(range(9))
    assert {keyframe.id for keyframe in buffer.others(np.zeros(3), 100, 0)} == set(range(9 - size, 8))


def test_a_keyframe_returned_to_counts_as_the_newest():
    buffer, keyframes = filled(3, [0, 1, 2])
    buffer.make_reference(keyframes[0])
    assert buffer.reference is keyframes[0]
    assert len(buffer) == 3
    nothing = None
    buffer.add(nothing, nothing, at(9), np.zeros(6))
    # Not the one returned to, but the oldest of the others had to go.
    assert {keyframe.id for keyframe in buffer.others(np.zeros(3), 9, 0)} == {2, 0}


def test_others_are_the_nearest_without_the_reference():
    buffer, _ = filled(10, [0, 5, 1, 9, 3])
    assert [keyframe.id for keyframe in buffer.others(np.array([0.9, 0, 0]), 3, 0)] == [2, 0, 1]
    assert [keyframe.id for keyframe in buffer.others(np.array([8.0, 0, 0]), 2, 0)] == [3, 1]
    assert buffer.others(np.zeros(3), 0, 4) == []
    empty, _ = filled(5, [])
    assert (empty.reference, len(empty), empty.others(np.zeros(3), 3, 0)) == (None, 0, [])


@pytest.mark.parametrize("others", [1, 2, 5, 7])
@pytest.mark.parametrize("count", [1, 2, 3, 7])
def test_all_others_are_tried_in_time(others, count):
    """Each lost frame tries the next ones; none twice in the same frame."""
    buffer, _ = filled(20, [float(x) for x in range(others + 1)])
    tried = []
    for turn in range(-(-others // count)):
        now = [keyframe.id for keyframe in buffer.others(np.zeros(3), count, turn)]
        assert len(set(now)) == len(now) == min(count, others)
        tried += now
    assert set(tried) == set(range(others))


def found(*, x=0.0, turn_deg=0.0, overlap=0.9, inliers=100):
    T = np.eye(4)
    T[0, 3] = x
    cosine, sine = np.cos(np.deg2rad(turn_deg)), np.sin(np.deg2rad(turn_deg))
    T[:2, :2] = (cosine, -sine), (sine, cosine)
    evidence = Evidence(overlap=overlap, visual_inliers=inliers)
    return Registration(T, np.eye(6), evidence, np.empty((0, 4), np.float32))


@pytest.mark.parametrize(
    ("near", "far"),
    [
        ({"x": 0.399}, {"x": 0.401}),
        ({"turn_deg": 19.9}, {"turn_deg": 20.1}),
        ({"turn_deg": -19.9}, {"turn_deg": -20.1}),
        ({"overlap": 0.5}, {"overlap": 0.499}),
        ({"inliers": 30}, {"inliers": 29}),
    ],
    ids=["translation", "rotation", "rotation back", "overlap", "inliers"],
)
def test_when_a_new_keyframe_is_taken(near, far):
    config = KeyframeConfig(max_translation_m=0.4, max_rotation_deg=20.0, min_overlap=0.5, min_inliers=30)
    assert not is_far(found(**near), config)
    assert is_far(found(**far), config)
