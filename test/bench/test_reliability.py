# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""NEES and bounds against closed forms, tables of a textbook, and draws from a known covariance."""

import csv
import json
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vigg_ros.bench.pair_results import INDOOR_LIMITS, OUTDOOR_LIMITS
from vigg_ros.bench.reliability import (
    mean_nees_bounds,
    nees,
    reliabilities,
    reliability,
    share_bounds,
    write_reliabilities,
)
from vigg_ros.registration import BagError
from vigg_ros_testing.pair_samples import result
from vigg_ros_testing.trajectory_samples import pose


def shifted(T: np.ndarray, error: np.ndarray) -> np.ndarray:
    """t + dt and exp(dr) R, as the covariance means an error (6,)."""
    moved = T.copy()
    moved[:3, 3] += error[:3]
    moved[:3, :3] = Rotation.from_rotvec(error[3:]).as_matrix() @ T[:3, :3]
    return moved


def turned_far() -> np.ndarray:
    T = pose(2.0)
    T[:3, :3] = Rotation.from_rotvec((0.5, -1.0, 0.7)).as_matrix()
    return T


@pytest.mark.parametrize("axis", range(6))
def test_two_sigma_along_an_axis_of_the_target_is_a_nees_of_four(axis):
    sigma = np.array((0.01, 0.02, 0.03, 0.001, 0.002, 0.003))
    error = 2 * sigma * (np.arange(6) == axis)
    assert nees(shifted(turned_far(), error), turned_far(), np.diag(sigma**2)) == pytest.approx(4, rel=1e-9)


def test_errors_drawn_from_a_covariance_are_as_it_says():
    rng = np.random.default_rng(1)
    root = rng.standard_normal((6, 6)) * (0.01, 0.01, 0.01, 0.002, 0.002, 0.002)
    covariance = root.T @ root
    rows = [
        result(0.1, 0.01, nees=nees(shifted(turned_far(), root.T @ rng.standard_normal(6)), turned_far(), covariance))
        for _ in range(400)
    ]
    found = reliability("m", "g", [(row, INDOOR_LIMITS) for row in rows])
    # With so many and this seed; another one passes 95 times of 100.
    assert found.nees_low < found.nees < found.nees_high
    # 400 draws of 95 %: sigma 1.1 %, four of those.
    assert found.nees_inside == pytest.approx(95, abs=4.4)
    # With a fifth of the variance claimed it is five times as much, and far outside.
    assert 5 * found.nees > 4 * found.nees_high


def test_bounds_of_a_share_are_those_of_clopper_and_pearson():
    # Where none came true, the upper bound has a closed form: (1 - p)^n = 2.5 %.
    assert share_bounds(0, 100) == pytest.approx((0, 1 - 0.025**0.01))
    assert share_bounds(100, 100) == pytest.approx((0.025**0.01, 1))
    # Their defining property: at the bounds, so many or more, and so many or fewer, have a chance of 2.5 %.
    low, high = share_bounds(3, 100)
    chances = [[math.comb(100, k) * p**k * (1 - p) ** (100 - k) for k in range(4)] for p in (low, high)]
    assert 1 - sum(chances[0][:3]) == pytest.approx(0.025)
    assert sum(chances[1]) == pytest.approx(0.025)
    assert share_bounds(0, 0) == (0, 1)


def test_the_mean_of_many_nees_is_near_six():
    # Bar-Shalom et al. 2001, 5.4.2: 50 runs of 2 dimensions, chi-square 100: 74.2 to 129.6. Here 6 x 50 / 3 = 100.
    low, high = mean_nees_bounds(100 // 6)
    assert 16 * low == pytest.approx(70.8, abs=0.1)  # of 96 degrees of freedom
    assert 16 * high == pytest.approx(125.0, abs=0.1)
    assert all(math.isnan(bound) for bound in mean_nees_bounds(0))


def test_figures_of_a_group_and_of_all_by_their_own_limits():
    rooms = [result(1, 0.1, group="room", nees=4.0), result(1, 0.5, group="room", nees=900.0), result(group="room")]
    # Half a metre is right outdoors; an answer without a covariance has a part in the recall alone.
    street = [result(1, 0.5, group="street", nees=20.0), result(1, 0.1, group="street", nees=math.nan)]
    judged = [*((row, INDOOR_LIMITS) for row in rooms), *((row, OUTDOOR_LIMITS) for row in street)]
    room, outside, total = reliabilities(judged)
    assert (room.group, room.pairs, room.answered, room.right, room.wrong) == ("room", 3, 2, 1, 1)
    assert (room.nees, room.nees_inside, room.nees_answers) == (4, 100, 1)
    assert (outside.nees, outside.nees_inside, outside.nees_answers) == (20, 0, 1)
    assert (total.group, total.pairs, total.right, total.wrong, total.nees) == ("all", 5, 3, 1, 12)
    assert total.wrong_per_1000 == 250
    assert total.cells()["wrong/1000"] == "250 (6.3 to 806)"


def test_without_answers_nothing_is_known():
    (found,) = reliabilities([(result(), INDOOR_LIMITS)])
    assert (found.wrong_per_1000_low, found.wrong_per_1000_high) == (0, 1000)
    assert found.as_dict()["nees"] is found.as_dict()["wrong_per_1000"] is None
    assert found.cells()["NEES"] == "-"


def test_the_table_is_written(tmp_path):
    rows = reliabilities([(result(1, 0.1, group=group), INDOOR_LIMITS) for group in "ab"])
    write_reliabilities(rows, tmp_path / "reliability.csv")
    written = list(csv.DictReader((tmp_path / "reliability.csv").read_text().splitlines()))
    assert [(row["group"], row["pairs"]) for row in written] == [("a", "1"), ("b", "1"), ("all", "2")]
    assert json.dumps(rows[0].as_dict())
    with pytest.raises(BagError, match="cannot be written"):
        write_reliabilities(rows, tmp_path / "missing" / "reliability.csv")
