# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A second parent on TF: noticed when it comes, and when it has gone."""

from vigg_ros.node.tf_parents import ParentWatch


class Frames:
    """What tf2 tells; it never forgets a parent."""

    def __init__(self) -> None:
        self.text = "[]"  # as tf2 says it without any frames
        self.asked = 0

    def __call__(self) -> str:
        self.asked += 1
        return self.text

    def base_link_below(self, parent: str, newest_s: float) -> None:
        self.text = (
            f"base_link: \n  parent: '{parent}'\n  broadcaster: 'default_authority'\n  rate: 10.0\n"
            f"  most_recent_transform: {newest_s:.6f}\n  oldest_transform: 1.0\n  buffer_length: 9.0\n"
        )


def test_a_parent_that_comes_later_is_noticed_and_own_transforms_are_none():
    frames = Frames()
    watch = ParentWatch(frames)
    assert watch.other_parent("base_link", "odom", 100.0) is None
    frames.base_link_below("odom", 100.0)
    assert watch.other_parent("base_link", "odom", 101.0) is None
    frames.base_link_below("wheels", 101.5)
    assert watch.other_parent("base_link", "odom", 101.9) is None, "asked once a second"
    assert watch.other_parent("base_link", "odom", 102.0) == "wheels"
    assert watch.other_parent("base_link", "odom", 102.1) == "wheels"
    assert frames.asked == 3


def test_a_parent_that_is_no_longer_renewed_has_gone():
    frames = Frames()
    watch = ParentWatch(frames)
    found = []
    for second in range(20):
        if second < 5:
            frames.base_link_below("wheels", 1000.0 + second)
        found.append(watch.other_parent("base_link", "odom", float(second)))
    # Renewed for the last time at 4 s, and given 5 s more.
    assert found == ["wheels"] * 9 + [None] * 11
    frames.base_link_below("wheels", 2000.0)
    assert watch.other_parent("base_link", "odom", 20.0) == "wheels"


def test_a_static_parent_stays():
    frames = Frames()
    frames.base_link_below("map", 0.0)
    watch = ParentWatch(frames)
    assert {watch.other_parent("base_link", "odom", float(second)) for second in range(0, 100, 7)} == {"map"}


def test_each_base_is_asked_for():
    frames = Frames()
    frames.base_link_below("wheels", 1.0)
    watch = ParentWatch(frames)
    assert watch.other_parent("lidar", "odom", 0.0) is None
    assert watch.other_parent("base_link", "odom", 0.1) == "wheels"
