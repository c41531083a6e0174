# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which pairs the protocols take, on frames along a line."""

import numpy as np
import pytest

from vigg_ros.bench.pairs import PAIR_PROTOCOLS, PairProtocol, choose, pairs_apart, pairs_at, pairs_listed
from vigg_ros.registration import BagError
from vigg_ros_testing.pair_samples import along_x
from vigg_ros_testing.trajectory_samples import pose


def names(pairs):
    return [pair.name for pair in pairs]


def test_pairs_are_source_k_and_target_k_plus_gap_of_every_so_manyth_k():
    pairs = list(pairs_at(along_x(*range(7)), [1, 3], 2))
    assert names(pairs) == ["1/1/0", "1/3/2", "1/5/4", "3/3/0", "3/5/2"]
    # The source stands 3 m behind the target, so its origin is at x = -3 there.
    np.testing.assert_allclose(pairs[-1].T_target_source, pose(-3.0))


def test_frames_without_a_pose_make_no_pairs():
    assert names(pairs_at(along_x(0, None, 2, 3), [1], 1)) == ["1/3/2"]


def test_pairs_apart_follow_each_other():
    frames = along_x(0, 4, 9.9, 10, 12, None, 19.9, 21, 22)
    assert names(pairs_apart(frames, 10)) == ["10 m/3/0", "10 m/7/3"]
    assert names(pairs_apart([], 10)) == []


def test_listed_pairs_come_with_their_own_motions(tmp_path):
    rows = [[2, 0, *pose(1).ravel()], [3, 1, *pose(2).ravel()], [3, 2, *pose(3).ravel()], [9, 7, *pose(4).ravel()]]
    np.savetxt(tmp_path / "pairs.txt", rows)
    found = list(pairs_listed(along_x(0, 0, 0, 0), tmp_path / "pairs.txt", [2]))
    assert names(found) == ["2/2/0", "2/3/1"]
    np.testing.assert_allclose(found[1].T_target_source, pose(2))
    assert names(pairs_listed(along_x(0, 0, 0, 0), tmp_path / "pairs.txt", [2], every=2)) == ["2/2/0"]


@pytest.mark.parametrize("content", ["1 2 3\n", "words\n"])
def test_a_list_that_is_none_is_refused(tmp_path, content):
    (tmp_path / "pairs.txt").write_text(content)
    with pytest.raises(BagError, match=r"pairs\.txt"):
        list(pairs_listed(along_x(0, 1), tmp_path / "pairs.txt", [1]))


def test_the_protocols_are_those_of_the_paper():
    assert PAIR_PROTOCOLS["3dmatch"].gaps == PAIR_PROTOCOLS["scannet"].gaps == (20, 60, 120)
    assert (PAIR_PROTOCOLS["kitti"].apart_m, PAIR_PROTOCOLS["kitti"].refine_truth) == (10.0, True)
    frames = along_x(*range(30))
    assert names(choose(frames, PAIR_PROTOCOLS["kitti"])) == ["10 m/10/0", "10 m/20/10"]
    assert names(choose(frames, PairProtocol(gaps=(20,)))) == ["20/20/0"]
