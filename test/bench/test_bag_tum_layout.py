# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The layout of the TUM benchmark: every file keeps its stamp."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vigg_ros.bench.datasets.convert import open_dataset
from vigg_ros.registration import BagError
from vigg_ros_testing.dataset_samples import real_data, tum


def test_tum_keeps_every_stamp_and_associates_within_20_ms(tmp_path: Path) -> None:
    dataset = open_dataset("tum", tum(tmp_path / "fr1"), intrinsics=(7, 6, 3.5, 2.5))
    assert [file.stamp_ns for file in dataset.images] == [
        1305031102_175304000,
        1305031102_211214000,
        1305031102_243211000,
    ]
    assert dataset.depths[1].stamp_ns == 1305031102_226738000
    assert len(dataset.poses) == 12
    frames = dataset.frames()
    # The third image is 16 ms from the second depth image, which is nearer to the second image.
    assert [frame.number for frame in frames] == [0, 1]
    np.testing.assert_allclose(frames[0].depth_m()[1:], 1.0, rtol=1e-6)
    # Poses stand at .150, .160, ..: the nearest to .175304 is .180, number 3; to .211214 .210, number 6.
    np.testing.assert_allclose([frame.T_world_sensor[0, 3] for frame in frames], [3, 6])


def test_tum_without_intrinsics_takes_the_recommended_ones_with_a_note(tmp_path: Path) -> None:
    dataset = open_dataset("tum", tum(tmp_path))
    assert (dataset.camera.fx_px, dataset.camera.cx_px, dataset.camera.cy_px) == (525, 319.5, 239.5)
    assert any("525 525 319.5 239.5" in note for note in dataset.notes)


def test_tum_without_truth_has_a_note(tmp_path: Path) -> None:
    folder = tum(tmp_path)
    (folder / "groundtruth.txt").unlink()
    dataset = open_dataset("tum", folder)
    assert dataset.poses == ()
    assert "no groundtruth.txt" in dataset.notes[0]


@pytest.mark.parametrize(
    ("content", "complaint"),
    [("", "lists no images"), ("1.0\n", "line 1: 1 columns"), ("one a.png\n", "'one' is no stamp")],
)
def test_broken_tum_lists_are_named(content: str, complaint: str, tmp_path: Path) -> None:
    folder = tum(tmp_path)
    (folder / "depth.txt").write_text(content)
    with pytest.raises(BagError, match=rf"depth\.txt.*{complaint}"):
        open_dataset("tum", folder)


def test_real_tum_images_are_read_by_their_scale(tmp_path: Path) -> None:
    case = real_data("tum_pairs") / "case_1"
    folder = tmp_path / "fr"
    folder.mkdir()
    for k, name in enumerate(("prev", "curr")):
        for kind, source in (("rgb", "img"), ("depth", "dep")):
            with (folder / f"{kind}.txt").open("a") as listing:
                listing.write(f"130503110{k}.5 {case}/{source}_{name}.png\n")
        with (folder / "groundtruth.txt").open("a") as poses:
            poses.write(f"130503110{k}.5 {(case / f'pose_{name}.txt').read_text().strip()}\n")
    frames = open_dataset("tum", folder).frames()
    assert [frame.stamp_ns for frame in frames] == [1305031100_500000000, 1305031101_500000000]
    depth_m = frames[0].depth_m()
    assert 0.5 < np.median(depth_m[depth_m > 0]) < 4  # the desk scenes of freiburg1
    motion = np.linalg.inv(frames[0].T_world_sensor) @ frames[1].T_world_sensor
    assert 0.001 < np.linalg.norm(motion[:3, 3]) < 0.1  # "close pairs"
