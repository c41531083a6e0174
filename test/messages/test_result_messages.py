# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Results as messages, live and in the bag of `vigg replay --output-bag`; their figures are those of frames.csv."""

import csv
import math

import numpy as np
import pytest

from vigg_ros.bags.reader import BagReader
from vigg_ros.messages.result_messages import MAX_PATH_POSES, PathPoses
from vigg_ros.report.replay_files import write_frames, write_result_bag
from vigg_ros.tracking.columns import RENAMED_COLUMNS, known_values_of, values_of
from vigg_ros_testing.report_samples import lost, refused, started, tracked


@pytest.mark.parametrize("count", [0, 1, MAX_PATH_POSES - 1, MAX_PATH_POSES, 2 * MAX_PATH_POSES + 1, 12_345])
def test_a_path_is_thinned_evenly_and_keeps_its_ends(count):
    path = PathPoses()
    for number in range(count):
        path.add(number, 0)
    kept = path.take()
    assert len(kept) <= min(count, MAX_PATH_POSES)
    assert path.take() == [], "nothing new"
    if count:
        assert (kept[0], kept[-1]) == (0, count - 1)
        assert len(np.unique(np.diff(kept)[:-1])) <= 1, "but for the newest, all steps are equal"
        assert len(kept) > min(count, MAX_PATH_POSES) / 2


def test_the_bag_has_the_topics_of_the_node(tmp_path):
    """Of six frames five are compared or lost; the velocity of odometry needs the pose before in the same keyframe."""
    results = [started(), tracked(1, keyframe_stamp_ns=1), tracked(2, keyframe_stamp_ns=1), lost(3), refused(4)]
    write_result_bag(results, tmp_path / "bag")
    with BagReader(tmp_path / "bag") as reader:
        counts = {topic.name: topic.count for topic in reader.topics}
        status = [item.message for item in reader.messages(["/registrar/status"])]
        (odometry,) = [item.message for item in reader.messages(["/registrar/odom"])]
    assert counts == {
        "/registrar/status": 5, "/registrar/pose": 3, "/registrar/relative_pose": 2, "/registrar/odom": 1,
        "/registrar/path": 1, "/tf": 3,
    }  # fmt: skip
    assert odometry.child_frame_id == "camera"
    values = [{pair.key: pair.value for pair in one.values} for one in status]
    assert [one["state"] for one in values] == ["STARTED", "TRACKING", "TRACKING", "LOST", "REFUSED"]
    assert values[1]["lead_log10"] == "30000"
    assert values[1]["photometric_correlation" if "photometric_correlation" in values[1] else "overlap"] == "0.8"
    assert (values[3]["reason"], values[4]["reason"]) == ("CONFLICT", "DEPTH_SIZE")


def test_frames_and_messages_say_the_same(tmp_path):
    results = [started(), tracked(1, lead_log10=4.25, keyframe_stamp_ns=7), lost(2), refused(3)]
    write_frames(results, tmp_path / "frames.csv")
    with (tmp_path / "frames.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for result, row in zip(results, rows, strict=True):
        for name, text in known_values_of(result).items():
            assert row[name] == {"True": "1", "False": "0"}.get(text, text)
        blank = {name for name in values_of(result) if row[name] in ("", "nan")}
        assert blank.isdisjoint(name for name, text in known_values_of(result).items() if text)
    assert (rows[1]["lead_log10"], rows[1]["keyframe_stamp_ns"], rows[1]["ms_keypoints"]) == ("4.25", "7", "20.000")
    assert (rows[2]["reason"], rows[2]["message"]) == ("CONFLICT", "40.0% coincides, expected 60.0%")
    assert (rows[3]["state"], rows[3]["overlap"], rows[3]["ms_keypoints"]) == ("REFUSED", "", "")


def test_renamed_columns_keep_their_old_names_for_a_release():
    values = values_of(tracked(1, photometric_correlation=0.8))
    assert RENAMED_COLUMNS == {"likeness": "photometric_correlation"}
    assert values["likeness"] == values["photometric_correlation"] == 0.8


def test_messages_carry_no_figure_that_is_not_finite():
    known = known_values_of(tracked(1, lead_log10=math.nan))
    assert "lead_log10" not in known
    assert all(math.isfinite(float(text)) for name, text in known.items() if name.startswith(("sigma", "over", "con")))
