# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The path in the bag of `vigg replay --output-bag` stays bounded."""

from __future__ import annotations

import numpy as np
import pytest

from vigg_ros.report.result_bag import PATH_POSES, thinned


@pytest.mark.parametrize("count", [0, 1, PATH_POSES, PATH_POSES + 1, 2 * PATH_POSES - 1, 123_456])
def test_a_path_is_thinned_evenly_and_keeps_its_ends(count: int) -> None:
    poses = [(stamp_ns, np.eye(4)) for stamp_ns in range(count)]
    kept = [stamp_ns for stamp_ns, _ in thinned(poses)]
    assert len(kept) == min(count, PATH_POSES)
    if count:
        assert (kept[0], kept[-1]) == (0, count - 1)
        steps = np.diff(kept)
        assert steps.size == 0 or (steps.min() >= 1 and steps.max() - steps.min() <= 1)
