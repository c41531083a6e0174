# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bundled bags for the node: their messages as recorded, and what a replay says of them."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vigg_ros.registration.rigid import quaternions_from_rotations
from vigg_ros.tracking.frame_result import FrameResult
from vigg_ros_testing.ros_peer import Peer, stamp_of
from vigg_ros_testing.short_recordings import Entry, short_entries

Moment = list[Entry]
"""All messages of a frame, in the order in which they were recorded."""


def moments(bag: Path, topics: dict[str, str], count: int) -> list[Moment]:
    """The first frames of a bag; ``topics`` says which of them are published under which name."""
    found: defaultdict[str, list[Entry]] = defaultdict(list)
    for one in short_entries(bag, frames=count, every=1):
        if one.topic in topics:
            found[one.topic].append(replace(one, topic=topics[one.topic]))
    return [list(moment) for moment in zip(*found.values(), strict=True)]


def publish(peer: Peer, moment: Moment) -> None:
    """All messages of one frame."""
    for one in moment:
        peer.connect(one.topic, one.type).publish(one.data)


def play(peer: Peer, recording: list[Moment]) -> None:
    """Publish frame after frame, each once the node has answered the one before, so that none is dropped.

    A pair whose stamps differ is certain only when the next one comes, so one frame may stay unanswered.
    """
    for one in recording[0]:
        peer.connect(one.topic, one.type)
    begun = len(peer.answers())
    for published, moment in enumerate(recording, start=begun + 1):
        publish(peer, moment)
        peer.wait(partial(_is_answered, peer, published - 1), "the answer to the frame before")
        peer.wait_briefly(partial(_is_answered, peer, published))


def _is_answered(peer: Peer, count: int) -> bool:
    return len(peer.answers()) >= count


def vector(T_odom_frame: NDArray[np.float64]) -> NDArray[np.float64]:
    """Position and quaternion (7,)."""
    return np.concatenate((T_odom_frame[:3, 3], quaternions_from_rotations(T_odom_frame[:3, :3][None])[0]))


def vector_of(message: Any) -> NDArray[np.float64]:
    """Position and quaternion (7,) of a message that has a pose."""
    p, q = message.pose.position, message.pose.orientation
    return np.array((p.x, p.y, p.z, q.x, q.y, q.z, q.w))


def assert_equal(poses: Sequence[Any], records: Sequence[FrameResult]) -> None:
    """The same frames got the same poses, to the rounding of a quaternion."""
    answered = {record.stamp_ns: record.T_odom_frame for record in records if record.T_odom_frame is not None}
    assert [stamp_of(pose) for pose in poses] == [*answered]
    for pose, T_odom_frame in zip(poses, answered.values(), strict=True):
        np.testing.assert_allclose(vector_of(pose), vector(T_odom_frame), rtol=0, atol=1e-9)
